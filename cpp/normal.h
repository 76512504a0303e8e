// Normal equations N = J'J with the points eliminated, in two parts: the unknowns of single images (poses and effect
// parameters per image: sparse) and the shared ones (cameras and the other effect parameters: few, dense). Rank,
// covariance, and what a full Gauss-Newton step would still gain.

#ifndef MISCLOSURE_NORMAL_H_
#define MISCLOSURE_NORMAL_H_

#include <Eigen/CholmodSupport>
#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <algorithm>
#include <new>
#include <unordered_map>
#include <utility>
#include <vector>

#include "adjustment.h"
#include "problem.h"

namespace misclosure {

// What is left of a diagonal entry or pivot after elimination is rounding below this share.
constexpr double kRounding = 1e-14;

class Normal {
 public:
  // At the present values of the adjustment, with robust weights or without. Eliminates the points; throws Singular
  // where one is not determined by its rays.
  Normal(const ProblemView& view, const Adjustment& adjustment, bool robust);

  // Points eliminated, nothing else.
  ReducedSystem Dense() const;

  // Factorises; throws Singular with the directions that have no information.
  void Factorise();

  // Drop of chi-square that a full step would bring by the linear model: g' N^-1 g. After Factorise.
  double Decrement() const;

  // The full step -N^-1 g by unknown, raw. After Factorise.
  std::vector<double> Step() const;

  // After Factorise.
  Covariance Invert(bool everything) const;

 private:
  using Sparse = Eigen::SparseMatrix<double>;
  struct Factor : Eigen::CholmodSupernodalLLT<Sparse> {
    double ReciprocalCondition() { return cholmod_rcond(m_cholmodFactor, &cholmod()); }
    // In place of Eigen's: that reads the factor also where there was no memory to make one.
    void compute(const Sparse& matrix) {
      analyzePattern(matrix);
      if (m_cholmodFactor == nullptr) throw std::bad_alloc();
      factorize(matrix);
      // Eigen takes it for a matrix that is not positive definite, which would be told as a null space.
      if (cholmod().status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
    }
  };
  // One point's part: N over (point; images that see it; shared).
  struct PointPart {
    Eigen::Matrix3d v;
    Eigen::Matrix3d inverse;
    Eigen::Vector3d gradient;
    std::vector<std::size_t> images;
    std::vector<Eigen::Matrix<double, 3, Eigen::Dynamic>> w;  // by image; not all are in use
    Eigen::Matrix<double, 3, Eigen::Dynamic> shared;
  };
  // A column of some rows, and the place of its unknown among those of its kind.
  struct Entry {
    std::size_t place;
    const double* values;
  };

  void NumberUnknowns();
  void Accumulate();
  // Calls use(rows) for each residual block that the point is in.
  template <class Use>
  void ForRowsOf(std::size_t point, Use use) const;
  void Clear(PointPart& part) const;
  void AddTo(PointPart& part, std::size_t point, const Rows& rows) const;
  void Finish(PointPart& part, std::size_t point) const;
  void Add(const Rows& rows);
  void Eliminate(const PointPart& part);
  double* Block(std::size_t a, std::size_t b);
  Sparse SideMatrix(const Eigen::VectorXd& scale) const;
  void FindSideNullSpace(bool failed) const;
  void FindSharedNullSpace() const;
  NullDirection Direction(const std::vector<std::size_t>& unknowns, const Eigen::VectorXd& components) const;
  Eigen::MatrixXd SolveSide(const Eigen::MatrixXd& b) const;
  std::size_t SideSize(std::size_t image) const { return side_start_[image + 1] - side_start_[image]; }

  const ProblemView& view_;
  const Adjustment& adjustment_;
  bool robust_;
  std::vector<std::size_t> side_unknowns_, shared_unknowns_;
  std::vector<std::size_t> side_start_;             // by image
  std::vector<std::ptrdiff_t> side_of_, shared_of_;  // by unknown, -1: not there
  std::vector<std::size_t> image_of_side_;
  std::vector<std::pair<std::size_t, std::size_t>> control_;  // point, residual block; sorted
  std::vector<Entry> side_entries_, shared_entries_;          // of the rows at hand

  std::unordered_map<uint64_t, std::size_t> block_index_;  // image pair a >= b -> where its block starts
  std::vector<std::pair<std::size_t, std::size_t>> block_pairs_;
  std::vector<double> blocks_;
  Eigen::MatrixXd side_shared_, shared_;
  Eigen::VectorXd side_gradient_, shared_gradient_;
  Eigen::VectorXd side_diagonal_, shared_diagonal_;  // before the points were eliminated
  double point_decrement_ = 0.0;

  Eigen::VectorXd side_scale_;
  mutable Factor factor_;
  Eigen::MatrixXd side_inverse_shared_;  // S_pp^-1 S_ps
  Eigen::MatrixXd shared_reduced_;       // S_ss - S_sp S_pp^-1 S_ps
  Eigen::MatrixXd shared_covariance_;
};

template <class Use>
void Normal::ForRowsOf(std::size_t point, Use use) const {
  Rows rows;
  const auto visit = [&](std::size_t block) {
    adjustment_.Linearise(block, robust_, rows);
    use(rows);
  };
  for (std::size_t o = view_.point_start[point]; o < view_.point_start[point + 1]; ++o) visit(o);
  auto control = std::lower_bound(control_.begin(), control_.end(), std::make_pair(point, std::size_t{0}));
  for (; control != control_.end() && control->first == point; ++control) visit(control->second);
}

}  // namespace misclosure

#endif  // MISCLOSURE_NORMAL_H_
