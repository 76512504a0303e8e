// A sensor that was exposed in steps on the wafer: its pixels are displaced periodically along the rows.
//
// `data/hidden/unknown-closerange-stitch.toml` is such a block: without this effect its diagnosis ends `unexplained`
// and says that a pattern repeats every 250 px along x; with it, it is explained.
//
//   misclosure effects build sensor-pattern.h -o sensor-pattern.so
//   misclosure improve BLOCK -o RUN --plugin sensor-pattern.so
#include "effect.h"

namespace misclosure {

struct SensorPatternEffect {
  static constexpr const char* id = "sensor-pattern";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary = "The columns of the sensor are displaced by a wave, as where it was exposed in steps.";
  static constexpr const char* formula = "x += a sin(2 pi x / wavelength) + b cos(2 pi x / wavelength)";
  static constexpr const char* confused_with = "image-fourier, whose shortest waves are longer; unflatness is smooth over the sensor.";
  static constexpr const char* source = "stepper lithography: fields of a wafer are exposed one after the other";
  // Sine and cosine together have any phase, and the effect is linear in both: nothing is to be searched. The period is
  // given, for at a = b = 0 nothing depends on it, and a start beside it by more than a fifth of period^2 / width finds
  // nothing.
  static constexpr Parameter parameters[] = {
      UpTo(Estimated("a", "px", Scope::kGlobal, 0.0, 0.2), 1.0, "fields of a stepper are placed to less than a pixel"),
      UpTo(Estimated("b", "px", Scope::kGlobal, 0.0, 0.2), 1.0, "fields of a stepper are placed to less than a pixel"),
      Given("wavelength", "px", 250.0),
  };
  static constexpr Words words = {
      "The sensor was exposed in steps when it was made, and the steps do not quite meet. Its columns are displaced in "
      "a wave that repeats from step to step.",
      "Model it, or have the sensor calibrated.",
      "images turned by 90 degrees, in which the wave runs across the other way"};
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {0};  // x

  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    using std::cos;
    using std::sin;
    if (!(theta[2] > 0.0)) return false;
    constexpr double kTurn = 6.283185307179586;
    // Of the predicted point: of the measured one, the phase would follow the noise.
    const T phase = kTurn * in[0] / theta[2];
    out[0] = in[0] + theta[0] * sin(phase) + theta[1] * cos(phase);
    out[1] = in[1];
    return true;
  }
};
MISCLOSURE_EFFECT(SensorPatternEffect)

}  // namespace misclosure
