// A principal point that changes between flights, the centre of distortion with it.
#include "effect.h"

namespace misclosure {

struct PpFlight {
  static constexpr const char* id = "pp-flight";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The principal point steps from flight to flight: a lens refitted, a camera knocked.";
  static constexpr const char* formula = "pp and dc += (ax, ay)_k, 0 in the first flight";
  static constexpr const char* confused_with = "pp-time: a drift that goes on within the flights.";
  static constexpr const char* source = "practice: lens refitted between flights";
  static constexpr Parameter parameters[] = {
      Estimated("ax", "px", Scope::kFlightButFirst, 0.0, 3.0),
      Estimated("ay", "px", Scope::kFlightButFirst, 0.0, 3.0),
  };
  static constexpr std::array needs = {Need::kFlights};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    for (int k = 1; k < 5; k += 2) {  // ppx, ppy, then dcx, dcy
      out[k] += theta[0];
      out[k + 1] += theta[1];
    }
    return true;
  }
};
MISCLOSURE_EFFECT(PpFlight)

}  // namespace misclosure
