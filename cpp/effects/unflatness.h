// A sensor that is not flat: a ray that meets it z higher or lower lands elsewhere by its slope times z.
// Source: Fraser, ISPRS Journal 52 (1997).
#include "effect.h"

namespace misclosure {

struct Unflatness {
  static constexpr const char* id = "unflatness";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The sensor is not flat; an image point moves along its radius by the height of the sensor there.";
  static constexpr const char* formula =
      "(x, y) += ((x, y) - pp)/f z, z = sum c_jk P_j(2x/w-1) P_k(2y/h-1), Legendre, 2 <= j+k <= 4";
  static constexpr const char* confused_with = "radial distortion (a bowl is one), decentring-high, image-grid.";
  static constexpr const char* source = "Fraser, Digital camera self-calibration, ISPRS Journal 52 (1997)";
  static constexpr Parameter parameters[] = {
      Estimated("c_02", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_03", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_04", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_11", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_12", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_13", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_20", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_21", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_22", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_30", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_31", "px", Scope::kGlobal, 0.0, 0.5),
      Estimated("c_40", "px", Scope::kGlobal, 0.0, 0.5),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {0, 1, 2, 3, 4};  // x, y, f, ppx, ppy

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    T px[5], py[5];
    Legendre(in[0] * (2.0 / context.width_px) - 1.0, px);
    Legendre(in[1] * (2.0 / context.height_px) - 1.0, py);
    T z(0.0);
    int next = 0;
    for (int j = 0; j <= 4; ++j) {
      for (int k = 0; k <= 4; ++k) {
        if (j + k >= 2 && j + k <= 4) z += theta[next++] * px[j] * py[k];
      }
    }
    const T ratio = z / in[2];
    out[0] = in[0] + (in[0] - in[3]) * ratio;
    out[1] = in[1] + (in[1] - in[4]) * ratio;
    return true;
  }

 private:
  // P_0 to P_4, by Bonnet's recursion.
  template <class T>
  static void Legendre(const T& s, T p[5]) {
    p[0] = T(1.0);
    p[1] = s;
    for (int n = 1; n < 4; ++n) p[n + 1] = ((2.0 * n + 1.0) * s * p[n] - double(n) * p[n - 1]) / (n + 1.0);
  }
};
MISCLOSURE_EFFECT(Unflatness)

}  // namespace misclosure
