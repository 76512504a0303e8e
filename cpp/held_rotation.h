// A rotation of which some components of w are held: QuaternionManifold on the others.

#ifndef MISCLOSURE_HELD_ROTATION_H_
#define MISCLOSURE_HELD_ROTATION_H_

#include <ceres/manifold.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace misclosure {

class HeldRotation final : public ceres::Manifold {
 public:
  explicit HeldRotation(std::vector<int> free) : free_(std::move(free)) {}
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return static_cast<int>(free_.size()); }
  bool Plus(const double* x, const double* delta, double* out) const override {
    double full[3] = {0.0, 0.0, 0.0};
    for (std::size_t k = 0; k < free_.size(); ++k) full[free_[k]] = delta[k];
    return whole_.Plus(x, full, out);
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    double full[12];
    if (!whole_.PlusJacobian(x, full)) return false;
    for (int row = 0; row < 4; ++row) {
      for (std::size_t k = 0; k < free_.size(); ++k) jacobian[row * free_.size() + k] = full[3 * row + free_[k]];
    }
    return true;
  }
  bool Minus(const double* y, const double* x, double* out) const override {
    double full[3];
    if (!whole_.Minus(y, x, full)) return false;
    for (std::size_t k = 0; k < free_.size(); ++k) out[k] = full[free_[k]];
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    double full[12];
    if (!whole_.MinusJacobian(x, full)) return false;
    for (std::size_t k = 0; k < free_.size(); ++k) std::copy_n(full + 4 * free_[k], 4, jacobian + 4 * k);
    return true;
  }

 private:
  std::vector<int> free_;
  ceres::QuaternionManifold whole_;
};

}  // namespace misclosure

#endif  // MISCLOSURE_HELD_ROTATION_H_
