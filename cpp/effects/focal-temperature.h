// A focal length that follows the temperature: f += a (T_lens - mean T).
//
// The lens follows the camera's temperature T with a lag: T_lens' = (T - T_lens) / lag. T runs straight from
// measurement to measurement, the lens starts in equilibrium with the first. On a piece of slope s the difference e =
// T_lens - T obeys e' = -e / lag - s, so that after a time h it is e exp(-h / lag) - s lag (1 - exp(-h / lag)): no step
// size enters. Source: Daakir et al., ISPRS Journal 148 (2019).
#include "effect.h"

namespace misclosure {

struct FocalTemperature {
  static constexpr const char* id = "focal-temperature";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The focal length follows the temperature of the lens, which may lag behind the measured one.";
  static constexpr const char* formula =
      "f += a (T_lens - mean T), T_lens' = (T - T_lens) / lag; T_lens = T where lag = 0";
  static constexpr const char* confused_with =
      "focal-time: a temperature that rises steadily is a clock; told apart by cooling, or by several flights.";
  static constexpr const char* source =
      "Daakir et al., Improvement of photogrammetric accuracy by modeling and correcting the thermal effect on camera "
      "calibration, ISPRS Journal 148 (2019)";
  static constexpr Parameter parameters[] = {
      Estimated("a", "px/K", Scope::kGlobal, 0.0, 0.5),
      Searched("lag", "s", Scope::kGlobal, 0.0, 100.0, Domain::kRange, 0.0, 600.0),
  };
  static constexpr std::array needs = {Need::kTemperature};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    T lens;
    if (!LensTemperature(context, theta[1], &lens)) return false;
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    out[0] += theta[0] * (lens - context.mean_temperature_c);
    return true;
  }

 private:
  // False where a lag is asked for and the temperature's course up to this image is not known.
  template <class T>
  static bool LensTemperature(const Context& context, const T& lag, T* lens) {
    using std::exp;
    if (!(lag >= 0.0)) return false;
    const bool lags = lag > 0.0;
    const uint64_t count = context.temperature_history_length;
    const double* history = context.temperature_history;
    const double now = context.time_s;
    const bool known = count > 0 && now >= history[0] && now <= history[2 * (count - 1)];
    if (lags && !known) return false;
    T behind(0.0);  // T_lens - T
    double camera = lags ? history[1] : context.temperature_c;
    for (uint64_t k = 1; known && k < count && history[2 * (k - 1)] < now; ++k) {
      const double start = history[2 * (k - 1)], from = history[2 * (k - 1) + 1];
      const double end = history[2 * k], to = history[2 * k + 1];
      if (now - end > kForgotten * lag) continue;
      if (end > start) {
        const double step = (end < now ? end : now) - start;
        const double slope = (to - from) / (end - start);
        // At no lag the decay is complete; the derivative by the lag, -slope, remains.
        const T decay = step < kForgotten * lag ? exp(-step / lag) : T(0.0);
        behind = behind * decay - slope * lag * (T(1.0) - decay);
        if (lags) camera = from + slope * step;
      } else {
        behind += from - to;  // two measurements at one time: a jump, which the lens has not followed yet
        if (lags) camera = to;
      }
    }
    *lens = behind + camera;
    return true;
  }

  static constexpr double kForgotten = 40.0;  // lags; exp(-40) is below rounding
};
MISCLOSURE_EFFECT(FocalTemperature)

}  // namespace misclosure
