// A lens that sags under its weight: the principal point moves with gravity's direction in the camera.
#include "effect.h"

namespace misclosure {

struct GravitySag {
  static constexpr const char* id = "gravity-sag";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The lens sags under its weight, so that the principal point moves with the direction of gravity in the camera "
      "frame.";
  static constexpr const char* formula = "pp and dc += S g, S 2x3, g = R (0, 0, -1)";
  static constexpr const char* confused_with =
      "free:pp: with all images at one tilt and no turn about the axis S g is a constant.";
  static constexpr const char* source = "practice: sag of zoom and large lenses in close-range calibration";
  static constexpr Parameter parameters[] = {
      Estimated("sx_x", "px", Scope::kGlobal, 0.0, 2.0),
      Estimated("sx_y", "px", Scope::kGlobal, 0.0, 2.0),
      Estimated("sx_z", "px", Scope::kGlobal, 0.0, 2.0),
      Estimated("sy_x", "px", Scope::kGlobal, 0.0, 2.0),
      Estimated("sy_y", "px", Scope::kGlobal, 0.0, 2.0),
      Estimated("sy_z", "px", Scope::kGlobal, 0.0, 2.0),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {12, 13, 14};  // r

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    const T down[3] = {T(0.0), T(0.0), T(-1.0)};
    T g[3];
    Rotate(in + 12, down, g);
    const T sag_x = theta[0] * g[0] + theta[1] * g[1] + theta[2] * g[2];
    const T sag_y = theta[3] * g[0] + theta[4] * g[1] + theta[5] * g[2];
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    for (int k = 1; k < 5; k += 2) {  // ppx, ppy, then dcx, dcy
      out[k] += sag_x;
      out[k + 1] += sag_y;
    }
    return true;
  }
};
MISCLOSURE_EFFECT(GravitySag)

}  // namespace misclosure
