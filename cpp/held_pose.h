// A pose (quaternion 4, centre 3) as one parameter block: fewer and larger blocks make Ceres' elimination faster.

#ifndef MISCLOSURE_HELD_POSE_H_
#define MISCLOSURE_HELD_POSE_H_

#include <ceres/manifold.h>
#include <ceres/product_manifold.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace misclosure {

using PoseManifold = ceres::ProductManifold<ceres::QuaternionManifold, ceres::EuclideanManifold<3>>;

// A pose of which some components (w 3, C 3) are held: PoseManifold on the others.
class HeldPose final : public ceres::Manifold {
 public:
  explicit HeldPose(std::vector<int> free) : free_(std::move(free)) {}
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return static_cast<int>(free_.size()); }
  bool Plus(const double* x, const double* delta, double* out) const override {
    double full[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    for (std::size_t k = 0; k < free_.size(); ++k) full[free_[k]] = delta[k];
    return whole_.Plus(x, full, out);
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    double full[42];
    if (!whole_.PlusJacobian(x, full)) return false;
    for (int row = 0; row < 7; ++row) {
      for (std::size_t k = 0; k < free_.size(); ++k) jacobian[row * free_.size() + k] = full[6 * row + free_[k]];
    }
    return true;
  }
  bool Minus(const double* y, const double* x, double* out) const override {
    double full[6];
    if (!whole_.Minus(y, x, full)) return false;
    for (std::size_t k = 0; k < free_.size(); ++k) out[k] = full[free_[k]];
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    double full[42];
    if (!whole_.MinusJacobian(x, full)) return false;
    for (std::size_t k = 0; k < free_.size(); ++k) std::copy_n(full + 7 * free_[k], 7, jacobian + 7 * k);
    return true;
  }

 private:
  std::vector<int> free_;
  PoseManifold whole_;
};

}  // namespace misclosure

#endif  // MISCLOSURE_HELD_POSE_H_
