#include "normal.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace misclosure {
namespace {

// What is left of a diagonal entry or pivot after elimination is rounding below this share.
constexpr double kRounding = 1e-14;
// Information, in unit weight, of a direction one domain long: below one it is not determined.
constexpr double kLeastInformation = 1.0;
// Largest plausible range of a pose (rad, m) and, in units of its scale, of an effect parameter.
constexpr double kRotationDomain = 1.0;
constexpr double kCentreDomain = 1000.0;
constexpr double kThetaDomain = 1000.0;
// Components of a null direction below this share of the largest are not worth a name.
constexpr double kSmallestComponent = 0.1;
// Columns of the dense inverse that are solved for at a time.
constexpr Eigen::Index kPanel = 256;

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

Normal::Normal(const ProblemView& view, const Evaluation& evaluation) : view_(view), rows_(evaluation) {
  NumberUnknowns();
  Accumulate();
}

void Normal::NumberUnknowns() {
  const std::size_t images = view_.images();
  std::vector<std::vector<std::size_t>> per_image(images);
  for (std::size_t i = 0; i < images; ++i) {
    for (std::size_t k = 0; k < 6; ++k) {
      if (view_.pose_free[6 * i + k]) per_image[i].push_back(view_.pose_unknown(i, k));
    }
  }
  std::vector<bool> of_image(view_.theta.size, false);
  for (std::size_t s = 0; s < view_.slot_scope.size; ++s) {
    if (view_.slot_scope[s] != static_cast<uint32_t>(Scope::kImage)) continue;
    for (std::size_t i = 0; i < images; ++i) {
      const std::size_t t = view_.slot_base[s] + i;
      of_image[t] = true;
      if (view_.theta_free[t]) per_image[i].push_back(view_.theta_unknown(t));
    }
  }
  side_of_.assign(view_.unknowns(), -1);
  shared_of_.assign(view_.unknowns(), -1);
  side_start_.push_back(0);
  for (std::size_t i = 0; i < images; ++i) {
    for (std::size_t unknown : per_image[i]) {
      side_of_[unknown] = static_cast<std::ptrdiff_t>(side_unknowns_.size());
      side_unknowns_.push_back(unknown);
      image_of_side_.push_back(i);
    }
    side_start_.push_back(side_unknowns_.size());
  }
  const auto share = [&](std::size_t unknown) {
    shared_of_[unknown] = static_cast<std::ptrdiff_t>(shared_unknowns_.size());
    shared_unknowns_.push_back(unknown);
  };
  for (std::size_t k = 0; k < view_.camera_free.size; ++k) {
    if (view_.camera_free[k]) share(k);
  }
  for (std::size_t t = 0; t < view_.theta.size; ++t) {
    if (view_.theta_free[t] && !of_image[t]) share(view_.theta_unknown(t));
  }

  const std::size_t first_point = view_.point_unknown(0, 0);
  rows_of_point_.resize(view_.point_count());
  for (std::size_t row = 0; row < rows_.residuals.size(); ++row) {
    const std::size_t end = rows_.row_start[row + 1];
    if (end > rows_.row_start[row] && rows_.columns[end - 1] >= first_point) {
      rows_of_point_[(rows_.columns[end - 1] - first_point) / 3].push_back(row);
    }
  }
}

double* Normal::Block(std::size_t a, std::size_t b) {
  const auto [found, fresh] = block_index_.try_emplace(static_cast<uint64_t>(a) << 32 | b, blocks_.size());
  if (fresh) {
    block_pairs_.emplace_back(a, b);
    blocks_.resize(blocks_.size() + SideSize(a) * SideSize(b), 0.0);
  }
  return &blocks_[found->second];
}

// The part of a row that has nothing to do with points.
void Normal::AddRow(std::size_t row) {
  const std::size_t begin = rows_.row_start[row];
  const std::size_t end = rows_.row_start[row + 1];
  const double residual = rows_.residuals[row];
  for (std::size_t k = begin; k < end; ++k) {
    const std::size_t unknown = rows_.columns[k];
    const double value = rows_.values[k];
    const std::ptrdiff_t side = side_of_[unknown];
    const std::ptrdiff_t shared = shared_of_[unknown];
    if (side >= 0) {
      side_gradient_[side] += value * residual;
      side_diagonal_[side] += value * value;
    } else if (shared >= 0) {
      shared_gradient_[shared] += value * residual;
      shared_diagonal_[shared] += value * value;
    } else {
      continue;
    }
    for (std::size_t l = begin; l < end; ++l) {
      const std::size_t other = rows_.columns[l];
      const double product = value * rows_.values[l];
      if (side >= 0 && side_of_[other] >= 0) {
        const std::size_t image = image_of_side_[side];
        double* block = Block(image, image);
        const std::size_t size = SideSize(image);
        block[(side - side_start_[image]) * size + (side_of_[other] - side_start_[image])] += product;
      } else if (side >= 0 && shared_of_[other] >= 0) {
        side_shared_(side, shared_of_[other]) += product;
      } else if (shared >= 0 && shared_of_[other] >= 0) {
        shared_(shared, shared_of_[other]) += product;
      }
    }
  }
}

void Normal::Gather(std::size_t point, PointPart& part) const {
  const std::size_t first = view_.point_unknown(point, 0);
  const Eigen::Index k = static_cast<Eigen::Index>(shared_unknowns_.size());
  part.v.setZero();
  part.gradient.setZero();
  part.shared.setZero(3, k);
  part.images.clear();
  part.w.clear();
  for (std::size_t row : rows_of_point_[point]) {
    const std::size_t begin = rows_.row_start[row];
    const std::size_t end = rows_.row_start[row + 1];
    Eigen::Vector3d own = Eigen::Vector3d::Zero();
    for (std::size_t e = begin; e < end; ++e) {
      if (rows_.columns[e] >= first) own[rows_.columns[e] - first] = rows_.values[e];
    }
    part.v += own * own.transpose();
    part.gradient += own * rows_.residuals[row];
    for (std::size_t e = begin; e < end; ++e) {
      const std::size_t unknown = rows_.columns[e];
      if (shared_of_[unknown] >= 0) {
        part.shared.col(shared_of_[unknown]) += own * rows_.values[e];
      } else if (side_of_[unknown] >= 0) {
        const std::size_t side = side_of_[unknown];
        const std::size_t image = image_of_side_[side];
        std::size_t at = std::find(part.images.begin(), part.images.end(), image) - part.images.begin();
        if (at == part.images.size()) {
          part.images.push_back(image);
          part.w.emplace_back(Eigen::Matrix<double, 3, Eigen::Dynamic>::Zero(3, SideSize(image)));
        }
        part.w[at].col(side - side_start_[image]) += own * rows_.values[e];
      }
    }
  }
  // Scaled to a unit diagonal, so that the pivots tell rounding from information.
  Eigen::Vector3d scale = part.v.diagonal().cwiseSqrt();
  for (int i = 0; i < 3; ++i) scale[i] = scale[i] > 0.0 ? 1.0 / scale[i] : 1.0;
  const Eigen::Matrix3d scaled = scale.asDiagonal() * part.v * scale.asDiagonal();
  const Eigen::LLT<Eigen::Matrix3d> llt(scaled);
  const double least = llt.info() == Eigen::Success ? llt.matrixLLT().diagonal().minCoeff() : 0.0;
  if (!(least * least > kRounding)) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scaled);
    Eigen::VectorXd direction = scale.asDiagonal() * eigen.eigenvectors().col(0);
    throw Singular({Direction({first, first + 1, first + 2}, direction.normalized())});
  }
  part.inverse = scale.asDiagonal() * llt.solve(Eigen::Matrix3d::Identity()) * scale.asDiagonal();
}

void Normal::Accumulate() {
  const Eigen::Index n = static_cast<Eigen::Index>(side_unknowns_.size());
  const Eigen::Index k = static_cast<Eigen::Index>(shared_unknowns_.size());
  side_shared_.setZero(n, k);
  shared_.setZero(k, k);
  side_gradient_.setZero(n);
  side_diagonal_.setZero(n);
  shared_gradient_.setZero(k);
  shared_diagonal_.setZero(k);
  for (std::size_t i = 0; i < view_.images(); ++i) Block(i, i);
  for (std::size_t row = 0; row < rows_.residuals.size(); ++row) AddRow(row);

  PointPart part;
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    Gather(j, part);
    const Eigen::Vector3d back = part.inverse * part.gradient;
    point_decrement_ += part.gradient.dot(back);
    const Eigen::Matrix<double, 3, Eigen::Dynamic> by_shared = part.inverse * part.shared;
    shared_.noalias() -= part.shared.transpose() * by_shared;
    shared_gradient_.noalias() -= part.shared.transpose() * back;
    for (std::size_t a = 0; a < part.images.size(); ++a) {
      const Eigen::Index start = static_cast<Eigen::Index>(side_start_[part.images[a]]);
      const Eigen::Index size = part.w[a].cols();
      side_shared_.middleRows(start, size).noalias() -= part.w[a].transpose() * by_shared;
      side_gradient_.segment(start, size).noalias() -= part.w[a].transpose() * back;
      const Eigen::Matrix<double, Eigen::Dynamic, 3> left = part.w[a].transpose() * part.inverse;
      for (std::size_t b = 0; b < part.images.size(); ++b) {
        if (part.images[b] > part.images[a]) continue;
        using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
        Eigen::Map<RowMajorMatrix> block(Block(part.images[a], part.images[b]), size, part.w[b].cols());
        block.noalias() -= left * part.w[b];
      }
    }
  }
}

Normal::Sparse Normal::SideMatrix(const Eigen::VectorXd& scale) const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(blocks_.size());
  for (const auto& [a, b] : block_pairs_) {
    const double* block = &blocks_[block_index_.at(static_cast<uint64_t>(a) << 32 | b)];
    for (std::size_t i = side_start_[a]; i < side_start_[a + 1]; ++i) {
      for (std::size_t j = side_start_[b]; j < side_start_[b + 1]; ++j, ++block) {
        if (i >= j) entries.emplace_back(static_cast<int>(i), static_cast<int>(j), *block * scale[i] * scale[j]);
      }
    }
  }
  const Eigen::Index n = static_cast<Eigen::Index>(side_unknowns_.size());
  Sparse matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

ReducedSystem Normal::Dense() const {
  std::vector<std::pair<std::size_t, Eigen::Index>> order;  // unknown, place
  const Eigen::Index n = static_cast<Eigen::Index>(side_unknowns_.size());
  const Eigen::Index k = static_cast<Eigen::Index>(shared_unknowns_.size());
  for (Eigen::Index i = 0; i < n; ++i) order.emplace_back(side_unknowns_[i], i);
  for (Eigen::Index i = 0; i < k; ++i) order.emplace_back(shared_unknowns_[i], n + i);
  std::sort(order.begin(), order.end());
  Eigen::MatrixXd whole(n + k, n + k);
  const Sparse side = SideMatrix(Eigen::VectorXd::Ones(n)).selfadjointView<Eigen::Lower>();
  whole.topLeftCorner(n, n) = Eigen::MatrixXd(side);
  whole.topRightCorner(n, k) = side_shared_;
  whole.bottomLeftCorner(k, n) = side_shared_.transpose();
  whole.bottomRightCorner(k, k) = shared_;
  ReducedSystem system;
  for (const auto& [unknown, row] : order) {
    system.unknowns.push_back(unknown);
    system.gradient.push_back(row < n ? side_gradient_[row] : shared_gradient_[row - n]);
    for (const auto& other : order) system.matrix.push_back(whole(row, other.second));
  }
  return system;
}

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
      basis = (Eigen::HouseholderQR<Eigen::MatrixXd>(basis).householderQ() * Eigen::MatrixXd::Identity(n, count)).eval();
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
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(domain.asDiagonal() * shared_reduced_ * domain.asDiagonal());
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

Eigen::MatrixXd Normal::SolveSide(const Eigen::MatrixXd& b) const {
  if (b.rows() == 0 || b.cols() == 0) return Eigen::MatrixXd::Zero(b.rows(), b.cols());
  const Eigen::MatrixXd scaled = side_scale_.asDiagonal() * b;
  const Eigen::MatrixXd solution = factor_.solve(scaled);
  return side_scale_.asDiagonal() * solution;
}

double Normal::Decrement() const {
  double decrement = point_decrement_;
  if (side_gradient_.size() > 0) decrement += side_gradient_.dot(SolveSide(side_gradient_).col(0));
  if (shared_gradient_.size() > 0) {
    const Eigen::VectorXd rest = shared_gradient_ - side_inverse_shared_.transpose() * side_gradient_;
    decrement += rest.dot(shared_covariance_ * rest);
  }
  return decrement;
}

Covariance Normal::Invert(bool everything) const {
  const Eigen::Index n = static_cast<Eigen::Index>(side_unknowns_.size());
  const Eigen::Index k = static_cast<Eigen::Index>(shared_unknowns_.size());
  Covariance result;
  result.shared_unknowns = shared_unknowns_;
  result.shared.assign(shared_covariance_.data(), shared_covariance_.data() + k * k);

  // Columns of S_pp^-1: all of them, or those of effect parameters per image.
  const std::size_t first_theta = view_.theta_unknown(0);
  const std::size_t first_pose = view_.pose_unknown(0, 0);
  std::vector<Eigen::Index> wanted;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (everything || side_unknowns_[i] < first_pose) wanted.push_back(i);
  }
  const Eigen::Index count = static_cast<Eigen::Index>(wanted.size());
  Eigen::MatrixXd inverse(n, everything ? n : 0);
  Eigen::VectorXd inverse_diagonal = Eigen::VectorXd::Zero(n);
  for (Eigen::Index begin = 0; begin < count; begin += kPanel) {
    const Eigen::Index width = std::min(kPanel, count - begin);
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(n, width);
    for (Eigen::Index c = 0; c < width; ++c) unit(wanted[begin + c], c) = 1.0;
    const Eigen::MatrixXd columns = SolveSide(unit);
    for (Eigen::Index c = 0; c < width; ++c) inverse_diagonal[wanted[begin + c]] = columns(wanted[begin + c], c);
    if (everything) inverse.middleCols(begin, width) = columns;
  }

  result.theta_variances.assign(view_.theta.size, 0.0);
  const auto& y = side_inverse_shared_;
  for (Eigen::Index i = 0; i < k; ++i) {
    if (shared_unknowns_[i] >= first_theta) {
      result.theta_variances[shared_unknowns_[i] - first_theta] = shared_covariance_(i, i);
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (side_unknowns_[i] >= first_pose) continue;
    result.theta_variances[side_unknowns_[i] - first_theta] =
        inverse_diagonal[i] + y.row(i).dot(shared_covariance_ * y.row(i).transpose());
  }
  if (!everything) return result;

  result.poses.assign(36 * view_.images(), 0.0);
  for (std::size_t image = 0; image < view_.images(); ++image) {
    const Eigen::Index start = static_cast<Eigen::Index>(side_start_[image]);
    const Eigen::Index size = static_cast<Eigen::Index>(SideSize(image));
    const auto part = y.middleRows(start, size);
    const Eigen::MatrixXd block = inverse.block(start, start, size, size) + part * shared_covariance_ * part.transpose();
    for (Eigen::Index i = 0; i < size; ++i) {
      if (side_unknowns_[start + i] < first_pose) continue;
      for (Eigen::Index j = 0; j < size; ++j) {
        if (side_unknowns_[start + j] < first_pose) continue;
        const std::size_t row = (side_unknowns_[start + i] - first_pose) % 6;
        const std::size_t col = (side_unknowns_[start + j] - first_pose) % 6;
        result.poses[36 * image + 6 * row + col] = 0.5 * (block(i, j) + block(j, i));
      }
    }
  }

  // A point moves with the images and the shared unknowns that its rays hang on: V^-1 + V^-1 W S^-1 W' V^-1, where the images'
  // part of S^-1 is S_pp^-1 + Y Sigma Y' and its coupling to the shared ones -Y Sigma.
  result.points.assign(9 * view_.point_count(), 0.0);
  PointPart part;
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    Gather(j, part);
    Eigen::Matrix<double, 3, Eigen::Dynamic> e = part.shared;
    Eigen::Matrix3d middle = Eigen::Matrix3d::Zero();
    for (std::size_t a = 0; a < part.images.size(); ++a) {
      const Eigen::Index start_a = static_cast<Eigen::Index>(side_start_[part.images[a]]);
      e.noalias() -= part.w[a] * y.middleRows(start_a, part.w[a].cols());
      for (std::size_t b = 0; b < part.images.size(); ++b) {
        const Eigen::Index start_b = static_cast<Eigen::Index>(side_start_[part.images[b]]);
        middle.noalias() +=
            part.w[a] * inverse.block(start_a, start_b, part.w[a].cols(), part.w[b].cols()) * part.w[b].transpose();
      }
    }
    middle += e * shared_covariance_ * e.transpose();
    const Eigen::Matrix3d block = part.inverse + part.inverse * middle * part.inverse;
    Eigen::Map<Eigen::Matrix3d>(&result.points[9 * j]) = 0.5 * (block + block.transpose());
  }
  return result;
}

}  // namespace misclosure
