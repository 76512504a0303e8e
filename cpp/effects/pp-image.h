// A principal point of its own in every image: a stabilised sensor or a loose lens.
#include "effect.h"

namespace misclosure {

struct PpImage {
  static constexpr const char* id = "pp-image";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The principal point varies from image to image: a stabilised sensor that floats, or a loose lens.";
  static constexpr const char* formula = "pp and dc += (ax, ay)_i, each ~ N(0, s^2)";
  static constexpr const char* confused_with =
      "pp-time, pp-flight: courses in time, which an effect per image takes along; small rotations, with which it "
      "nearly "
      "coincides.";
  static constexpr const char* source = "practice: sensor stabilisation";
  static constexpr Parameter parameters[] = {
      Random("ax", "px", 1.0, "s"),
      Random("ay", "px", 1.0, "s"),
  };
  static constexpr std::array<Need, 0> needs = {};
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
MISCLOSURE_EFFECT(PpImage)

}  // namespace misclosure
