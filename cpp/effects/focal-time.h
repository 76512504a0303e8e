// A focal length that drifts in time: f += a tau.
// Source: the study's gradual focal length error.
#include "effect.h"

namespace misclosure {

struct FocalTime {
  static constexpr const char* id = "focal-time";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The focal length drifts in proportion to time over the block, as a lens does that warms up.";
  static constexpr const char* formula = "f += a tau";
  static constexpr const char* confused_with =
      "focal-flight: a step between flights; told apart by images within one flight, or by time stamps. In corridors "
      "heights and "
      "intrinsics take most of it.";
  static constexpr const char* source =
      "Zhou et al. 2019, error-free blocks with an injected gradual focal length error";
  static constexpr Name against[] = {{"time", 0.0}, {"order", 1.0}};
  static constexpr Parameter parameters[] = {
      Estimated("a", "px", Scope::kGlobal, 0.0, 5.0),
      Given("against", "1", 0.0, against),
  };
  static constexpr std::array needs = {Need::kTime};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    const double tau = theta[1] == 0.0 ? context.tau : context.tau_order;
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    out[0] += theta[0] * tau;
    return true;
  }
};
MISCLOSURE_EFFECT(FocalTime)

}  // namespace misclosure
