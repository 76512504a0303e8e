// Surveyed coordinates in a map projection, whose scale is not one: S = P + m (x, y, 0) about the survey's centre.
// Source: Ressl, IAPRS 34-3A (2002).
#include "effect.h"
#include "surveyed.h"

namespace misclosure {

struct MapScale {
  static constexpr const char* id = "map-scale";
  static constexpr Stage stage = Stage::kFrame;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The survey is given in a map projection whose scale is not one; its horizontal coordinates are stretched, "
      "heights are not.";
  static constexpr const char* formula = "S = P + m (x, y, 0), x and y from the survey's centre";
  static constexpr const char* confused_with =
      "free:f: heights scale with the focal length, unless positions of antennas hold it.";
  static constexpr const char* source =
      "Ressl, The impact of conformal map projections on direct georeferencing, IAPRS 34-3A (2002)";
  static constexpr Parameter parameters[] = {
      Estimated("m", "1", Scope::kGlobal, 0.0, 4e-4),
      Given("in", "1", kInBoth, kSurveyedIn),
  };
  // Control or GNSS, that is any datum in which heights mean something.
  static constexpr std::array needs = {Need::kVertical};
  static constexpr std::array reads = {0, 1};  // x, y

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    bool acts;
    if (!ActsOn(context, theta[1], &acts)) return false;
    for (int k = 0; k < 3; ++k) out[k] = in[k];
    if (!acts) return true;
    for (int k = 0; k < 2; ++k) out[k] += theta[0] * (in[k] - context.survey_mean[k]);
    return true;
  }
};
MISCLOSURE_EFFECT(MapScale)

}  // namespace misclosure
