// A flaw of the sensor or of a filter that bends the image around one place.
#include "effect.h"

namespace misclosure {

struct LocalFlaw {
  static constexpr const char* id = "local-flaw";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "Image points around one place of the sensor are pushed away from it (or drawn to it), as by a drop or a "
      "scratch.";
  static constexpr const char* formula =
      "(x, y) += lambda exp(-s^2/sigma^2) q/s, q = (x, y) - centre, s = |q|; smooth: q/sigma instead of q/s";
  static constexpr const char* confused_with =
      "unflatness, image-grid: smooth over the whole sensor; the flaw is confined to a few sigma around its centre.";
  static constexpr const char* source = "Zhou et al. 2019, eq. 3 with the sign that decays";
  static constexpr Name smooth[] = {{"off", 0.0}, {"on", 1.0}};
  static constexpr Parameter parameters[] = {
      Estimated("lambda", "px", Scope::kGlobal, 0.0, 1.0),
      Searched("centre_x", "px", Scope::kGlobal, 0.0, 1000.0, Domain::kSensorX),
      Searched("centre_y", "px", Scope::kGlobal, 0.0, 1000.0, Domain::kSensorY),
      Searched("sigma", "px", Scope::kGlobal, 200.0, 200.0, Domain::kSensorFraction, 0.03, 0.5),
      Given("smooth", "1", 0.0, smooth),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {0, 1};  // x, y

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    using std::exp;
    using std::sqrt;
    const T& sigma = theta[3];
    if (!(sigma > 0.0)) return false;
    const T qx = in[0] - theta[1];
    const T qy = in[1] - theta[2];
    const T s2 = qx * qx + qy * qy;
    out[0] = in[0];
    out[1] = in[1];
    const bool sharp = theta[4] == 0.0;
    if (sharp && s2 == 0.0) return true;  // no direction there: the mean over all of them is none
    const T push = theta[0] * exp(-s2 / (sigma * sigma)) / (sharp ? sqrt(s2) : sigma);
    out[0] += push * qx;
    out[1] += push * qy;
    return true;
  }
};
MISCLOSURE_EFFECT(LocalFlaw)

}  // namespace misclosure
