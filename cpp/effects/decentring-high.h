// The next term of decentring distortion: Brown's p1, p2 multiplied by r^2.
// Source: Brown, Decentering distortion of lenses, Photogrammetric Engineering 32 (1966).
#include "effect.h"

namespace misclosure {

struct DecentringHigh {
  static constexpr const char* id = "decentring-high";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "Decentring distortion of the next order: lens elements tilted against each other.";
  static constexpr const char* formula =
      "(x, y) += r^2 (q1 (r^2+2dx^2) + 2 q2 dx dy, q2 (r^2+2dy^2) + 2 q1 dx dy), d = (x, y) - dc";
  static constexpr const char* confused_with = "free:decentring, which takes most of it; unflatness in mapping blocks.";
  static constexpr const char* source =
      "Brown, Decentering distortion of lenses, Photogrammetric Engineering 32 (1966)";
  static constexpr Parameter parameters[] = {
      Estimated("q1", "px^-3", Scope::kGlobal, 0.0, 1e-15),
      Estimated("q2", "px^-3", Scope::kGlobal, 0.0, 1e-15),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {0, 1, 5, 6};  // x, y, dcx, dcy

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    const T dx = in[0] - in[5];
    const T dy = in[1] - in[6];
    const T r2 = dx * dx + dy * dy;
    const T twist = 2.0 * dx * dy;
    out[0] = in[0] + r2 * (theta[0] * (r2 + 2.0 * dx * dx) + theta[1] * twist);
    out[1] = in[1] + r2 * (theta[1] * (r2 + 2.0 * dy * dy) + theta[0] * twist);
    return true;
  }
};
MISCLOSURE_EFFECT(DecentringHigh)

}  // namespace misclosure
