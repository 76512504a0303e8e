// Surveyed coordinates of a map, with heights above a curved earth, used as if they were Cartesian.
//
// The Cartesian system touches a sphere of radius Re at the survey's centre: x, y in the tangent plane, h = z - z0
// upwards, D^2 = x^2 + y^2. The sphere's centre is Re below, and P is sqrt(D^2 + (Re + h)^2) away from it: its height
// in the map is
//   h + D^2 / (2 Re)
// and the foot of its plumb line, at the angle atan(D / (Re + h)), lies in the map at the distance
//   D (1 - h / Re).
// What is left out is of third order in D and h, over Re^2: 8 mm at 10 km. q = 1 is this earth, q = 0 none.
#include "effect.h"
#include "surveyed.h"

namespace misclosure {

struct EarthCurvature {
  static constexpr const char* id = "earth-curvature";
  static constexpr Stage stage = Stage::kFrame;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "Surveyed coordinates of a map, with heights above a curved earth, are used as if they were Cartesian.";
  static constexpr const char* formula =
      "S = P + q (-x (z - z0) / Re, -y (z - z0) / Re, (x^2 + y^2) / (2 Re)), x and y from the survey's centre, z0 its "
      "height, Re = 6371 km";
  static constexpr const char* confused_with = "free:radial, free:f, refraction: all dome a block.";
  static constexpr const char* source = "geometry; e.g. Kraus, Photogrammetry (2007)";
  static constexpr double kEarthRadius = 6371000.0;  // m, mean
  static constexpr Parameter parameters[] = {
      Estimated("q", "1", Scope::kGlobal, 0.0, 1.0),
      Given("in", "1", kInBoth, kSurveyedIn),
  };
  // Control or GNSS, that is any datum in which heights mean something.
  static constexpr std::array needs = {Need::kVertical};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    bool acts;
    if (!ActsOn(context, theta[1], &acts)) return false;
    for (int k = 0; k < 3; ++k) out[k] = in[k];
    if (!acts) return true;
    const T x = in[0] - context.survey_mean[0];
    const T y = in[1] - context.survey_mean[1];
    const T curvature = theta[0] / kEarthRadius;
    const T lean = curvature * (in[2] - context.survey_mean[2]);
    out[0] -= lean * x;
    out[1] -= lean * y;
    out[2] += 0.5 * curvature * (x * x + y * y);
    return true;
  }
};
MISCLOSURE_EFFECT(EarthCurvature)

}  // namespace misclosure
