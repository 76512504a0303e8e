// The cost functions of an adjustment, in one order, and which of them cannot be computed.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <string>

#include "adjustment.h"

namespace misclosure {

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

Chain Adjustment::MakeChain(const misclosure_context& context, std::initializer_list<Stage> stages) {
  static std::atomic<std::uint64_t> chains{0};
  Chain chain;
  chain.id = ++chains;
  chain.context = context;
  chain.context.surveyed_kind = std::nan("");  // known at the frame stage alone: PositionCost
  std::vector<int> local(theta_blocks_.size(), -1);
  for (std::size_t e = 0; e < view_.effects.size; ++e) {
    const misclosure_effect* effect = view_.effects[e];
    if (std::find(stages.begin(), stages.end(), static_cast<Stage>(effect->stage)) == stages.end()) continue;
    int value = static_cast<int>(chain.values.size());
    chain.Add(effect);
    for (int axis = 0; axis < 2; ++axis) chain.reads_place[axis] |= view_.effect_reads_place[2 * e + axis] != 0;
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

void Adjustment::AddResidual(ceres::CostFunction& cost, ceres::LossFunction* loss, std::initializer_list<double*> own,
                             const Chain& chain) {
  std::vector<double*>& blocks = parameter_blocks_;
  blocks.assign(own);
  blocks.insert(blocks.end(), chain.blocks.begin(), chain.blocks.end());
  residual_blocks_.push_back(problem_.AddResidualBlock(&cost, loss, blocks.data(), static_cast<int>(blocks.size())));
}

void Adjustment::AddResiduals() {
  if (view_.loss == Loss::kHuber) loss_ = std::make_unique<ceres::HuberLoss>(view_.loss_scale);
  if (view_.loss == Loss::kCauchy) loss_ = std::make_unique<ceres::CauchyLoss>(view_.loss_scale);

  for (std::size_t i = 0; i < view_.images(); ++i) {
    const misclosure_context& context = view_.contexts[i];
    image_chains_.push_back({MakeChain(context, {Stage::kExposure, Stage::kRay, Stage::kInterior, Stage::kImage}),
                             camera_blocks_[context.camera]});
    position_chains_.push_back(MakeChain(context, {Stage::kPosition, Stage::kFrame}));
    const double unknown = std::nan("");
    image_chains_.back().chain.context.column_px = position_chains_.back().context.column_px = unknown;
    image_chains_.back().chain.context.row_px = position_chains_.back().context.row_px = unknown;
  }
  control_chain_ = MakeChain(view_.control_context, {Stage::kControl, Stage::kFrame});

  residual_blocks_.reserve(view_.observation_image.size + view_.control_point.size + view_.gnss_image.size +
                           view_.theta_prior_index.size + view_.prior_camera.size);
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    for (std::size_t o = view_.point_start[j]; o < view_.point_start[j + 1]; ++o) {
      const std::size_t i = view_.observation_image[o];
      const std::size_t c = view_.contexts[i].camera;
      auto& cost =
          image_costs_.emplace_back(image_chains_[i], view_.observation_xy.data + 2 * o, view_.observation_weight[o]);
      AddResidual(cost, loss_.get(), {Camera(c), Pose(i), Point(j)}, image_chains_[i].chain);
    }
  }
  for (std::size_t k = 0; k < view_.control_point.size; ++k) {
    auto& cost = position_costs_.emplace_back(control_chain_, Stage::kControl, view_.control_position.data + 3 * k,
                                              view_.control_sigma.data + 3 * k);
    AddResidual(cost, nullptr, {Point(view_.control_point[k])}, control_chain_);
  }
  for (std::size_t k = 0; k < view_.gnss_image.size; ++k) {
    const std::size_t i = view_.gnss_image[k];
    auto& cost = position_costs_.emplace_back(position_chains_[i], Stage::kPosition, view_.gnss_position.data + 3 * k,
                                              view_.gnss_sigma.data + 3 * k);
    AddResidual(cost, nullptr, {Pose(i)}, position_chains_[i]);
  }
  for (std::size_t k = 0; k < view_.theta_prior_index.size; ++k) {
    const std::size_t t = view_.theta_prior_index[k];
    const Place place = theta_places_[t];
    const ThetaBlock& theta = theta_blocks_[place.block];
    auto& cost = prior_costs_.emplace_back(static_cast<int>(theta.members.size()), place.entry, view_.theta_scales[t],
                                           view_.theta_prior_mean[k], view_.theta_prior_sigma[k]);
    residual_blocks_.push_back(problem_.AddResidualBlock(&cost, nullptr, Theta(theta)));
  }
  for (std::size_t k = 0; k < view_.prior_camera.size; ++k) {
    const CameraBlock& camera = camera_blocks_[view_.prior_camera[k]];
    const int entry = camera.entry(static_cast<int>(view_.prior_parameter[k]));
    auto& cost = prior_costs_.emplace_back(camera.size(), entry, camera.scale[camera.parameter(entry)],
                                           view_.prior_value[k], view_.prior_sigma[k]);
    residual_blocks_.push_back(problem_.AddResidualBlock(&cost, nullptr, Camera(view_.prior_camera[k])));
  }
}

void Adjustment::FindCulprit() const {
  std::vector<double*> blocks;
  double residuals[3];
  std::string reason;
  std::size_t next = 0;
  for (std::size_t j = 0; j < view_.point_count(); ++j) {
    for (std::size_t o = view_.point_start[j]; o < view_.point_start[j + 1]; ++o, ++next) {
      problem_.GetParameterBlocksForResidualBlock(residual_blocks_[next], &blocks);
      if (!image_costs_[o].Compute(blocks.data(), residuals, nullptr, &reason)) {
        throw CannotProject(view_.observation_image[o], j, reason);
      }
    }
  }
  for (std::size_t k = 0; k < position_costs_.size(); ++k, ++next) {
    problem_.GetParameterBlocksForResidualBlock(residual_blocks_[next], &blocks);
    if (position_costs_[k].Compute(blocks.data(), residuals, nullptr, &reason)) continue;
    if (k < view_.control_point.size) throw CannotProject(kNoPoint, view_.control_point[k], reason);
    throw CannotProject(view_.gnss_image[k - view_.control_point.size], kNoPoint, reason);
  }
}

}  // namespace misclosure
