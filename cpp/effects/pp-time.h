// A principal point that drifts in time, the centre of distortion with it.
#include "effect.h"

namespace misclosure {

struct PpTime {
  static constexpr const char* id = "pp-time";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The lens or sensor moves sideways in proportion to time over the block: warm-up.";
  static constexpr const char* formula = "pp and dc += (ax, ay) tau";
  static constexpr const char* confused_with =
      "pp-flight: steps between flights; told apart by images within one flight.";
  static constexpr const char* source = "practice: warm-up drift; e.g. Daakir et al., ISPRS Journal 148 (2019)";
  static constexpr Parameter parameters[] = {
      Estimated("ax", "px", Scope::kGlobal, 0.0, 3.0),
      Estimated("ay", "px", Scope::kGlobal, 0.0, 3.0),
  };
  static constexpr std::array needs = {Need::kTime};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    for (int k = 1; k < 5; k += 2) {  // ppx, ppy, then dcx, dcy
      out[k] += theta[0] * context.tau;
      out[k + 1] += theta[1] * context.tau;
    }
    return true;
  }
};
MISCLOSURE_EFFECT(PpTime)

}  // namespace misclosure
