#include "normal.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

namespace misclosure {

Normal::Normal(const ProblemView& view, const Adjustment& adjustment, bool robust)
    : view_(view), adjustment_(adjustment), robust_(robust) {
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

  for (std::size_t k = 0; k < view_.control_point.size; ++k) {
    control_.emplace_back(view_.control_point[k], view_.observation_image.size + k);
  }
  std::sort(control_.begin(), control_.end());
}

double* Normal::Block(std::size_t a, std::size_t b) {
  const auto [found, fresh] = block_index_.try_emplace(static_cast<uint64_t>(a) << 32 | b, blocks_.size());
  if (fresh) {
    block_pairs_.emplace_back(a, b);
    blocks_.resize(blocks_.size() + SideSize(a) * SideSize(b), 0.0);
  }
  return blocks_.data() + found->second;  // one past the end for a block without entries, of an image that is held
}

// The part of the rows that has nothing to do with points. No residual block has unknowns of two images.
void Normal::Add(const Rows& rows) {
  side_entries_.clear();
  shared_entries_.clear();
  for (std::size_t c = 0; c < rows.columns.size(); ++c) {
    const std::ptrdiff_t side = side_of_[rows.columns[c]];
    const std::ptrdiff_t shared = shared_of_[rows.columns[c]];
    if (side >= 0) side_entries_.push_back({static_cast<std::size_t>(side), rows.column(c)});
    if (shared >= 0) shared_entries_.push_back({static_cast<std::size_t>(shared), rows.column(c)});
  }
  const auto dot = [&](const double* a, const double* b) {
    double sum = 0.0;
    for (int i = 0; i < rows.count; ++i) sum += a[i] * b[i];
    return sum;
  };
  for (const Entry& a : shared_entries_) {
    shared_gradient_[a.place] += dot(a.values, rows.residuals);
    shared_diagonal_[a.place] += dot(a.values, a.values);
    for (const Entry& b : shared_entries_) shared_(b.place, a.place) += dot(a.values, b.values);
    for (const Entry& b : side_entries_) side_shared_(b.place, a.place) += dot(a.values, b.values);
  }
  if (side_entries_.empty()) return;
  const std::size_t image = image_of_side_[side_entries_[0].place];
  const std::size_t start = side_start_[image];
  const std::size_t size = SideSize(image);
  double* block = Block(image, image);
  for (const Entry& a : side_entries_) {
    side_gradient_[a.place] += dot(a.values, rows.residuals);
    side_diagonal_[a.place] += dot(a.values, a.values);
    for (const Entry& b : side_entries_) {
      block[(a.place - start) * size + (b.place - start)] += dot(a.values, b.values);
    }
  }
}

void Normal::Clear(PointPart& part) const {
  part.v.setZero();
  part.gradient.setZero();
  part.shared.setZero(3, static_cast<Eigen::Index>(shared_unknowns_.size()));
  part.images.clear();
}

void Normal::AddTo(PointPart& part, std::size_t point, const Rows& rows) const {
  const std::size_t first = view_.point_unknown(point, 0);
  Eigen::Matrix3d own = Eigen::Matrix3d::Zero();  // unknown x row
  for (std::size_t c = 0; c < rows.columns.size(); ++c) {
    if (rows.columns[c] < first) continue;
    for (int i = 0; i < rows.count; ++i) own(rows.columns[c] - first, i) = rows.column(c)[i];
  }
  const auto times = [&](const double* column) {
    Eigen::Vector3d product = Eigen::Vector3d::Zero();
    for (int i = 0; i < rows.count; ++i) product += own.col(i) * column[i];
    return product;
  };
  part.v += own * own.transpose();
  part.gradient += times(rows.residuals);
  for (std::size_t c = 0; c < rows.columns.size(); ++c) {
    const std::ptrdiff_t shared = shared_of_[rows.columns[c]];
    const std::ptrdiff_t side = side_of_[rows.columns[c]];
    if (shared >= 0) part.shared.col(shared) += times(rows.column(c));
    if (side < 0) continue;
    const std::size_t image = image_of_side_[side];
    const std::size_t at = std::find(part.images.begin(), part.images.end(), image) - part.images.begin();
    if (at == part.images.size()) {
      part.images.push_back(image);
      if (at == part.w.size()) part.w.emplace_back();
      part.w[at].setZero(3, static_cast<Eigen::Index>(SideSize(image)));
    }
    part.w[at].col(side - static_cast<std::ptrdiff_t>(side_start_[image])) += times(rows.column(c));
  }
}

void Normal::Finish(PointPart& part, std::size_t point) const {
  // Scaled to a unit diagonal, so that the pivots tell rounding from information.
  Eigen::Vector3d scale = part.v.diagonal().cwiseSqrt();
  for (int i = 0; i < 3; ++i) scale[i] = scale[i] > 0.0 ? 1.0 / scale[i] : 1.0;
  const Eigen::Matrix3d scaled = scale.asDiagonal() * part.v * scale.asDiagonal();
  const Eigen::LLT<Eigen::Matrix3d> llt(scaled);
  const double least = llt.info() == Eigen::Success ? llt.matrixLLT().diagonal().minCoeff() : 0.0;
  if (!(least * least > kRounding)) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scaled);
    Eigen::VectorXd direction = scale.asDiagonal() * eigen.eigenvectors().col(0);
    const std::size_t first = view_.point_unknown(point, 0);
    throw Singular({Direction({first, first + 1, first + 2}, direction.normalized())});
  }
  part.inverse = scale.asDiagonal() * llt.solve(Eigen::Matrix3d::Identity()) * scale.asDiagonal();
}

void Normal::Eliminate(const PointPart& part) {
  const Eigen::Vector3d back = part.inverse * part.gradient;
  point_decrement_ += part.gradient.dot(back);
  const Eigen::Matrix<double, 3, Eigen::Dynamic> by_shared = part.inverse * part.shared;
  // Lazy: matrices as thin as these are not worth the packing of a general product.
  shared_ -= part.shared.transpose().lazyProduct(by_shared);
  shared_gradient_ -= part.shared.transpose().lazyProduct(back);
  for (std::size_t a = 0; a < part.images.size(); ++a) {
    const Eigen::Index start = static_cast<Eigen::Index>(side_start_[part.images[a]]);
    const Eigen::Index size = part.w[a].cols();
    side_shared_.middleRows(start, size) -= part.w[a].transpose().lazyProduct(by_shared);
    side_gradient_.segment(start, size) -= part.w[a].transpose().lazyProduct(back);
    const Eigen::Matrix<double, 3, Eigen::Dynamic> right = part.inverse * part.w[a];
    for (std::size_t b = 0; b < part.images.size(); ++b) {
      if (part.images[b] > part.images[a]) continue;
      using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowMajorMatrix> block(Block(part.images[a], part.images[b]), size, part.w[b].cols());
      block -= right.transpose().lazyProduct(part.w[b]);
    }
  }
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

  PointPart part;
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    Clear(part);
    ForRowsOf(j, [&](const Rows& rows) {
      Add(rows);
      AddTo(part, j, rows);
    });
    Finish(part, j);
    Eliminate(part);
  }
  Rows rows;
  for (std::size_t r = view_.observation_image.size + view_.control_point.size; r < adjustment_.residual_block_count();
       ++r) {
    adjustment_.Linearise(r, robust_, rows);
    Add(rows);
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
