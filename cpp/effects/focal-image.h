// A focal length of its own in every image: f += a_i, a_i ~ N(0, s^2).
#include "effect.h"

namespace misclosure {

struct FocalImage {
  static constexpr const char* id = "focal-image";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary = "The focal length varies from image to image, as when an autofocus hunts.";
  static constexpr const char* formula = "f += a_i, a_i ~ N(0, s^2)";
  static constexpr const char* confused_with =
      "focal-time, focal-temperature, focal-flight: courses in time, which an effect per image takes along.";
  static constexpr const char* source =
      "practice: autofocus hunting; variance components after Foerstner and Wrobel, Photogrammetric Computer Vision "
      "(2016)";
  static constexpr Parameter parameters[] = {
      Random("a", "px", 1.0, "s"),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    out[0] += theta[0];
    return true;
  }
};
MISCLOSURE_EFFECT(FocalImage)

}  // namespace misclosure
