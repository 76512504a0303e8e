// The air thins with height and bends the ray: the point is seen farther from the nadir.
//
// With d = P_h - C_h and the nadir angle z, tan z = |d| / H, so that H (1 + tan^2 z) = H + |d|^2 / H.
// Source: Saastamoinen, Photogrammetric Engineering 38 (1972).
#include "effect.h"

namespace misclosure {

struct Refraction {
  static constexpr const char* id = "refraction";
  static constexpr Stage stage = Stage::kRay;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The air thins with height and bends the ray, so that a point is seen farther from the nadir.";
  static constexpr const char* formula = "P_h += kappa H (1 + tan^2 z) (P_h - C_h), H = C_z - P_z, z the nadir angle";
  static constexpr const char* confused_with =
      "earth-curvature, free:radial, free:f: in nadir blocks of one height it is a radial distortion.";
  static constexpr const char* source = "Saastamoinen, Refraction, Photogrammetric Engineering 38 (1972)";
  static constexpr Parameter parameters[] = {
      Estimated("kappa", "1/m", Scope::kGlobal, 0.0, 1.3e-8),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {3, 4, 5, 6, 7, 8};  // C, P

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    const T dx = in[6] - in[3];
    const T dy = in[7] - in[4];
    const T height = in[5] - in[8];
    if (!(height > 0.0)) return false;  // the model is of a camera above the ground
    const T scale = theta[0] * (height + (dx * dx + dy * dy) / height);
    out[0] = in[6] + scale * dx;
    out[1] = in[7] + scale * dy;
    out[2] = in[8];
    return true;
  }
};
MISCLOSURE_EFFECT(Refraction)

}  // namespace misclosure
