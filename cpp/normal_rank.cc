// Factorisation of the reduced normal equations, and the directions that have no information.

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "normal.h"

namespace misclosure {
namespace {

// Information, in unit weight, of a direction one domain long: below one it is not determined.
constexpr double kLeastInformation = 1.0;
// Largest plausible range of a pose (rad, m) and, in units of its scale, of an effect parameter.
constexpr double kRotationDomain = 1.0;
constexpr double kCentreDomain = 1000.0;
constexpr double kThetaDomain = 1000.0;
// Components of a null direction below this share of the largest are not worth a name.
constexpr double kSmallestComponent = 0.1;

// The same null space in the basis with the fewest components (Gauss-Jordan with pivoting); columns of unit length.
Eigen::MatrixXd SparseBasis(Eigen::MatrixXd basis) {
  std::vector<bool> used(basis.rows(), false);
  for (Eigen::Index k = 0; k < basis.cols(); ++k) {
    Eigen::Index pivot = -1;
    for (Eigen::Index i = 0; i < basis.rows(); ++i) {
      if (!used[i] && (pivot < 0 || std::abs(basis(i, k)) > std::abs(basis(pivot, k)))) pivot = i;
    }
    if (pivot < 0 || basis(pivot, k) == 0.0) continue;
    used[pivot] = true;
    basis.col(k) /= basis(pivot, k);
    for (Eigen::Index j = 0; j < basis.cols(); ++j) {
      if (j != k) basis.col(j) -= basis.col(k) * basis(pivot, j);
    }
  }
  return basis.colwise().normalized();
}

}  // namespace

NullDirection Normal::Direction(const std::vector<std::size_t>& unknowns, const Eigen::VectorXd& components) const {
  std::vector<Eigen::Index> order(components.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](auto a, auto b) { return std::abs(components[a]) > std::abs(components[b]); });
  NullDirection direction;
  const double sign = components[order[0]] < 0.0 ? -1.0 : 1.0;
  for (Eigen::Index k : order) {
    if (std::abs(components[k]) < kSmallestComponent * std::abs(components[order[0]])) break;
    direction.unknowns.push_back(unknowns[k]);
    direction.components.push_back(sign * components[k]);
  }
  return direction;
}

void Normal::Factorise() {
  const Eigen::Index n = static_cast<Eigen::Index>(side_unknowns_.size());
  side_scale_.resize(n);
  if (n > 0) {
    const Sparse raw = SideMatrix(Eigen::VectorXd::Ones(n));
    bool failed = false;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double entry = raw.coeff(i, i);
      failed = failed || !(entry > kRounding * side_diagonal_[i]);
      side_scale_[i] = entry > 0.0 ? 1.0 / std::sqrt(entry) : 1.0;
    }
    if (!failed) {
      factor_.cholmod().print = 0;
      factor_.compute(SideMatrix(side_scale_));
      failed = factor_.info() != Eigen::Success;
    }
    if (failed || factor_.ReciprocalCondition() < kRounding) FindSideNullSpace(failed);
  }
  side_inverse_shared_ = SolveSide(side_shared_);
  shared_reduced_ = shared_ - side_shared_.transpose() * side_inverse_shared_;
  shared_reduced_ = (0.5 * (shared_reduced_ + shared_reduced_.transpose())).eval();
  FindSharedNullSpace();
  const Eigen::VectorXd scale = shared_reduced_.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * shared_reduced_ * scale.asDiagonal();
  shared_covariance_ = scale.asDiagonal() *
                       scaled.llt().solve(Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols())) * scale.asDiagonal();
}

// Inverse iteration on the side part, in units of domains: directions of poses that nothing fixes.
void Normal::FindSideNullSpace(bool failed) const {
  const Eigen::Index n = static_cast<Eigen::Index>(side_unknowns_.size());
  Eigen::VectorXd domain(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t unknown = side_unknowns_[i];
    const std::size_t first_pose = view_.pose_unknown(0, 0);
    if (unknown < first_pose) {
      domain[i] = kThetaDomain * view_.theta_scales[unknown - view_.theta_unknown(0)];
    } else {
      domain[i] = (unknown - first_pose) % 6 < 3 ? kRotationDomain : kCentreDomain;
    }
  }
  const Sparse matrix = SideMatrix(domain);
  double largest = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) largest = std::max(largest, side_diagonal_[i] * domain[i] * domain[i]);
  const double least = std::max(kLeastInformation, kRounding * largest);
  Sparse shifted = matrix;
  for (Eigen::Index i = 0; i < n; ++i) shifted.coeffRef(i, i) += 10.0 * least;
  Factor factor;
  factor.cholmod().print = 0;
  factor.compute(shifted);
  // As many as a block without any datum has, and one to see that there are no more.
  const Eigen::Index count = std::min<Eigen::Index>(n, 8);
  Eigen::MatrixXd basis(n, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    for (Eigen::Index i = 0; i < n; ++i) basis(i, k) = std::cos(static_cast<double>((i + 1) * (k + 1)));
  }
  if (factor.info() == Eigen::Success) {
    constexpr int kRounds = 6;  // each divides what is not null by its information in units of ten
    for (int round = 0; round < kRounds; ++round) {
      basis = factor.solve(basis).eval();
      basis =
          (Eigen::HouseholderQR<Eigen::MatrixXd>(basis).householderQ() * Eigen::MatrixXd::Identity(n, count)).eval();
    }
  }
  const Eigen::MatrixXd small = basis.transpose() * (matrix.selfadjointView<Eigen::Lower>() * basis);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(small);
  Eigen::Index null = 0;
  while (null < count && eigen.eigenvalues()[null] < least) ++null;
  if (null == 0 && failed) null = 1;
  if (null == 0) return;
  const Eigen::MatrixXd found = SparseBasis(basis * eigen.eigenvectors().leftCols(null));
  std::vector<NullDirection> directions;
  for (Eigen::Index k = 0; k < null; ++k) directions.push_back(Direction(side_unknowns_, found.col(k)));
  throw Singular(std::move(directions));
}

void Normal::FindSharedNullSpace() const {
  const Eigen::Index k = shared_reduced_.rows();
  if (k == 0) return;
  Eigen::VectorXd domain(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const std::size_t unknown = shared_unknowns_[i];
    domain[i] = unknown < view_.theta_unknown(0) ? view_.camera_domains[unknown]
                                                 : kThetaDomain * view_.theta_scales[unknown - view_.theta_unknown(0)];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(domain.asDiagonal() * shared_reduced_ *
                                                             domain.asDiagonal());
  const double largest = shared_diagonal_.cwiseProduct(domain.cwiseAbs2()).maxCoeff();
  const double least = std::max(kLeastInformation, kRounding * largest);
  Eigen::Index null = 0;
  while (null < k && eigen.eigenvalues()[null] < least) ++null;
  if (null == 0) return;
  const Eigen::MatrixXd found = SparseBasis(eigen.eigenvectors().leftCols(null));
  std::vector<NullDirection> directions;
  for (Eigen::Index i = 0; i < null; ++i) directions.push_back(Direction(shared_unknowns_, found.col(i)));
  throw Singular(std::move(directions));
}

}  // namespace misclosure
