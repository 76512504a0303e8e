// GNSS positions that drift, differently in every flight: antenna = C + a_k + b_k t.
// Source: Ackermann and Schade, PE&RS 59 (1993).
#include "effect.h"

namespace misclosure {

struct GnssDrift {
  static constexpr const char* id = "gnss-drift";
  static constexpr Stage stage = Stage::kPosition;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The GNSS positions are shifted and drift in time, in every flight by amounts of its own: wrong ambiguities.";
  static constexpr const char* formula = "antenna = C + a_k + b_k t, t since the first image of flight k";
  static constexpr const char* confused_with = "gnss-shift: one shift for all flights; focal-time through the heights.";
  static constexpr const char* source =
      "Ackermann and Schade, Application of GPS for aerial triangulation, PE&RS 59 (1993)";
  static constexpr Parameter parameters[] = {
      Estimated("ax", "m", Scope::kFlight, 0.0, 0.05),
      Estimated("ay", "m", Scope::kFlight, 0.0, 0.05),
      Estimated("az", "m", Scope::kFlight, 0.0, 0.05),
      Estimated("bx", "m/s", Scope::kFlight, 0.0, 2e-4),
      Estimated("by", "m/s", Scope::kFlight, 0.0, 2e-4),
      Estimated("bz", "m/s", Scope::kFlight, 0.0, 2e-4),
  };
  static constexpr std::array needs = {Need::kTime, Need::kGnss};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 3; ++k) out[k] = in[3 + k] + theta[k] + theta[3 + k] * context.flight_time_s;
    return true;
  }
};
MISCLOSURE_EFFECT(GnssDrift)

}  // namespace misclosure
