// Every built-in effect keeps the laws, and the kit sees an effect that does not.
#include <set>

#include "effect_test.h"
#include "solve.h"

namespace misclosure {

// Breaks the null law: moves the point where nothing should move it.
struct Pusher {
  static constexpr const char* id = "pusher";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kEmpirical;
  static constexpr const char *summary = "", *formula = "", *confused_with = "", *source = "";
  static constexpr Parameter parameters[] = {Estimated("a", "px", Scope::kGlobal, 0.0, 1.0)};
  static constexpr std::array<Need, 0> needs = {};
  template <class T>
  static bool Apply(const Context&, const T* in, const T* theta, T* out) {
    out[0] = in[0] + 1e-9;
    out[1] = in[1] + theta[0];
    return true;
  }
};

// Breaks the law of surveyed points: a survey that drifts with the time of an image.
struct Timed {
  static constexpr const char* id = "timed";
  static constexpr Stage stage = Stage::kFrame;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char *summary = "", *formula = "", *confused_with = "", *source = "";
  static constexpr Parameter parameters[] = {Estimated("a", "m", Scope::kGlobal, 0.0, 1.0)};
  static constexpr std::array needs = {Need::kTime};
  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 3; ++k) out[k] = in[k] + theta[0] * context.tau;
    return true;
  }
};

// A derivative that is wrong in one place by a thousandth.
int WrongDerivative(void* self, const misclosure_context* context, const double* in, const double* theta, double* out,
                    double* d_in, double* d_theta) {
  const auto* right = static_cast<const misclosure_effect*>(self);
  const int ok = right->eval(right->self, context, in, theta, out, d_in, d_theta);
  if (d_theta != nullptr) d_theta[0] *= 1.001;
  return ok;
}

}  // namespace misclosure

using namespace misclosure;

int main() {
  const misclosure_effect* flaw = nullptr;
  std::set<std::string> ids;
  std::set<uint32_t> stages;
  for (std::size_t k = 0; const misclosure_effect* effect = misclosure_builtin(k); ++k) {
    test::CheckLaws(*effect);
    test::Expect(ids.insert(effect->id).second, std::string(effect->id) + ": the id stands for two effects");
    stages.insert(effect->stage);
    if (std::string(effect->id) == "local-flaw") flaw = effect;
  }
  test::Expect(ids.size() >= 3, "the registry has the effects");
  test::Expect(flaw != nullptr, "the registry has local-flaw");
  test::Expect(stages.count(static_cast<uint32_t>(Stage::kFrame)) == 1, "the registry has effects of the frame");
  const int own = test::failures;

  test::CheckLaws(EffectOf<Pusher>());
  const int after_pusher = test::failures;
  test::CheckLaws(EffectOf<Timed>());
  const int after_timed = test::failures;
  misclosure_effect wrong = *flaw;
  wrong.self = const_cast<misclosure_effect*>(flaw);
  wrong.eval = &WrongDerivative;
  test::CheckLaws(wrong);
  const bool seen = after_pusher > own && after_timed > after_pusher && test::failures > after_timed;
  std::printf("(the failures of `pusher`, of `timed` and of the altered `local-flaw` are meant)\n");
  test::failures = own;
  test::Expect(seen, "the kit sees effects that break the laws");
  return test::Finish();
}
