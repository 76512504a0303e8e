// Covariances of shared unknowns, poses and points, and what a full step would gain: solutions with the factors.

#include <algorithm>
#include <new>

#include "normal.h"

namespace misclosure {
namespace {

// Columns of the dense inverse that are solved for at a time.
constexpr Eigen::Index kPanel = 256;

}  // namespace

Eigen::MatrixXd Normal::SolveSide(const Eigen::MatrixXd& b) const {
  if (b.rows() == 0 || b.cols() == 0) return Eigen::MatrixXd::Zero(b.rows(), b.cols());
  const Eigen::MatrixXd scaled = side_scale_.asDiagonal() * b;
  const Eigen::MatrixXd solution = factor_.solve(scaled);
  // Eigen leaves the solution as it was.
  if (factor_.cholmod().status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
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

std::vector<double> Normal::Step() const {
  std::vector<double> step(view_.unknowns(), 0.0);
  const Eigen::VectorXd rest = shared_gradient_ - side_inverse_shared_.transpose() * side_gradient_;
  const Eigen::VectorXd shared = -(shared_covariance_ * rest);
  const Eigen::VectorXd side = -SolveSide(side_gradient_) - side_inverse_shared_ * shared;
  for (Eigen::Index i = 0; i < side.size(); ++i) step[side_unknowns_[i]] = side[i];
  for (Eigen::Index i = 0; i < shared.size(); ++i) step[shared_unknowns_[i]] = shared[i];
  PointPart part;
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    Clear(part);
    ForRowsOf(j, [&](const Rows& rows) { AddTo(part, j, rows); });
    Finish(part, j);
    Eigen::Vector3d gradient = part.gradient + part.shared * shared;
    for (std::size_t a = 0; a < part.images.size(); ++a) {
      gradient += part.w[a] * side.segment(static_cast<Eigen::Index>(side_start_[part.images[a]]), part.w[a].cols());
    }
    const Eigen::Vector3d point = -(part.inverse * gradient);
    std::copy_n(point.data(), 3, &step[view_.point_unknown(j, 0)]);
  }
  return step;
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
    const Eigen::MatrixXd block =
        inverse.block(start, start, size, size) + part * shared_covariance_ * part.transpose();
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

  // A point moves with the images and the shared unknowns that its rays hang on: V^-1 + V^-1 W S^-1 W' V^-1, where the
  // images' part of S^-1 is S_pp^-1 + Y Sigma Y' and its coupling to the shared ones -Y Sigma.
  result.points.assign(9 * view_.point_count(), 0.0);
  PointPart part;
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    Clear(part);
    ForRowsOf(j, [&](const Rows& rows) { AddTo(part, j, rows); });
    Finish(part, j);
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
