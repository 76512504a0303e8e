// A ProblemView as a ceres::Problem: parameter blocks, their manifolds, cost functions, and the way back to the numbering of the
// unknowns.

#ifndef MISCLOSURE_ADJUSTMENT_H_
#define MISCLOSURE_ADJUSTMENT_H_

#include <ceres/ceres.h>

#include <memory>
#include <vector>

#include "chain.h"
#include "residuals.h"
#include "solve.h"

namespace misclosure {

class Adjustment {
 public:
  // The view's arrays must outlive this.
  explicit Adjustment(const ProblemView& view);
  Adjustment(const Adjustment&) = delete;

  ceres::Problem& problem() { return problem_; }

  // Groups for the elimination: points first.
  std::shared_ptr<ceres::ParameterBlockOrdering> Ordering() const;

  // Free unknowns that are not points, as the solver counts them.
  int ReducedSize() const { return reduced_size_; }

  // Residuals and Jacobian at the present values, with robust weights or without.
  Evaluation Linearise(bool robust, int threads);

  // Throws CannotProject for the first observation that cannot be computed, if there is one.
  void FindCulprit() const;

  // Present values, raw.
  void Store(Solution& solution) const;

 private:
  // Tangent coordinate -> unknown: d residual / d unknown = factor x d residual / d coordinate.
  struct Column {
    std::size_t unknown;
    double factor;
  };
  struct ThetaBlock {
    std::size_t offset;
    std::vector<std::size_t> members;  // positions in theta
  };
  struct Place {
    int block = -1;
    int entry = 0;
  };

  std::size_t MakeThetaBlocks();  // number of their values
  void AddCameras();
  void AddThetas();
  void AddPoses();
  void AddPoints();
  void AddResiduals();
  void Variable(double* block, const std::vector<Column>& columns);
  Chain MakeChain(const misclosure_context& context, std::initializer_list<Stage> stages);
  double* Rotation(std::size_t i) { return &values_[7 * i]; }
  double* Centre(std::size_t i) { return &values_[7 * i + 4]; }
  double* Theta(const ThetaBlock& block) { return &values_[theta_start_ + block.offset]; }
  double* Camera(std::size_t c) { return &values_[camera_start_ + 12 * c]; }
  double* Point(std::size_t j) { return &values_[point_start_ + 3 * j]; }
  std::size_t ThetaIndex(std::size_t slot, const misclosure_context& context) const;
  template <class Cost>
  void AddResidual(Cost* cost, ceres::LossFunction* loss, std::vector<double*> blocks, const Chain& chain);

  const ProblemView& view_;
  std::vector<CameraBlock> camera_blocks_;
  // Every parameter block in one array: Ceres orders blocks by their addresses, and results must not depend on the heap.
  std::vector<double> values_;
  std::size_t theta_start_ = 0, camera_start_ = 0, point_start_ = 0;
  std::vector<ThetaBlock> theta_blocks_;
  std::vector<Place> theta_places_;
  std::vector<std::unique_ptr<ceres::Manifold>> manifolds_;
  std::unique_ptr<ceres::LossFunction> loss_;
  std::vector<Chain> image_chains_, position_chains_;
  Chain control_chain_;
  std::vector<double*> variables_;
  std::vector<Column> columns_;
  int reduced_size_ = 0;
  ceres::Problem problem_;  // last: it is destroyed first
};

}  // namespace misclosure

#endif  // MISCLOSURE_ADJUSTMENT_H_
