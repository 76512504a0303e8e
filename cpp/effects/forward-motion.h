// The middle of the exposure is later than its start, at which the pose was recorded: C += v t_e / 2.
#include "effect.h"

namespace misclosure {

struct ForwardMotion {
  static constexpr const char* id = "forward-motion";
  static constexpr Stage stage = Stage::kExposure;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char* summary =
      "The image is that of the middle of the exposure, half an exposure time after the recorded position.";
  static constexpr const char* formula = "C += v t_e / 2";
  static constexpr const char* confused_with =
      "gnss-delay: the same up to a factor, always; only GNSS or control shows either.";
  static constexpr const char* source = "practice: centroid of motion blur";
  static constexpr Parameter parameters[] = {
      Estimated("t_e", "s", Scope::kGlobal, 0.0, 0.004),
  };
  static constexpr std::array needs = {Need::kVelocity};
  static constexpr std::array<int, 0> reads = {};

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 3; ++k) {
      out[k] = in[k];
      out[3 + k] = in[3 + k] + theta[0] * (0.5 * context.velocity[k]);
    }
    return true;
  }
};
MISCLOSURE_EFFECT(ForwardMotion)

}  // namespace misclosure
