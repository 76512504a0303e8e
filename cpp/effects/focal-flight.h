// A focal length that changes between flights: f += a_k.
#include "effect.h"

namespace misclosure {

struct FocalFlight {
  static constexpr const char* id = "focal-flight";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The focal length steps from flight to flight: refocused, or the lens put back on.";
  static constexpr const char* formula = "f += a_k, 0 in the first flight";
  static constexpr const char* confused_with =
      "focal-time: a drift that goes on within the flights; the two are hardly separable when flights are short beside "
      "the pauses.";
  static constexpr const char* source = "practice: refocusing between flights";
  static constexpr Parameter parameters[] = {
      Estimated("a", "px", Scope::kFlightButFirst, 0.0, 3.0),
  };
  static constexpr std::array needs = {Need::kFlights};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    out[0] += theta[0];
    return true;
  }
};
MISCLOSURE_EFFECT(FocalFlight)

}  // namespace misclosure
