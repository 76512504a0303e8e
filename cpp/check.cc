// Checks of the borrowed arrays: nothing behind this file meets a wrong index, a wrong length or a number that is not
// finite.

#include <cmath>
#include <string>

#include "solve.h"

namespace misclosure {
namespace {

[[noreturn]] void Fail(const std::string& name, const std::string& what) {
  throw std::invalid_argument("array `" + name + "`: " + what);
}

template <class T>
void Length(const char* name, const Span<T>& array, std::size_t expected) {
  if (array.size != expected) {
    Fail(name, "has " + std::to_string(array.size) + " entries, expected " + std::to_string(expected));
  }
}

template <class T>
void Multiple(const char* name, const Span<T>& array, std::size_t factor) {
  if (array.size % factor != 0) {
    Fail(name, "has " + std::to_string(array.size) + " entries, expected a multiple of " + std::to_string(factor));
  }
}

void Below(const char* name, const Span<uint32_t>& indices, std::size_t limit) {
  for (std::size_t k = 0; k < indices.size; ++k) {
    if (indices[k] >= limit) {
      Fail(name, "entry " + std::to_string(k) + " is " + std::to_string(indices[k]) + ", expected less than " +
                     std::to_string(limit));
    }
  }
}

void Finite(const char* name, const Span<double>& values) {
  for (std::size_t k = 0; k < values.size; ++k) {
    if (!std::isfinite(values[k])) Fail(name, "entry " + std::to_string(k) + " is not finite");
  }
}

void Positive(const char* name, const Span<double>& values) {
  Finite(name, values);
  for (std::size_t k = 0; k < values.size; ++k) {
    if (values[k] <= 0.0) {
      Fail(name, "entry " + std::to_string(k) + " is " + std::to_string(values[k]) + ", expected more than 0");
    }
  }
}

void Ascending(const char* name, const uint64_t* start, std::size_t groups, std::size_t end) {
  if (start[0] != 0) Fail(name, "starts at " + std::to_string(start[0]) + ", expected 0");
  for (std::size_t k = 0; k < groups; ++k) {
    if (start[k + 1] < start[k]) Fail(name, "falls at entry " + std::to_string(k + 1));
  }
  if (start[groups] != end) {
    Fail(name, "ends at " + std::to_string(start[groups]) + ", expected " + std::to_string(end));
  }
}

void CheckEffects(const ProblemView& view) {
  Length("slot_start", view.slot_start, view.effects.size + 1);
  Length("effect_reads_place", view.effect_reads_place, 2 * view.effects.size);
  Length("slot_base", view.slot_base, view.slot_scope.size);
  const std::vector<uint64_t> start(view.slot_start.begin(), view.slot_start.end());
  Ascending("slot_start", start.data(), view.effects.size, view.slot_scope.size);
  for (std::size_t e = 0; e < view.effects.size; ++e) {
    const misclosure_effect* effect = view.effects[e];
    const std::string place = "entry " + std::to_string(e);
    if (effect == nullptr) Fail("effects", place + " is null");
    if (effect->abi_version != MISCLOSURE_ABI_VERSION || effect->effect_size != sizeof(misclosure_effect) ||
        effect->context_size != sizeof(misclosure_context)) {
      Fail("effects", place + " was made for another version of the contract");
    }
    if (effect->stage > static_cast<uint32_t>(Stage::kFrame)) Fail("effects", place + " has an unknown stage");
    const std::size_t count = start[e + 1] - start[e];
    if (count != effect->parameter_count) {
      Fail("slot_start", place + " has " + std::to_string(count) + " parameters, effect " + effect->id + " has " +
                             std::to_string(effect->parameter_count));
    }
    for (std::size_t s = start[e]; s < start[e + 1]; ++s) {
      std::size_t instances = 1;
      const misclosure_context& any = view.contexts.size > 0 ? view.contexts[0] : view.control_context;
      switch (static_cast<Scope>(view.slot_scope[s])) {
        case Scope::kGlobal: break;
        case Scope::kCamera: instances = view.cameras(); break;
        case Scope::kFlight:
        case Scope::kFlightButFirst: instances = any.flight_count; break;
        case Scope::kImage: instances = view.images(); break;
        default: Fail("slot_scope", "entry " + std::to_string(s) + " is not a scope");
      }
      // Control and frame are the last two stages.
      if (effect->stage >= static_cast<uint32_t>(Stage::kControl) && view.slot_scope[s] != 0) {
        Fail("slot_scope", "entry " + std::to_string(s) + ": effect " + effect->id +
                               " acts on surveyed points and must be global");
      }
      if (view.slot_base[s] + instances > view.theta.size) {
        Fail("slot_base", "entry " + std::to_string(s) + " needs " + std::to_string(view.slot_base[s] + instances) +
                              " values of theta, there are " + std::to_string(view.theta.size));
      }
    }
  }
}

}  // namespace

void Check(const ProblemView& view) {
  Multiple("interiors", view.interiors, 12);
  Finite("interiors", view.interiors);
  Length("camera_scales", view.camera_scales, view.interiors.size);
  Positive("camera_scales", view.camera_scales);
  Length("camera_domains", view.camera_domains, view.interiors.size);
  Positive("camera_domains", view.camera_domains);
  Length("camera_free", view.camera_free, view.interiors.size);

  Finite("theta", view.theta);
  Length("theta_scales", view.theta_scales, view.theta.size);
  Positive("theta_scales", view.theta_scales);
  Length("theta_free", view.theta_free, view.theta.size);
  Below("theta_prior_index", view.theta_prior_index, view.theta.size);
  Length("theta_prior_mean", view.theta_prior_mean, view.theta_prior_index.size);
  Finite("theta_prior_mean", view.theta_prior_mean);
  Length("theta_prior_sigma", view.theta_prior_sigma, view.theta_prior_index.size);
  Positive("theta_prior_sigma", view.theta_prior_sigma);

  for (std::size_t i = 0; i < view.images(); ++i) {
    const misclosure_context& context = view.contexts[i];
    const std::string place = "entry " + std::to_string(i);
    if (context.image != i) Fail("contexts", place + " says image " + std::to_string(context.image));
    if (context.camera >= view.cameras()) {
      Fail("contexts", place + ": camera is " + std::to_string(context.camera) + ", expected less than " +
                           std::to_string(view.cameras()));
    }
    if (context.flight >= context.flight_count || context.flight_count != view.contexts[0].flight_count) {
      Fail("contexts",
           place + ": flight is " + std::to_string(context.flight) + " of " + std::to_string(context.flight_count));
    }
  }
  CheckEffects(view);
  Length("rotations", view.rotations, 4 * view.images());
  Finite("rotations", view.rotations);
  for (std::size_t i = 0; i < view.images(); ++i) {
    double norm2 = 0.0;
    for (int k = 0; k < 4; ++k) norm2 += view.rotations[4 * i + k] * view.rotations[4 * i + k];
    if (std::abs(norm2 - 1.0) > 1e-6) Fail("rotations", "entry " + std::to_string(i) + " is not a unit quaternion");
  }
  Length("centres", view.centres, 3 * view.images());
  Finite("centres", view.centres);
  Length("pose_free", view.pose_free, 6 * view.images());

  Multiple("points", view.points, 3);
  Finite("points", view.points);
  Length("point_start", view.point_start, view.point_count() + 1);
  Ascending("point_start", view.point_start.data, view.point_count(), view.observation_image.size);
  Below("observation_image", view.observation_image, view.images());
  Length("observation_xy", view.observation_xy, 2 * view.observation_image.size);
  Finite("observation_xy", view.observation_xy);
  Length("observation_weight", view.observation_weight, view.observation_image.size);
  Positive("observation_weight", view.observation_weight);

  Below("control_point", view.control_point, view.point_count());
  Length("control_position", view.control_position, 3 * view.control_point.size);
  Finite("control_position", view.control_position);
  Length("control_sigma", view.control_sigma, 3 * view.control_point.size);
  Positive("control_sigma", view.control_sigma);
  Below("gnss_image", view.gnss_image, view.images());
  Length("gnss_position", view.gnss_position, 3 * view.gnss_image.size);
  Finite("gnss_position", view.gnss_position);
  Length("gnss_sigma", view.gnss_sigma, 3 * view.gnss_image.size);
  Positive("gnss_sigma", view.gnss_sigma);

  Below("prior_camera", view.prior_camera, view.cameras());
  Length("prior_parameter", view.prior_parameter, view.prior_camera.size);
  Below("prior_parameter", view.prior_parameter, 12);
  Length("prior_value", view.prior_value, view.prior_camera.size);
  Finite("prior_value", view.prior_value);
  Length("prior_sigma", view.prior_sigma, view.prior_camera.size);
  Positive("prior_sigma", view.prior_sigma);
  if (view.loss != Loss::kNone && !(view.loss_scale > 0.0 && std::isfinite(view.loss_scale))) {
    throw std::invalid_argument("`loss_scale` is " + std::to_string(view.loss_scale) + ", expected more than 0");
  }
}

}  // namespace misclosure
