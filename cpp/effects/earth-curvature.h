// Map coordinates used as if they were Cartesian: the earth falls away below its tangent plane.
#include "effect.h"

namespace misclosure {

struct EarthCurvature {
  static constexpr const char* id = "earth-curvature";
  static constexpr Stage stage = Stage::kRay;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "Coordinates of a map, with heights along a curved earth, are used as if they were Cartesian.";
  static constexpr const char* formula =
      "P_z -= q D^2 / (2 Re), D horizontal distance from the block's centre, Re = 6371 km";
  static constexpr const char* confused_with = "free:radial, free:f, refraction: all dome a block.";
  static constexpr const char* source = "geometry; e.g. Kraus, Photogrammetry (2007)";
  static constexpr double kEarthRadius = 6371000.0;  // m, mean
  static constexpr Parameter parameters[] = {
      Estimated("q", "1", Scope::kGlobal, 0.0, 1.0),
  };
  static constexpr std::array<Need, 0> needs = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    const T dx = in[6] - context.block_centre[0];
    const T dy = in[7] - context.block_centre[1];
    out[0] = in[6];
    out[1] = in[7];
    out[2] = in[8] - theta[0] * (dx * dx + dy * dy) / (2.0 * kEarthRadius);
    return true;
  }
};
MISCLOSURE_EFFECT(EarthCurvature)

}  // namespace misclosure
