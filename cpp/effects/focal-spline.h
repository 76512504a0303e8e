// A focal length that varies smoothly within each flight: a uniform cubic B-spline of six coefficients over its
// duration.
#include "effect.h"
#include "bspline.h"

namespace misclosure {

struct FocalSpline {
  static constexpr const char* id = "focal-spline";
  static constexpr Stage stage = Stage::kInterior;
  static constexpr Kind kind = Kind::kEmpirical;
  static constexpr const char* summary =
      "The focal length varies smoothly within each flight, in any way; names no cause.";
  static constexpr const char* formula =
      "f += sum a_j B_j(3 t / span), t since the first image of the flight, uniform cubic B-spline";
  static constexpr const char* confused_with =
      "focal-time, focal-temperature, focal-flight: it takes all of them along.";
  static constexpr const char* source = "de Boor, A Practical Guide to Splines (2001)";
  static constexpr Parameter parameters[] = {
      Estimated("a_0", "px", Scope::kFlight, 0.0, 3.0),
      Estimated("a_1", "px", Scope::kFlight, 0.0, 3.0),
      Estimated("a_2", "px", Scope::kFlight, 0.0, 3.0),
      Estimated("a_3", "px", Scope::kFlight, 0.0, 3.0),
      Estimated("a_4", "px", Scope::kFlight, 0.0, 3.0),
      Estimated("a_5", "px", Scope::kFlight, 0.0, 3.0),
  };
  static constexpr std::array needs = {Need::kTime};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    constexpr int kPieces = 3;
    const double time = context.flight_time_s;
    const double span = context.flight_span_s;
    if (!(time >= 0.0) || !(time <= span)) return false;
    const double place = span > 0.0 ? time / span : 0.0;  // a flight of one image is its start
    double weight[4];
    const int first = CubicBSpline(kPieces * place, kPieces, weight);
    T shift(0.0);
    for (int k = 0; k < 4; ++k) shift += theta[first + k] * weight[k];
    for (int k = 0; k < 12; ++k) out[k] = in[k];
    out[0] += shift;
    return true;
  }
};
MISCLOSURE_EFFECT(FocalSpline)

}  // namespace misclosure
