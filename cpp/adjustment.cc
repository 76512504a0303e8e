#include "adjustment.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "held_pose.h"

namespace misclosure {
namespace {

// QuaternionManifold turns by exp(delta) with a quaternion of half angle |delta|: w = 2 delta.
constexpr double kDeltaPerW = 0.5;

ceres::Problem::Options ProblemOptions() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;  // sizes, and that blocks do not overlap
  return options;
}

}  // namespace

Adjustment::Adjustment(const ProblemView& view) : view_(view), problem_(ProblemOptions()) {
  const std::size_t thetas = MakeThetaBlocks();
  theta_start_ = 7 * view.images();
  camera_start_ = theta_start_ + thetas;
  point_start_ = camera_start_ + view.interiors.size;
  values_.resize(point_start_ + view.points.size);
  free_.resize(values_.size());
  AddCameras();
  AddThetas();
  AddPoses();
  reduced_size_ = static_cast<int>(columns_.size());
  AddPoints();
  AddResiduals();
}

// One block per effect, scope and instance: what appears together stands together.
std::size_t Adjustment::MakeThetaBlocks() {
  std::size_t size = 0;
  theta_places_.resize(view_.theta.size);
  const std::size_t flights = view_.images() > 0 ? view_.contexts[0].flight_count : 0;
  for (std::size_t e = 0; e < view_.effects.size; ++e) {
    for (uint32_t scope = 0; scope <= static_cast<uint32_t>(Scope::kImage); ++scope) {
      std::size_t instances = 1;
      if (scope == static_cast<uint32_t>(Scope::kCamera)) instances = view_.cameras();
      if (scope == static_cast<uint32_t>(Scope::kFlight) || scope == static_cast<uint32_t>(Scope::kFlightButFirst)) {
        instances = flights;
      }
      if (scope == static_cast<uint32_t>(Scope::kImage)) instances = view_.images();
      for (std::size_t instance = 0; instance < instances; ++instance) {
        ThetaBlock block{size, {}};
        for (std::size_t s = view_.slot_start[e]; s < view_.slot_start[e + 1]; ++s) {
          const std::size_t t = view_.slot_base[s] + instance;
          if (view_.slot_scope[s] != scope || !view_.theta_free[t]) continue;
          if (theta_places_[t].block >= 0) {
            throw std::invalid_argument("array `slot_base`: entry " + std::to_string(s) +
                                        " shares values with another");
          }
          theta_places_[t] = {static_cast<int>(theta_blocks_.size()), static_cast<int>(block.members.size())};
          block.members.push_back(t);
        }
        if (block.members.empty()) continue;
        size += block.members.size();
        theta_blocks_.push_back(std::move(block));
      }
    }
  }
  // A prior on a value that is held is an observation without unknown: a block of its own, constant.
  for (uint32_t t : view_.theta_prior_index) {
    if (theta_places_[t].block >= 0) continue;
    theta_places_[t] = {static_cast<int>(theta_blocks_.size()), 0};
    theta_blocks_.push_back({size++, {t}});
  }
  return size;
}

void Adjustment::Variable(const double* block, const std::vector<Column>& columns) {
  free_[block - values_.data()] = {static_cast<uint32_t>(columns_.size()), static_cast<uint32_t>(columns.size())};
  columns_.insert(columns_.end(), columns.begin(), columns.end());
}

void Adjustment::AddCameras() {
  for (std::size_t c = 0; c < view_.cameras(); ++c) {
    const CameraBlock camera{view_.camera_scales.data + 12 * c, view_.tie_dc_to_pp};
    camera_blocks_.push_back(camera);
    double* block = Camera(c);
    std::vector<int> held;
    std::vector<Column> columns;
    for (int k = 0; k < camera.size(); ++k) {
      const int parameter = camera.parameter(k);
      const double scale = camera.scale[parameter];
      block[k] = view_.interiors[12 * c + parameter] / scale;
      if (view_.camera_free[12 * c + parameter]) {
        columns.push_back({view_.camera_unknown(c, parameter), 1.0 / scale});
      } else {
        held.push_back(k);
      }
    }
    problem_.AddParameterBlock(block, camera.size());
    if (columns.empty()) {
      problem_.SetParameterBlockConstant(block);
      continue;
    }
    if (!held.empty()) {
      manifolds_.push_back(std::make_unique<ceres::SubsetManifold>(camera.size(), held));
      problem_.SetManifold(block, manifolds_.back().get());
    }
    Variable(block, columns);
  }
}

void Adjustment::AddThetas() {
  for (const ThetaBlock& theta : theta_blocks_) {
    double* block = Theta(theta);
    std::vector<Column> columns;
    for (std::size_t k = 0; k < theta.members.size(); ++k) {
      const std::size_t t = theta.members[k];
      block[k] = view_.theta[t] / view_.theta_scales[t];
      columns.push_back({view_.theta_unknown(t), 1.0 / view_.theta_scales[t]});
    }
    problem_.AddParameterBlock(block, static_cast<int>(theta.members.size()));
    if (view_.theta_free[theta.members[0]]) {
      Variable(block, columns);
    } else {
      problem_.SetParameterBlockConstant(block);
    }
  }
}

void Adjustment::AddPoses() {
  manifolds_.push_back(std::make_unique<PoseManifold>());
  ceres::Manifold* whole = manifolds_.back().get();
  for (std::size_t i = 0; i < view_.images(); ++i) {
    double* pose = Pose(i);
    std::copy_n(view_.rotations.data + 4 * i, 4, pose);
    const double norm = std::sqrt(std::inner_product(pose, pose + 4, pose, 0.0));
    for (int k = 0; k < 4; ++k) pose[k] /= norm;
    std::copy_n(view_.centres.data + 3 * i, 3, pose + 4);

    std::vector<int> free;
    std::vector<Column> columns;
    for (int k = 0; k < 6; ++k) {
      if (!view_.pose_free[6 * i + k]) continue;
      free.push_back(k);
      columns.push_back({view_.pose_unknown(i, k), k < 3 ? kDeltaPerW : 1.0});
    }
    problem_.AddParameterBlock(pose, 7);
    if (free.empty()) {
      problem_.SetParameterBlockConstant(pose);
      continue;
    }
    if (free.size() == 6) {
      problem_.SetManifold(pose, whole);
    } else {
      manifolds_.push_back(std::make_unique<HeldPose>(free));
      problem_.SetManifold(pose, manifolds_.back().get());
    }
    Variable(pose, columns);
  }
}

void Adjustment::AddPoints() {
  std::copy(view_.points.begin(), view_.points.end(), values_.begin() + static_cast<std::ptrdiff_t>(point_start_));
  std::vector<Column> columns(3, {0, 1.0});
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    problem_.AddParameterBlock(Point(j), 3);
    for (std::size_t k = 0; k < 3; ++k) columns[k].unknown = view_.point_unknown(j, k);
    Variable(Point(j), columns);
  }
}

std::shared_ptr<ceres::ParameterBlockOrdering> Adjustment::Ordering() const {
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<double*> blocks;
  problem_.GetParameterBlocks(&blocks);
  const double* points = values_.data() + point_start_;
  for (double* block : blocks) ordering->AddElementToGroup(block, block >= points ? 0 : 1);
  return ordering;
}

void Adjustment::Linearise(std::size_t k, bool robust, Rows& rows) const {
  thread_local std::vector<double*> blocks, jacobians;
  thread_local std::vector<double> buffer;
  problem_.GetParameterBlocksForResidualBlock(residual_blocks_[k], &blocks);
  const ceres::CostFunction* cost = problem_.GetCostFunctionForResidualBlock(residual_blocks_[k]);
  rows.count = cost->num_residuals();
  rows.columns.clear();
  rows.values.clear();
  const auto free = [&](const double* block) { return free_[block - values_.data()]; };
  std::size_t total = 0;
  for (const double* block : blocks) total += free(block).count;
  buffer.resize(total * rows.count);
  jacobians.clear();
  double* next = buffer.data();
  for (const double* block : blocks) {
    const std::size_t count = free(block).count;
    jacobians.push_back(count > 0 ? next : nullptr);
    next += count * rows.count;
  }
  if (!problem_.EvaluateResidualBlockAssumingParametersUnchanged(residual_blocks_[k], robust, nullptr, rows.residuals,
                                                                 jacobians.data())) {
    FindCulprit();
    throw std::runtime_error("residuals or derivatives are not finite");
  }
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Free own = free(blocks[b]);
    for (uint32_t c = 0; c < own.count; ++c) {
      const Column& column = columns_[own.start + c];
      rows.columns.push_back(column.unknown);
      for (int i = 0; i < rows.count; ++i) rows.values.push_back(column.factor * jacobians[b][i * own.count + c]);
    }
  }
}

Evaluation Adjustment::Evaluate() const {
  Evaluation evaluation;
  evaluation.row_start.assign(1, 0);
  Rows rows;
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < residual_blocks_.size(); ++k) {
    Linearise(k, false, rows);
    order.resize(rows.columns.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return rows.columns[a] < rows.columns[b]; });
    for (int i = 0; i < rows.count; ++i) {
      evaluation.residuals.push_back(rows.residuals[i]);
      for (std::size_t c : order) {
        evaluation.columns.push_back(rows.columns[c]);
        evaluation.values.push_back(rows.column(c)[i]);
      }
      evaluation.row_start.push_back(evaluation.columns.size());
    }
  }
  return evaluation;
}

void Adjustment::Move(const std::vector<double>& step) {
  std::vector<double*> blocks;
  problem_.GetParameterBlocks(&blocks);
  std::vector<double> delta, moved;
  for (double* block : blocks) {
    const Free own = free_[block - values_.data()];
    if (own.count == 0) continue;
    delta.clear();
    for (uint32_t c = own.start; c < own.start + own.count; ++c) {
      delta.push_back(columns_[c].factor * step[columns_[c].unknown]);
    }
    const int size = problem_.ParameterBlockSize(block);
    if (const ceres::Manifold* manifold = problem_.GetManifold(block)) {
      moved.resize(static_cast<std::size_t>(size));
      manifold->Plus(block, delta.data(), moved.data());
      std::copy(moved.begin(), moved.end(), block);
    } else {
      for (int k = 0; k < size; ++k) block[k] += delta[static_cast<std::size_t>(k)];
    }
  }
}

void Adjustment::Store(Solution& solution) const {
  solution.interiors.assign(view_.interiors.begin(), view_.interiors.end());
  for (std::size_t c = 0; c < view_.cameras(); ++c) {
    double interior[12];
    camera_blocks_[c].Unpack(&values_[camera_start_ + 12 * c], interior);
    for (int k = 0; k < 12; ++k) {
      // What is held keeps its value to the last bit.
      const bool follows = view_.tie_dc_to_pp && (k == kDcx || k == kDcy);
      if (view_.camera_free[12 * c + k] || follows) solution.interiors[12 * c + k] = interior[k];
    }
  }
  solution.theta.assign(view_.theta.begin(), view_.theta.end());
  for (const ThetaBlock& block : theta_blocks_) {
    for (std::size_t k = 0; k < block.members.size(); ++k) {
      const std::size_t t = block.members[k];
      if (view_.theta_free[t]) solution.theta[t] = values_[theta_start_ + block.offset + k] * view_.theta_scales[t];
    }
  }
  for (std::size_t i = 0; i < view_.images(); ++i) {
    const auto pose = values_.begin() + static_cast<std::ptrdiff_t>(7 * i);
    solution.rotations.insert(solution.rotations.end(), pose, pose + 4);
    solution.centres.insert(solution.centres.end(), pose + 4, pose + 7);
  }
  solution.points.assign(values_.begin() + static_cast<std::ptrdiff_t>(point_start_), values_.end());
}

}  // namespace misclosure
