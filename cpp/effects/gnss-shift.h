// GNSS positions in another frame than the control: antenna = C + t.
#include "effect.h"

namespace misclosure {

struct GnssShift {
  static constexpr const char* id = "gnss-shift";
  static constexpr Stage stage = Stage::kPosition;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The GNSS positions are shifted as a whole: datum, geoid, antenna height, base coordinates.";
  static constexpr const char* formula = "antenna = C + t";
  static constexpr const char* confused_with =
      "gnss-lever-arm: turns with the camera; without control the shift is only a datum.";
  static constexpr const char* source =
      "Ackermann and Schade, Application of GPS for aerial triangulation, PE&RS 59 (1993)";
  static constexpr Parameter parameters[] = {
      Estimated("tx", "m", Scope::kGlobal, 0.0, 0.05),
      Estimated("ty", "m", Scope::kGlobal, 0.0, 0.05),
      Estimated("tz", "m", Scope::kGlobal, 0.0, 0.05),
  };
  static constexpr std::array needs = {Need::kGnss};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 3; ++k) out[k] = in[3 + k] + theta[k];
    return true;
  }
};
MISCLOSURE_EFFECT(GnssShift)

}  // namespace misclosure
