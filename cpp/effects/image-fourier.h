// Additional parameters as a Fourier series over the sensor, of degree two: 24 coefficients for x and for y.
//
// With u = pi (x/w - 1/2) and v = pi (y/h - 1/2) each pair of frequencies (m, n) has a cosine and a sine of m u + n v.
// The period is twice the sensor, so that opposite edges need not move alike. Of (m, n) and (-m, -n) one is enough, and
// (0, 0) is a shift. Coefficients are in pixels: the paper's factor of 1e-6 is left out. Source: Tang, Fritsch and
// Cramer, ISPRS Journal 71 (2012).
#include "effect.h"

namespace misclosure {

constexpr Parameter FourierTerm(const char* name) { return Estimated(name, "px", Scope::kGlobal, 0.0, 0.2); }

struct ImageFourier {
  static constexpr const char* id = "image-fourier";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kEmpirical;
  static constexpr const char* summary =
      "A displacement field over the sensor as a Fourier series of degree two; names no cause.";
  static constexpr const char* formula =
      "x += sum ax_mn cos(m u + n v) + bx_mn sin(m u + n v), y likewise, m = 0..2, n = -2..2, m > 0 or n > 0, u = pi "
      "(x/w - 1/2), v = pi (y/h - 1/2)";
  static constexpr const char* confused_with = "everything that is constant in the image.";
  static constexpr const char* source =
      "Tang, Fritsch and Cramer, New rigorous and flexible Fourier self-calibration models, ISPRS Journal 71 (2012)";
  static constexpr Parameter parameters[] = {
      FourierTerm("ax_0_1"), FourierTerm("bx_0_1"), FourierTerm("ax_0_2"), FourierTerm("bx_0_2"),
      FourierTerm("ax_1_-2"), FourierTerm("bx_1_-2"), FourierTerm("ax_1_-1"), FourierTerm("bx_1_-1"),
      FourierTerm("ax_1_0"), FourierTerm("bx_1_0"), FourierTerm("ax_1_1"), FourierTerm("bx_1_1"),
      FourierTerm("ax_1_2"), FourierTerm("bx_1_2"), FourierTerm("ax_2_-2"), FourierTerm("bx_2_-2"),
      FourierTerm("ax_2_-1"), FourierTerm("bx_2_-1"), FourierTerm("ax_2_0"), FourierTerm("bx_2_0"),
      FourierTerm("ax_2_1"), FourierTerm("bx_2_1"), FourierTerm("ax_2_2"), FourierTerm("bx_2_2"),
      FourierTerm("ay_0_1"), FourierTerm("by_0_1"), FourierTerm("ay_0_2"), FourierTerm("by_0_2"),
      FourierTerm("ay_1_-2"), FourierTerm("by_1_-2"), FourierTerm("ay_1_-1"), FourierTerm("by_1_-1"),
      FourierTerm("ay_1_0"), FourierTerm("by_1_0"), FourierTerm("ay_1_1"), FourierTerm("by_1_1"),
      FourierTerm("ay_1_2"), FourierTerm("by_1_2"), FourierTerm("ay_2_-2"), FourierTerm("by_2_-2"),
      FourierTerm("ay_2_-1"), FourierTerm("by_2_-1"), FourierTerm("ay_2_0"), FourierTerm("by_2_0"),
      FourierTerm("ay_2_1"), FourierTerm("by_2_1"), FourierTerm("ay_2_2"), FourierTerm("by_2_2"),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {0, 1};  // x, y

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    using std::cos;
    using std::sin;
    constexpr double kPi = 3.14159265358979323846;
    constexpr int kDegree = 2, kTerms = 24;
    const T u = in[0] * (kPi / context.width_px) - 0.5 * kPi;
    const T v = in[1] * (kPi / context.height_px) - 0.5 * kPi;
    T shift[2] = {T(0.0), T(0.0)};
    const T* coefficient = theta;
    for (int m = 0; m <= kDegree; ++m) {
      for (int n = m > 0 ? -kDegree : 1; n <= kDegree; ++n, coefficient += 2) {
        const T angle = double(m) * u + double(n) * v;
        const T c = cos(angle);
        const T s = sin(angle);
        shift[0] += coefficient[0] * c + coefficient[1] * s;
        shift[1] += coefficient[kTerms] * c + coefficient[kTerms + 1] * s;
      }
    }
    out[0] = in[0] + shift[0];
    out[1] = in[1] + shift[1];
    return true;
  }
};
MISCLOSURE_EFFECT(ImageFourier)

}  // namespace misclosure
