#include "adjustment.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace misclosure {
namespace {

// A rotation of which some components of w are held: QuaternionManifold on the others.
class HeldRotation final : public ceres::Manifold {
 public:
  explicit HeldRotation(std::vector<int> free) : free_(std::move(free)) {}
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return static_cast<int>(free_.size()); }
  bool Plus(const double* x, const double* delta, double* out) const override {
    double full[3] = {0.0, 0.0, 0.0};
    for (std::size_t k = 0; k < free_.size(); ++k) full[free_[k]] = delta[k];
    return whole_.Plus(x, full, out);
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    double full[12];
    if (!whole_.PlusJacobian(x, full)) return false;
    for (int row = 0; row < 4; ++row) {
      for (std::size_t k = 0; k < free_.size(); ++k) jacobian[row * free_.size() + k] = full[3 * row + free_[k]];
    }
    return true;
  }
  bool Minus(const double* y, const double* x, double* out) const override {
    double full[3];
    if (!whole_.Minus(y, x, full)) return false;
    for (std::size_t k = 0; k < free_.size(); ++k) out[k] = full[free_[k]];
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    double full[12];
    if (!whole_.MinusJacobian(x, full)) return false;
    for (std::size_t k = 0; k < free_.size(); ++k) std::copy_n(full + 4 * free_[k], 4, jacobian + 4 * k);
    return true;
  }

 private:
  std::vector<int> free_;
  ceres::QuaternionManifold whole_;
};

// QuaternionManifold turns by exp(delta) with a quaternion of half angle |delta|: w = 2 delta.
constexpr double kDeltaPerW = 0.5;

ceres::Problem::Options ProblemOptions() {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

}  // namespace

Adjustment::Adjustment(const ProblemView& view) : view_(view), problem_(ProblemOptions()) {
  const std::size_t thetas = MakeThetaBlocks();
  theta_start_ = 7 * view.images();
  camera_start_ = theta_start_ + thetas;
  point_start_ = camera_start_ + view.interiors.size;
  values_.resize(point_start_ + view.points.size);
  AddCameras();
  AddThetas();
  AddPoses();
  reduced_size_ = static_cast<int>(columns_.size());
  AddPoints();
  AddResiduals();
}

std::size_t Adjustment::ThetaIndex(std::size_t slot, const misclosure_context& context) const {
  const std::size_t base = view_.slot_base[slot];
  switch (static_cast<Scope>(view_.slot_scope[slot])) {
    case Scope::kCamera: return base + context.camera;
    case Scope::kFlight:
    case Scope::kFlightButFirst: return base + context.flight;
    case Scope::kImage: return base + context.image;
    default: return base;
  }
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
            throw std::invalid_argument("array `slot_base`: entry " + std::to_string(s) + " shares values with another");
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

void Adjustment::Variable(double* block, const std::vector<Column>& columns) {
  variables_.push_back(block);
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
  manifolds_.push_back(std::make_unique<ceres::QuaternionManifold>());
  ceres::Manifold* whole = manifolds_.back().get();
  for (std::size_t i = 0; i < view_.images(); ++i) {
    double* rotation = Rotation(i);
    std::copy_n(view_.rotations.data + 4 * i, 4, rotation);
    const double norm = std::sqrt(std::inner_product(rotation, rotation + 4, rotation, 0.0));
    for (int k = 0; k < 4; ++k) rotation[k] /= norm;
    const uint8_t* free = view_.pose_free.data + 6 * i;

    std::vector<int> turning;
    std::vector<Column> columns;
    for (int k = 0; k < 3; ++k) {
      if (!free[k]) continue;
      turning.push_back(k);
      columns.push_back({view_.pose_unknown(i, k), kDeltaPerW});
    }
    problem_.AddParameterBlock(rotation, 4);
    if (turning.empty()) {
      problem_.SetParameterBlockConstant(rotation);
    } else {
      if (turning.size() == 3) {
        problem_.SetManifold(rotation, whole);
      } else {
        manifolds_.push_back(std::make_unique<HeldRotation>(turning));
        problem_.SetManifold(rotation, manifolds_.back().get());
      }
      Variable(rotation, columns);
    }

    double* centre = Centre(i);
    std::copy_n(view_.centres.data + 3 * i, 3, centre);
    std::vector<int> held;
    columns.clear();
    for (int k = 0; k < 3; ++k) {
      if (free[3 + k]) {
        columns.push_back({view_.pose_unknown(i, 3 + k), 1.0});
      } else {
        held.push_back(k);
      }
    }
    problem_.AddParameterBlock(centre, 3);
    if (columns.empty()) {
      problem_.SetParameterBlockConstant(centre);
      continue;
    }
    if (!held.empty()) {
      manifolds_.push_back(std::make_unique<ceres::SubsetManifold>(3, held));
      problem_.SetManifold(centre, manifolds_.back().get());
    }
    Variable(centre, columns);
  }
}

void Adjustment::AddPoints() {
  std::copy(view_.points.begin(), view_.points.end(), values_.begin() + static_cast<std::ptrdiff_t>(point_start_));
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    problem_.AddParameterBlock(Point(j), 3);
    Variable(Point(j),
             {{view_.point_unknown(j, 0), 1.0}, {view_.point_unknown(j, 1), 1.0}, {view_.point_unknown(j, 2), 1.0}});
  }
}

Chain Adjustment::MakeChain(const misclosure_context& context, std::initializer_list<Stage> stages) {
  Chain chain;
  chain.context = context;
  std::vector<int> local(theta_blocks_.size(), -1);
  for (std::size_t e = 0; e < view_.effects.size; ++e) {
    const misclosure_effect* effect = view_.effects[e];
    if (std::find(stages.begin(), stages.end(), static_cast<Stage>(effect->stage)) == stages.end()) continue;
    int value = static_cast<int>(chain.values.size());
    chain.Add(effect);
    for (std::size_t s = view_.slot_start[e]; s < view_.slot_start[e + 1]; ++s, ++value) {
      const std::size_t t = ThetaIndex(s, context);
      chain.values[value] = view_.theta[t];
      if (!view_.theta_free[t]) continue;
      const Place place = theta_places_[t];
      if (local[place.block] < 0) {
        local[place.block] = static_cast<int>(chain.blocks.size());
        chain.blocks.push_back(Theta(theta_blocks_[place.block]));
        chain.block_sizes.push_back(static_cast<int>(theta_blocks_[place.block].members.size()));
      }
      chain.unknowns.push_back({local[place.block], place.entry, value, view_.theta_scales[t]});
    }
  }
  return chain;
}

template <class Cost>
void Adjustment::AddResidual(Cost* cost, ceres::LossFunction* loss, std::vector<double*> blocks, const Chain& chain) {
  blocks.insert(blocks.end(), chain.blocks.begin(), chain.blocks.end());
  problem_.AddResidualBlock(cost, loss, blocks);
}

void Adjustment::AddResiduals() {
  if (view_.loss == Loss::kHuber) loss_ = std::make_unique<ceres::HuberLoss>(view_.loss_scale);
  if (view_.loss == Loss::kCauchy) loss_ = std::make_unique<ceres::CauchyLoss>(view_.loss_scale);

  for (std::size_t i = 0; i < view_.images(); ++i) {
    image_chains_.push_back(
        MakeChain(view_.contexts[i], {Stage::kExposure, Stage::kRay, Stage::kInterior, Stage::kImage}));
    position_chains_.push_back(MakeChain(view_.contexts[i], {Stage::kPosition}));
    const double unknown = std::nan("");
    image_chains_.back().context.column_px = position_chains_.back().context.column_px = unknown;
    image_chains_.back().context.row_px = position_chains_.back().context.row_px = unknown;
  }
  control_chain_ = MakeChain(view_.control_context, {Stage::kControl});

  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    for (std::size_t o = view_.point_start[j]; o < view_.point_start[j + 1]; ++o) {
      const std::size_t i = view_.observation_image[o];
      const std::size_t c = view_.contexts[i].camera;
      auto* cost = new ImageCost(image_chains_[i], camera_blocks_[c], view_.observation_xy.data + 2 * o,
                                 view_.observation_weight[o]);
      AddResidual(cost, loss_.get(), {Camera(c), Rotation(i), Centre(i), Point(j)},
                  image_chains_[i]);
    }
  }
  for (std::size_t k = 0; k < view_.control_point.size; ++k) {
    auto* cost = new PositionCost(control_chain_, Stage::kControl, view_.control_position.data + 3 * k,
                                  view_.control_sigma.data + 3 * k);
    AddResidual(cost, nullptr, {Point(view_.control_point[k])}, control_chain_);
  }
  for (std::size_t k = 0; k < view_.gnss_image.size; ++k) {
    const std::size_t i = view_.gnss_image[k];
    auto* cost = new PositionCost(position_chains_[i], Stage::kPosition, view_.gnss_position.data + 3 * k,
                                  view_.gnss_sigma.data + 3 * k);
    std::vector<double*> blocks = {Centre(i)};
    if (cost->turned()) blocks.push_back(Rotation(i));
    AddResidual(cost, nullptr, blocks, position_chains_[i]);
  }
  for (std::size_t k = 0; k < view_.theta_prior_index.size; ++k) {
    const std::size_t t = view_.theta_prior_index[k];
    const Place place = theta_places_[t];
    const ThetaBlock& theta = theta_blocks_[place.block];
    problem_.AddResidualBlock(
        new PriorCost(static_cast<int>(theta.members.size()), place.entry, view_.theta_scales[t],
                      view_.theta_prior_mean[k], view_.theta_prior_sigma[k]),
        nullptr, Theta(theta));
  }
  for (std::size_t k = 0; k < view_.prior_camera.size; ++k) {
    const CameraBlock& camera = camera_blocks_[view_.prior_camera[k]];
    const int entry = camera.entry(static_cast<int>(view_.prior_parameter[k]));
    problem_.AddResidualBlock(
        new PriorCost(camera.size(), entry, camera.scale[camera.parameter(entry)], view_.prior_value[k],
                      view_.prior_sigma[k]),
        nullptr, Camera(view_.prior_camera[k]));
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

Evaluation Adjustment::Linearise(bool robust, int threads) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = variables_;
  options.apply_loss_function = robust;
  options.num_threads = threads;
  Evaluation evaluation;
  ceres::CRSMatrix jacobian;
  if (!problem_.Evaluate(options, nullptr, &evaluation.residuals, nullptr, &jacobian)) {
    FindCulprit();
    throw std::runtime_error("residuals or derivatives are not finite");
  }
  evaluation.row_start.assign(1, 0);
  evaluation.row_start.reserve(jacobian.rows.size());
  evaluation.columns.reserve(jacobian.cols.size());
  evaluation.values.reserve(jacobian.cols.size());
  std::vector<std::pair<std::size_t, double>> row;
  for (int i = 0; i + 1 < static_cast<int>(jacobian.rows.size()); ++i) {
    row.clear();
    for (int k = jacobian.rows[i]; k < jacobian.rows[i + 1]; ++k) {
      const Column& column = columns_[jacobian.cols[k]];
      row.emplace_back(column.unknown, column.factor * jacobian.values[k]);
    }
    std::sort(row.begin(), row.end());
    for (const auto& [unknown, value] : row) {
      evaluation.columns.push_back(unknown);
      evaluation.values.push_back(value);
    }
    evaluation.row_start.push_back(evaluation.columns.size());
  }
  return evaluation;
}

void Adjustment::FindCulprit() const {
  std::vector<ceres::ResidualBlockId> ids;
  problem_.GetResidualBlocks(&ids);
  std::vector<double*> blocks;
  double residuals[3];
  std::string reason;
  std::size_t next = 0;
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    for (std::size_t o = view_.point_start[j]; o < view_.point_start[j + 1]; ++o, ++next) {
      problem_.GetParameterBlocksForResidualBlock(ids[next], &blocks);
      const auto* cost = static_cast<const ImageCost*>(problem_.GetCostFunctionForResidualBlock(ids[next]));
      if (!cost->Compute(blocks.data(), residuals, nullptr, &reason)) {
        throw CannotProject(view_.observation_image[o], j, reason);
      }
    }
  }
  for (std::size_t k = 0; k < view_.control_point.size + view_.gnss_image.size; ++k, ++next) {
    problem_.GetParameterBlocksForResidualBlock(ids[next], &blocks);
    const auto* cost = static_cast<const PositionCost*>(problem_.GetCostFunctionForResidualBlock(ids[next]));
    if (cost->Compute(blocks.data(), residuals, nullptr, &reason)) continue;
    if (k < view_.control_point.size) throw CannotProject(kNoPoint, view_.control_point[k], reason);
    throw CannotProject(view_.gnss_image[k - view_.control_point.size], kNoPoint, reason);
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
