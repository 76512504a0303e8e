// What the tests of the effects' values share: a camera, and an effect evaluated at a place.
#pragma once

#include "effect_test.h"

#include <cmath>
#include <string>
#include <vector>

namespace misclosure::test {

constexpr double kRounding = 1e-12;  // relative to numbers of the size of image coordinates, or metres
constexpr double kNadir[3] = {kPi, 0.0, 0.0};

using Values = std::vector<double>;

// A camera of 5000 x 3000 px.
inline Context Camera() {
  Context context{};
  context.width_px = 5000.0;
  context.height_px = 3000.0;
  return context;
}

template <class E>
Result At(const Context& context, const Values& in, const Values& theta, const Values& history = {}) {
  return Evaluate(EffectOf<E>(), Place{context, history, in, theta}, false);
}

template <class E>
void ExpectOut(const Context& context, const Values& in, const Values& theta, const Values& expected,
               const Values& history = {}) {
  const Result result = At<E>(context, in, theta, history);
  Expect(result.ok, std::string(E::id) + ": outside the domain");
  for (size_t k = 0; k < expected.size(); ++k) {
    ExpectNear(result.out[k], expected[k], kRounding * (1.0 + std::abs(expected[k])),
               std::string(E::id) + " " + std::to_string(k));
  }
}

template <class E>
void ExpectOutside(const Context& context, const Values& in, const Values& theta, const char* why) {
  Expect(!At<E>(context, in, theta).ok, std::string(E::id) + ": answers " + why);
}

template <class E>
void ExpectNames(const std::vector<std::string>& names) {
  const misclosure_effect& effect = EffectOf<E>();
  Expect(effect.parameter_count == names.size(), std::string(E::id) + ": number of parameters");
  for (size_t k = 0; k < names.size() && k < effect.parameter_count; ++k) {
    Expect(names[k] == effect.parameters[k].name, std::string(E::id) + ": parameter " + names[k]);
  }
}

inline Values Interior(double f, double ppx, double ppy, double dcx, double dcy, const double r[3]) {
  return {f, ppx, ppy, dcx, dcy, 0, 0, 0, 0, 0, 0, 0, r[0], r[1], r[2]};
}

// An image point, f = 4000, pp = dc = (2500, 1500).
inline Values Image(double x, double y) { return {x, y, 4000, 2500, 1500, 2500, 1500, 0, 0, 0, 0, 0, 0, 0}; }

}  // namespace misclosure::test
