// One more term of radial distortion: (x, y) += k4 r^8 d.
// Source: Brown, Close-range camera calibration, Photogrammetric Engineering 37 (1971).
#include "effect.h"

namespace misclosure {

struct RadialHigh {
  static constexpr const char* id = "radial-high";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary = "Radial distortion beyond k3, of wide-angle lenses.";
  static constexpr const char* formula = "(x, y) += k4 r^8 d, d = (x, y) - dc, r = |d|";
  static constexpr const char* confused_with = "free:radial where k3 was held; unflatness.";
  static constexpr const char* source = "Brown, Close-range camera calibration, Photogrammetric Engineering 37 (1971)";
  static constexpr Parameter parameters[] = {
      Estimated("k4", "px^-8", Scope::kGlobal, 0.0, 1e-31),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {0, 1, 5, 6};  // x, y, dcx, dcy

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    const T dx = in[0] - in[5];
    const T dy = in[1] - in[6];
    const T r2 = dx * dx + dy * dy;
    const T stretch = theta[0] * r2 * r2 * r2 * r2;
    out[0] = in[0] + stretch * dx;
    out[1] = in[1] + stretch * dy;
    return true;
  }
};
MISCLOSURE_EFFECT(RadialHigh)

}  // namespace misclosure
