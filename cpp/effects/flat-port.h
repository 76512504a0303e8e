// A plane window before the lens, perpendicular to its axis: thickness D, index n relative to the medium on its two
// sides.
//
// A ray that meets it at the angle a to the axis runs on at b within, sin a = n sin b, and leaves parallel to itself.
// Across the plate it gains D tan b away from the axis instead of D tan a. The ray into the lens, extended backwards,
// therefore passes beside the true point, on the side away from the axis (n > 1), by D (tan a - tan b) measured across
// the axis, that is by
//   D (tan a - tan b) cos a = D sin a (1 - cos a / (n cos b))
// measured across the ray. The straight ray sees P' = P + that along e, the unit vector perpendicular to the ray, in
// the plane of ray and axis, away from the axis. With the axis k and the direction u of the ray, sin a e = cos a u - k:
// smooth at the axis. a is taken from the straight line C P. That of the bent ray differs by the shift over the
// distance: second order in D.
#include "effect.h"

namespace misclosure {

struct FlatPort {
  static constexpr const char* id = "flat-port";
  static constexpr Stage stage = Stage::kRay;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "A plane window before the lens shifts every ray sideways, so that near points are seen farther from the axis.";
  static constexpr const char* formula =
      "P' = P + D sin a (1 - cos a / (n cos b)) e, sin a = n sin b, a from the axis, e across the ray and away from "
      "the "
      "axis";
  static constexpr const char* confused_with =
      "free:f, free:radial: where all points are equally far it is a scale and a radial distortion; told apart by "
      "depth.";
  static constexpr const char* source =
      "plane-parallel plate; e.g. Luhmann et al., Close-Range Photogrammetry and 3D Imaging (2014)";
  static constexpr Parameter parameters[] = {
      Estimated("D", "m", Scope::kGlobal, 0.0, 0.005),
      Given("n", "1", 1.33),
  };
  static constexpr std::array<Need, 0> needs = {};

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    using std::sqrt;
    const T& n = theta[1];
    const T z[3] = {T(0.0), T(0.0), T(1.0)};
    T axis[3];
    RotateBack(in, z, axis);
    T u[3] = {in[6] - in[3], in[7] - in[4], in[8] - in[5]};
    const T distance = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    for (int k = 0; k < 3; ++k) u[k] = u[k] / distance;
    const T cos_a = u[0] * axis[0] + u[1] * axis[1] + u[2] * axis[2];
    if (!(cos_a > 0.0) || !(n >= 1.0)) return false;  // behind the window; a window is denser than what it stands in
    const T n_cos_b = sqrt(n * n - 1.0 + cos_a * cos_a);
    const T shift = theta[0] * (T(1.0) - cos_a / n_cos_b);
    for (int k = 0; k < 3; ++k) out[k] = in[6 + k] + shift * (cos_a * u[k] - axis[k]);
    return true;
  }
};
MISCLOSURE_EFFECT(FlatPort)

}  // namespace misclosure
