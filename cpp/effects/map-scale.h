// Surveyed coordinates in a map projection, whose scale is not one: S = P + m (P_h - mean P_h).
// Source: Ressl, IAPRS 34-3A (2002).
#include "effect.h"

namespace misclosure {

struct MapScale {
  static constexpr const char* id = "map-scale";
  static constexpr Stage stage = Stage::kControl;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The survey is given in a map projection whose scale is not one; its horizontal coordinates are stretched, heights "
      "are not.";
  static constexpr const char* formula = "S = P + m (P_h - mean P_h), horizontal part, mean over the surveyed points";
  static constexpr const char* confused_with =
      "free:f: heights scale with the focal length; GNSS positions hold the true scale.";
  static constexpr const char* source =
      "Ressl, The impact of conformal map projections on direct georeferencing, IAPRS 34-3A (2002)";
  static constexpr Parameter parameters[] = {
      Estimated("m", "1", Scope::kGlobal, 0.0, 4e-4),
  };
  static constexpr std::array needs = {Need::kControl, Need::kGnss};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 2; ++k) out[k] = in[k] + theta[0] * (in[k] - context.survey_mean[k]);
    out[2] = in[2];
    return true;
  }
};
MISCLOSURE_EFFECT(MapScale)

}  // namespace misclosure
