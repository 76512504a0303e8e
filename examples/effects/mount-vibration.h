// A camera that shakes in its mount at a known frequency while its rows are read one after the other.
//
// A row at y is read dt = readout (y/h - 1/2) after the image's time t. At that instant the camera is turned about its
// x and y axes by waves of one frequency, each with a phase of its own. Sine and cosine of the row's instant carry the
// phase, so that the effect is linear in its four sizes; frequency and readout are given, from the rotors and from the
// sensor's data sheet.
//
//   misclosure improve BLOCK -o RUN --plugin mount-vibration.so
//   misclosure adjust BLOCK -o RUN --plugin mount-vibration.so --add mount-vibration:frequency=95,readout=0.03
//
// Rows that are read late are also seen from further on: that is rolling-shutter, which a block of this kind needs
// beside it.
#include "effect.h"

namespace misclosure {

struct MountVibrationEffect {
  static constexpr const char* id = "mount-vibration";
  static constexpr Stage stage = Stage::kExposure;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary = "The camera shakes in its mount at one frequency while its rows are read one after the other.";
  static constexpr const char* formula =
      "R <- exp([w]x) R, w = (xs sin q + xc cos q, ys sin q + yc cos q, 0), q = 2 pi frequency (t + readout (y/h - 1/2))";
  static constexpr const char* confused_with = "rolling-shutter: the steady motion of the platform, the same in every image of a strip.";
  static constexpr const char* source = "a camera read row by row (Vautherin et al. 2016) on a mount that is not stiff";
  static constexpr const char* kRange = "a mount that gives way by 0.5 mm at 0.1 m";
  static constexpr Parameter parameters[] = {
      UpTo(Estimated("xs", "rad", Scope::kGlobal, 0.0, 1e-4), 5e-3, kRange),
      UpTo(Estimated("xc", "rad", Scope::kGlobal, 0.0, 1e-4), 5e-3, kRange),
      UpTo(Estimated("ys", "rad", Scope::kGlobal, 0.0, 1e-4), 5e-3, kRange),
      UpTo(Estimated("yc", "rad", Scope::kGlobal, 0.0, 1e-4), 5e-3, kRange),
      Given("frequency", "Hz", 80.0),
      Given("readout", "s", 0.02),
  };
  static constexpr Words words = {
      "The camera shakes in its mount with the rotors while its rows are read one after the other. Straight lines then "
      "become waves, with as many periods as the mount shakes during the readout.",
      "Damp the mount, balance the rotors, or use a mechanical or global shutter; else model it.",
      "images taken with the rotors at another speed"};
  static constexpr std::array<Need, 1> needs = {Need::kTime};
  static constexpr std::array reads = {0, 1, 2};  // r

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    using std::cos;
    using std::sin;
    constexpr double kTurn = 6.283185307179586;
    // The row is the one in which the point is predicted: whoever predicts finds it, and derives by it.
    const T instant = theta[5] * (context.row_px / context.height_px - 0.5) + context.time_s;
    const T phase = kTurn * theta[4] * instant;
    const T s = sin(phase), c = cos(phase);
    const T turn[3] = {theta[0] * s + theta[1] * c, theta[2] * s + theta[3] * c, T(0.0)};
    Turn(turn, in, out);
    for (int k = 3; k < 6; ++k) out[k] = in[k];
    return true;
  }
};
MISCLOSURE_EFFECT(MountVibrationEffect)

}  // namespace misclosure
