// The antenna position is that of another time than the exposure: antenna = C + v dt.
#include "effect.h"

namespace misclosure {

struct GnssDelay {
  static constexpr const char* id = "gnss-delay";
  static constexpr Stage stage = Stage::kPosition;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary = "The antenna position is stamped early or late against the exposure.";
  static constexpr const char* formula = "antenna = C + v dt";
  static constexpr const char* confused_with =
      "gnss-lever-arm along the track where the heading follows the flight; forward-motion always.";
  static constexpr const char* source =
      "Blazquez, A new approach to spatio-temporal calibration of multi-sensor systems, IAPRS 37-B1 (2008)";
  static constexpr Parameter parameters[] = {
      Estimated("dt", "s", Scope::kGlobal, 0.0, 0.02),
  };
  static constexpr std::array needs = {Need::kVelocity, Need::kGnss};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 3; ++k) out[k] = in[3 + k] + theta[0] * context.velocity[k];
    return true;
  }
};
MISCLOSURE_EFFECT(GnssDelay)

}  // namespace misclosure
