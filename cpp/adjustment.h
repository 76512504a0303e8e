// A ProblemView as a ceres::Problem: parameter blocks, their manifolds, cost functions, and the way back to the
// numbering of the unknowns.

#ifndef MISCLOSURE_ADJUSTMENT_H_
#define MISCLOSURE_ADJUSTMENT_H_

#include <ceres/ceres.h>

#include <deque>
#include <initializer_list>
#include <memory>
#include <vector>

#include "chain.h"
#include "problem.h"
#include "residuals.h"

namespace misclosure {

// The rows of one residual block: an image measurement, an observed position, a prior.
struct Rows {
  int count = 0;
  double residuals[3];
  std::vector<std::size_t> columns;  // unknowns, free ones alone, in no order
  std::vector<double> values;        // column by column, raw units

  const double* column(std::size_t c) const { return values.data() + c * count; }
};

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

  // Residuals and Jacobian at the present values, without robust weights.
  Evaluation Evaluate() const;

  // Residual blocks are counted in the order of the residuals: image measurements first.
  std::size_t residual_block_count() const { return residual_blocks_.size(); }

  // The rows of residual block k at the present values, with robust weights or without.
  void Linearise(std::size_t k, bool robust, Rows& rows) const;

  // Throws CannotProject for the first observation that cannot be computed, if there is one.
  void FindCulprit() const;

  // Adds a step, by unknown and raw, to the present values.
  void Move(const std::vector<double>& step);

  // Present values, raw.
  void Store(Solution& solution) const;

 private:
  // Tangent coordinate -> unknown: d residual / d unknown = factor x d residual / d coordinate.
  struct Column {
    std::size_t unknown;
    double factor;
  };
  // Those of a parameter block, in `columns_`.
  struct Free {
    uint32_t start = 0, count = 0;
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
  void Variable(const double* block, const std::vector<Column>& columns);
  Chain MakeChain(const misclosure_context& context, std::initializer_list<Stage> stages);
  double* Pose(std::size_t i) { return &values_[7 * i]; }
  double* Theta(const ThetaBlock& block) { return &values_[theta_start_ + block.offset]; }
  double* Camera(std::size_t c) { return &values_[camera_start_ + 12 * c]; }
  double* Point(std::size_t j) { return &values_[point_start_ + 3 * j]; }
  std::size_t ThetaIndex(std::size_t slot, const misclosure_context& context) const;
  void AddResidual(ceres::CostFunction& cost, ceres::LossFunction* loss, std::initializer_list<double*> own,
                   const Chain& chain);

  const ProblemView& view_;
  std::vector<CameraBlock> camera_blocks_;
  // Every parameter block in one array: Ceres orders blocks by their addresses, and results must not depend on the
  // heap.
  std::vector<double> values_;
  std::size_t theta_start_ = 0, camera_start_ = 0, point_start_ = 0;
  std::vector<ThetaBlock> theta_blocks_;
  std::vector<Place> theta_places_;
  std::vector<std::unique_ptr<ceres::Manifold>> manifolds_;
  std::unique_ptr<ceres::LossFunction> loss_;
  std::vector<ImageChain> image_chains_;
  std::vector<Chain> position_chains_;
  Chain control_chain_;
  // Deques: cost functions cannot be moved.
  std::deque<ImageCost> image_costs_;
  std::deque<PositionCost> position_costs_;
  std::deque<PriorCost> prior_costs_;
  std::vector<Column> columns_;
  std::vector<Free> free_;  // by the block's place in `values_`
  int reduced_size_ = 0;
  std::vector<double*> parameter_blocks_;  // of the residual block that is added
  std::vector<ceres::ResidualBlockId> residual_blocks_;
  ceres::Problem problem_;  // last: it is destroyed first
};

}  // namespace misclosure

#endif  // MISCLOSURE_ADJUSTMENT_H_
