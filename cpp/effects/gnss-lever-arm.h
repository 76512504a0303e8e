// The antenna is not at the projection centre.
#include "effect.h"

namespace misclosure {

struct GnssLeverArm {
  static constexpr const char* id = "gnss-lever-arm";
  static constexpr Stage stage = Stage::kPosition;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The antenna stands off the projection centre by an arm that is fixed in the camera frame.";
  static constexpr const char* formula = "antenna = C + R^T l";
  static constexpr const char* confused_with =
      "gnss-shift (constant in the world: opposite headings tell them apart), gnss-delay (along the velocity).";
  static constexpr const char* source = "geometry of the platform; e.g. Colomina and Molina, ISPRS Journal 92 (2014)";
  static constexpr Parameter parameters[] = {
      Estimated("lx", "m", Scope::kGlobal, 0.0, 0.1),
      Estimated("ly", "m", Scope::kGlobal, 0.0, 0.1),
      Estimated("lz", "m", Scope::kGlobal, 0.0, 0.1),
  };
  static constexpr std::array needs = {Need::kGnss};
  static constexpr std::array reads = {0, 1, 2};  // r

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    RotateBack(in, theta, out);
    for (int k = 0; k < 3; ++k) out[k] += in[3 + k];
    return true;
  }
};
MISCLOSURE_EFFECT(GnssLeverArm)

}  // namespace misclosure
