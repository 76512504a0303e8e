#include "normal.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

namespace misclosure {

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
  return blocks_.data() + found->second;  // one past the end for a block without entries, of an image that is held
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
    const double* block = blocks_.data() + block_index_.at(static_cast<uint64_t>(a) << 32 | b);
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

}  // namespace misclosure
