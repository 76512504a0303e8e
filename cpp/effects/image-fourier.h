// Additional parameters as a Fourier series over the sensor, of degree one: 8 terms for x and for y.
//
// With u = 2 pi x/w - pi and v = 2 pi y/h - pi the terms are, in this order, cos and sin of u, v, u + v and u - v. Coefficients are
// in pixels: the paper's factor of 1e-6 is left out.
// Source: Tang, Fritsch and Cramer, ISPRS Journal 71 (2012).
#include "effect.h"

namespace misclosure {

constexpr Parameter FourierTerm(const char* name) { return Estimated(name, "px", Scope::kGlobal, 0.0, 0.3); }

struct ImageFourier {
  static constexpr const char* id = "image-fourier";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kEmpirical;
  static constexpr const char* summary =
      "A displacement field over the sensor as a Fourier series of degree one; names no cause.";
  static constexpr const char* formula =
      "x += sum ax_i e_i, y += sum ay_i e_i, e = cos u, sin u, cos v, sin v, cos(u+v), sin(u+v), cos(u-v), sin(u-v), u = "
      "2 pi x/w - pi, v = 2 pi y/h - pi";
  static constexpr const char* confused_with = "everything that is constant in the image.";
  static constexpr const char* source =
      "Tang, Fritsch and Cramer, New rigorous and flexible Fourier self-calibration models, ISPRS Journal 71 (2012)";
  static constexpr Parameter parameters[] = {
      FourierTerm("ax_1"), FourierTerm("ax_2"), FourierTerm("ax_3"), FourierTerm("ax_4"),
      FourierTerm("ax_5"), FourierTerm("ax_6"), FourierTerm("ax_7"), FourierTerm("ax_8"),
      FourierTerm("ay_1"), FourierTerm("ay_2"), FourierTerm("ay_3"), FourierTerm("ay_4"),
      FourierTerm("ay_5"), FourierTerm("ay_6"), FourierTerm("ay_7"), FourierTerm("ay_8"),
  };
  static constexpr std::array<Need, 0> needs = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    using std::cos;
    using std::sin;
    constexpr double kPi = 3.14159265358979323846;
    const T u = in[0] * (2.0 * kPi / context.width_px) - kPi;
    const T v = in[1] * (2.0 * kPi / context.height_px) - kPi;
    const T angles[4] = {u, v, u + v, u - v};
    T shift[2] = {T(0.0), T(0.0)};
    for (int k = 0; k < 4; ++k) {
      const T c = cos(angles[k]);
      const T s = sin(angles[k]);
      shift[0] += theta[2 * k] * c + theta[2 * k + 1] * s;
      shift[1] += theta[8 + 2 * k] * c + theta[9 + 2 * k] * s;
    }
    out[0] = in[0] + shift[0];
    out[1] = in[1] + shift[1];
    return true;
  }
};
MISCLOSURE_EFFECT(ImageFourier)

}  // namespace misclosure
