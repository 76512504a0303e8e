// Rows exposed one after the other while the camera moves and turns.
//
// A row is exposed dt = t (y/h - 1/2) after the middle one. The camera has moved by (v + dv) dt by then, dv the
// error of a velocity that was derived. It turns with omega in its own
// axes, so that a fixed direction p turns the other way there, p' = -omega x p, and R(dt) = exp(-[omega dt]x) R.
// Source: Vautherin et al., ISPRS Annals III-3 (2016).
#include "effect.h"

namespace misclosure {

struct RollingShutter {
  static constexpr const char* id = "rolling-shutter";
  static constexpr Stage stage = Stage::kExposure;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The rows are read out one after the other while the camera moves: each has a pose of its own.";
  static constexpr const char* formula = "C += (v + dv) t (y/h - 1/2), R <- exp(-[omega t (y/h - 1/2)]x) R";
  static constexpr const char* confused_with =
      "in one flying direction free:affinity (stretch or shear); told apart by opposite and crossing strips.";
  static constexpr const char* source =
      "Vautherin et al., Photogrammetric accuracy and modeling of rolling shutter cameras, ISPRS Annals III-3 (2016)";
  static constexpr Parameter parameters[] = {
      Estimated("t", "s", Scope::kGlobal, 0.0, 0.02),
      VelocityError("dvx", 0.1),
      VelocityError("dvy", 0.1),
      VelocityError("dvz", 0.1),
  };
  static constexpr std::array needs = {Need::kVelocity};
  static constexpr std::array reads = {0, 1, 2};  // r

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    const T dt = theta[0] * (context.row_px / context.height_px - 0.5);
    const T turn[3] = {-dt * context.angular_velocity[0], -dt * context.angular_velocity[1],
                       -dt * context.angular_velocity[2]};
    Turn(turn, in, out);
    for (int k = 0; k < 3; ++k) out[3 + k] = in[3 + k] + dt * (context.velocity[k] + theta[1 + k]);
    return true;
  }
};
MISCLOSURE_EFFECT(RollingShutter)

}  // namespace misclosure
