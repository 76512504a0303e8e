// Test kit for effects: the laws that every effect must keep, checked at random places through its C ABI, as a solver
// calls it. For an effect of your own:
//
//   #include "my-effect.h"
//   #include "effect_test.h"
//   int main() {
//     misclosure::test::CheckLaws(misclosure::EffectOf<misclosure::MyEffect>());
//     return misclosure::test::Finish();
//   }
//
//   c++ -std=c++17 -O1 -I cpp -I /usr/include/eigen3 my-effect-test.cc -lglog && ./a.out
//
// The places are those of a small aerial block: 40 to 120 m above ground, up to 40 degrees from the nadir, a camera of
// 20 megapixels.
#ifndef MISCLOSURE_EFFECT_TEST_H_
#define MISCLOSURE_EFFECT_TEST_H_

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "effect.h"

namespace misclosure::test {

constexpr double kPi = 3.14159265358979323846;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kWidth = 5120.0, kHeight = 3840.0;
constexpr int kSamples = 200;

// Error of a derivative relative to the largest of its column: far above the error of extrapolated differences, far
// below any slip of a sign, a factor or a term. The rounding of the differences themselves is added.
constexpr double kDerivativeTolerance = 1e-6;

inline int failures = 0;

inline void Expect(bool holds, const std::string& what) {
  if (holds) return;
  ++failures;
  std::printf("FAILED  %s\n", what.c_str());
}

inline void ExpectNear(double found, double expected, double tolerance, const std::string& what) {
  char text[200];
  std::snprintf(text, sizeof text, ": %.15g, expected %.15g within %g", found, expected, tolerance);
  Expect(std::abs(found - expected) <= tolerance, what + text);
}

struct Place {
  Context context{};
  std::vector<double> history, in, theta;
};

inline Place Draw(const misclosure_effect& effect, std::mt19937_64& random) {
  const auto between = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  Place place;
  Context& c = place.context;
  double clock = 0.0, sum = 0.0;
  for (int k = 0; k < 40; ++k) {
    clock += between(1.0, 20.0);
    place.history.push_back(clock);
    place.history.push_back(between(15.0, 30.0));
    sum += place.history.back();
  }
  c.image = static_cast<uint32_t>(between(0.0, 40.0));
  c.flight = c.image / 14;
  c.image_count = 40;
  c.flight_count = 3;
  c.camera_count = 1;
  c.width_px = kWidth;
  c.height_px = kHeight;
  c.column_px = between(0.0, kWidth);
  c.row_px = between(0.0, kHeight);
  c.time_s = place.history[2 * c.image];
  c.tau = between(-0.5, 0.5);
  c.tau_order = between(-0.5, 0.5);
  c.flight_time_s = between(0.0, 200.0);
  c.flight_span_s = 200.0;
  c.temperature_c = place.history[2 * c.image + 1];
  c.mean_temperature_c = sum / 40.0;
  c.surveyed_kind = kUnknown;
  c.exposure_s = 1e-3;
  c.focus_m = 50.0;
  for (int k = 0; k < 3; ++k) {
    c.velocity[k] = between(-8.0, 8.0);
    c.angular_velocity[k] = between(-0.5, 0.5);
    c.block_centre[k] = between(-5.0, 5.0);
    c.survey_mean[k] = between(-5.0, 5.0);
  }
  // Half a turn about a horizontal axis looks down; then a tilt.
  const double heading = between(0.0, kPi);
  const double nadir[3] = {kPi * std::cos(heading), kPi * std::sin(heading), 0.0};
  const double tilt[3] = {between(-0.4, 0.4), between(-0.4, 0.4), between(-0.4, 0.4)};
  double r[3];
  Turn(tilt, nadir, r);
  const double centre[3] = {between(-50.0, 50.0), between(-50.0, 50.0), between(40.0, 120.0)};
  // A point on a ray of the image, so that it is in front of the camera.
  const double ray[3] = {between(-0.4, 0.4), between(-0.3, 0.3), 1.0};
  double point[3];
  RotateBack(r, ray, point);
  for (int k = 0; k < 3; ++k) point[k] = centre[k] + centre[2] * point[k];
  const double interior[12] = {between(4000.0, 6000.0),
                               between(2530.0, 2590.0),
                               between(1890.0, 1950.0),
                               between(2500.0, 2620.0),
                               between(1860.0, 1980.0),
                               1e-9,
                               1e-17,
                               1e-24,
                               1e-8,
                               1e-8,
                               1e-4,
                               1e-4};
  const auto add = [&](const double* values, int count) { place.in.insert(place.in.end(), values, values + count); };
  const double image[2] = {c.column_px + between(-2.0, 2.0), c.row_px + between(-2.0, 2.0)};
  switch (static_cast<Stage>(effect.stage)) {
    case Stage::kExposure:
    case Stage::kPosition: add(r, 3), add(centre, 3); break;
    case Stage::kRay: add(r, 3), add(centre, 3), add(point, 3); break;
    case Stage::kInterior: add(interior, 12), add(r, 3); break;
    case Stage::kImage: add(image, 2), add(interior, 12); break;
    case Stage::kControl: add(point, 3); break;
    case Stage::kFrame:
      c.surveyed_kind = between(0.0, 1.0) < 0.5 ? 0.0 : 1.0;
      add(c.surveyed_kind == 0.0 ? point : centre, 3);
      break;
  }
  for (uint32_t k = 0; k < effect.parameter_count; ++k) {
    const Parameter& p = effect.parameters[k];
    const double u = between(0.0, 1.0);
    if (p.role == static_cast<uint32_t>(Role::kGiven)) {
      place.theta.push_back(p.name_count > 0 ? p.names[static_cast<uint32_t>(u * p.name_count)].value : p.nominal);
    } else if (p.role == static_cast<uint32_t>(Role::kSearched)) {
      switch (static_cast<Domain>(p.domain)) {
        case Domain::kSensorX: place.theta.push_back(u * kWidth); break;
        case Domain::kSensorY: place.theta.push_back(u * kHeight); break;
        case Domain::kSensorFraction:
          place.theta.push_back(0.5 * std::hypot(kWidth, kHeight) * (p.domain_min + u * (p.domain_max - p.domain_min)));
          break;
        default: place.theta.push_back(p.domain_min + u * (p.domain_max - p.domain_min));
      }
    } else {
      place.theta.push_back(p.typical * (4.0 * u - 2.0));
    }
  }
  return place;
}

struct Result {
  bool ok;
  std::vector<double> out, d_in, d_theta;
};

inline Result Evaluate(const misclosure_effect& effect, const Place& place, bool derivatives) {
  const Stage stage = static_cast<Stage>(effect.stage);
  const size_t m = Outputs(stage);
  Result result{false, std::vector<double>(m, kUnknown), {}, {}};
  Context context = place.context;
  context.temperature_history = place.history.data();
  context.temperature_history_length = place.history.size() / 2;
  if (derivatives) {
    result.d_in.assign(m * Inputs(stage), kUnknown);
    result.d_theta.assign(m * effect.parameter_count, kUnknown);
  }
  const int answer =
      effect.eval(effect.self, &context, place.in.data(), place.theta.data(), result.out.data(),
                  derivatives ? result.d_in.data() : nullptr, derivatives ? result.d_theta.data() : nullptr);
  const auto finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  };
  result.ok = answer == MISCLOSURE_DONE && finite(result.out) && finite(result.d_in) && finite(result.d_theta);
  return result;
}

// At the nominal values of what is estimated the output is the input, bit for bit, and its derivative exactly the
// identity's.
inline void CheckNull(const misclosure_effect& effect, Place place) {
  const std::string id = effect.id;
  const Stage stage = static_cast<Stage>(effect.stage);
  const int n = Inputs(stage), m = Outputs(stage), offset = IdentityOffset(stage);
  for (uint32_t k = 0; k < effect.parameter_count; ++k) {
    const uint32_t role = effect.parameters[k].role;
    const bool free = role == static_cast<uint32_t>(Role::kEstimated) || role == static_cast<uint32_t>(Role::kRandom);
    if (free) place.theta[k] = effect.parameters[k].nominal;
  }
  const Result value = Evaluate(effect, place, false), jet = Evaluate(effect, place, true);
  Expect(value.ok && jet.ok, id + ": null law: outside the domain");
  const size_t bytes = m * sizeof(double);
  Expect(std::memcmp(value.out.data(), &place.in[offset], bytes) == 0,
         id + ": null law: the output is not the identity");
  Expect(std::memcmp(jet.out.data(), &place.in[offset], bytes) == 0,
         id + ": null law: with derivatives, not the identity");
  for (int i = 0; i < m; ++i) {
    for (int k = 0; k < n; ++k) {
      Expect(jet.d_in[i * n + k] == (k == i + offset ? 1.0 : 0.0),
             id + ": null law: the derivative is not the identity's");
    }
  }
}

// Of the two rotation vectors of one rotation, the one near a reference.
inline void Unwrap(const double* reference, double* r) {
  const double angle = std::hypot(r[0], r[1], r[2]);
  if (std::hypot(r[0] - reference[0], r[1] - reference[1], r[2] - reference[2]) < kPi) return;
  for (int k = 0; k < 3; ++k) r[k] *= 1.0 - 2.0 * kPi / angle;
}

// Values and derivatives agree with each other and with extrapolated central differences; all are finite.
inline void CheckDerivatives(const misclosure_effect& effect, const Place& place) {
  const std::string id = effect.id;
  const Stage stage = static_cast<Stage>(effect.stage);
  const int n = Inputs(stage), m = Outputs(stage), p = static_cast<int>(effect.parameter_count),
            offset = IdentityOffset(stage);
  const int turns = stage == Stage::kExposure ? 3 : 0;
  const Result jet = Evaluate(effect, place, true), value = Evaluate(effect, place, false);
  Expect(jet.ok && value.ok, id + ": outside the domain at an ordinary place");
  if (!jet.ok || !value.ok) return;
  for (int i = 0; i < m; ++i) {
    const bool same = std::abs(jet.out[i] - value.out[i]) <= 1e-14 * (1.0 + std::abs(value.out[i]));
    Expect(same, id + ": values with and without derivatives");
  }
  for (double v : jet.d_in) Expect(std::isfinite(v), id + ": d_in is not finite or not filled");
  for (double v : jet.d_theta) Expect(std::isfinite(v), id + ": d_theta is not finite or not filled");

  for (int variable = 0; variable < n + p; ++variable) {
    double step;
    if (variable < n) {
      const bool interior = stage == Stage::kInterior, image = stage == Stage::kImage;
      const bool posed = stage == Stage::kExposure || stage == Stage::kRay || stage == Stage::kPosition;
      const bool rotation = interior ? variable >= 12 : posed && variable < 3;
      step = rotation ? 1e-3 : 1e-1;
      // k1 to b2 are far smaller, and no effect looks at them.
      if ((interior && variable >= 5 && variable < 12) || (image && variable >= 7)) continue;
    } else {
      const Parameter& parameter = effect.parameters[variable - n];
      if (parameter.role == static_cast<uint32_t>(Role::kGiven)) {
        for (int i = 0; i < m; ++i)
          Expect(jet.d_theta[i * p + variable - n] == 0.0, id + ": column of a given parameter");
        continue;
      }
      const bool searched = parameter.role == static_cast<uint32_t>(Role::kSearched);
      step = (searched ? 0.001 : 0.1) * parameter.typical;
      if (searched) step = std::min(step, 0.02 * place.theta[variable - n]);
    }
    // What the effect adds to the identity; of a rotation the whole, because its vector may be the other one.
    const auto difference = [&](double h, std::vector<double>* slope) {
      Place ends[2] = {place, place};
      std::vector<double> out[2];
      for (int side = 0; side < 2; ++side) {
        (variable < n ? ends[side].in[variable] : ends[side].theta[variable - n]) += side == 0 ? -h : h;
        const Result result = Evaluate(effect, ends[side], false);
        Expect(result.ok, id + ": a neighbouring place is outside the domain");
        out[side] = result.out;
        if (turns > 0) Unwrap(jet.out.data(), out[side].data());
        for (int i = turns; i < m; ++i) out[side][i] -= ends[side].in[offset + i];
      }
      for (int i = 0; i < m; ++i) slope->push_back((out[1][i] - out[0][i]) / (2.0 * h));
    };
    std::vector<double> coarse, fine;
    difference(step, &coarse);
    difference(0.5 * step, &fine);
    for (int group = 0; group < 2; ++group) {
      const int first = group == 0 ? 0 : turns, last = group == 0 ? turns : m;
      double largest = 0.0, size = 0.0, error = 0.0;
      for (int i = first; i < last; ++i) {
        double analytic = variable < n ? jet.d_in[i * n + variable] : jet.d_theta[i * p + variable - n];
        if (group == 1 && variable == offset + i) analytic -= 1.0;
        largest = std::max(largest, std::abs(analytic));
        size = std::max(size, std::abs(place.in[offset + i]));
        error = std::max(error, std::abs(analytic - (4.0 * fine[i] - coarse[i]) / 3.0));
      }
      constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
      const double rounding = 16.0 * kEpsilon * (1.0 + size) / step + 4.0 * kEpsilon;
      Expect(error <= kDerivativeTolerance * largest + rounding,
             id + ": derivative by variable " + std::to_string(variable) + ": error " + std::to_string(error) + " of " +
                 std::to_string(largest));
    }
  }
}

// Where what it needs is not known, an effect says so; where only other things are unknown, it answers.
inline void CheckNeeds(const misclosure_effect& effect, const Place& place) {
  for (const Need need : {Need::kTime, Need::kTemperature, Need::kVelocity}) {
    Place blind = place;
    for (uint32_t k = 0; k < effect.parameter_count; ++k) {
      const uint32_t role = effect.parameters[k].role;
      const bool fixed = role == static_cast<uint32_t>(Role::kGiven) || role == static_cast<uint32_t>(Role::kSearched);
      if (fixed) blind.theta[k] = effect.parameters[k].nominal;
    }
    Context& c = blind.context;
    if (need != Need::kVelocity) blind.history.clear();
    if (need == Need::kTime) c.time_s = c.tau = c.flight_time_s = c.flight_span_s = kUnknown;
    if (need == Need::kTemperature) c.temperature_c = c.mean_temperature_c = kUnknown;
    if (need == Need::kVelocity) c.velocity[0] = c.velocity[1] = c.velocity[2] = kUnknown;
    bool needed = false;
    for (uint32_t k = 0; k < effect.need_count; ++k) needed |= effect.needs[k] == static_cast<uint32_t>(need);
    const std::string what = std::string(effect.id) + ": need " + std::to_string(static_cast<int>(need));
    Expect(Evaluate(effect, blind, false).ok != needed, what);
  }
}

// Surveyed points belong to no image: what acts on them has global parameters, and the same values where all of an
// image is unknown.
inline void CheckSurveyed(const misclosure_effect& effect, const Place& place) {
  const Stage stage = static_cast<Stage>(effect.stage);
  if (stage != Stage::kControl && stage != Stage::kFrame) return;
  const std::string id = effect.id;
  for (uint32_t k = 0; k < effect.parameter_count; ++k) {
    const bool global = effect.parameters[k].scope == static_cast<uint32_t>(Scope::kGlobal);
    Expect(global, id + ": a parameter of surveyed points that is not global");
  }
  Place bare = place;
  Context& c = bare.context;
  c.image = c.flight = c.camera = std::numeric_limits<uint32_t>::max();
  for (double* of_image : {&c.width_px, &c.height_px, &c.column_px, &c.row_px, &c.time_s, &c.tau, &c.tau_order,
                           &c.flight_time_s, &c.flight_span_s, &c.temperature_c, &c.exposure_s, &c.focus_m}) {
    *of_image = kUnknown;
  }
  for (int k = 0; k < 3; ++k) c.velocity[k] = c.angular_velocity[k] = kUnknown;
  const Result with = Evaluate(effect, place, false), without = Evaluate(effect, bare, false);
  Expect(with.ok && without.ok && with.out == without.out, id + ": reads something of an image");
}

// A plausible range belongs to a size, has its source, and holds nominal and typical value; words are all stated or
// none.
inline void CheckStated(const misclosure_effect& effect) {
  const std::string id = effect.id;
  for (uint32_t k = 0; k < effect.parameter_count; ++k) {
    const Parameter& p = effect.parameters[k];
    const std::string name = id + ": range of " + p.name;
    if (p.plausible_source == nullptr) {
      Expect(p.plausible_min == 0.0 && p.plausible_max == 0.0, name + ": no source");
      continue;
    }
    const Role role = static_cast<Role>(p.role);
    const bool size = role == Role::kEstimated || role == Role::kRandom;
    const double width = p.plausible_max - p.plausible_min;
    const auto holds = [&](double value) { return p.plausible_min <= value && value <= p.plausible_max; };
    Expect(size, name + ": it is neither estimated nor random");
    Expect(width > 0.0 && std::isfinite(width), name + ": it is none");
    Expect(holds(p.nominal) && holds(p.typical), name + ": nominal and typical value are not within");
  }
  const int stated = (effect.what != nullptr) + (effect.remedy != nullptr) + (effect.tell != nullptr);
  Expect(stated == 0 || stated == 3, id + ": of the three words some are missing");
}

// What is stated, null law, derivatives, and that a missing observation is noticed, at many random places.
inline void CheckLaws(const misclosure_effect& effect) {
  CheckStated(effect);
  std::mt19937_64 random(7);
  for (int k = 0; k < kSamples; ++k) {
    const Place place = Draw(effect, random);
    CheckNull(effect, place);
    CheckDerivatives(effect, place);
    CheckNeeds(effect, place);
    CheckSurveyed(effect, place);
  }
}

// Says what became of the test; the program's exit code.
inline int Finish() {
  std::printf("%s\n", failures == 0 ? "passed" : "FAILED");
  return failures == 0 ? 0 : 1;
}

}  // namespace misclosure::test

#endif  // MISCLOSURE_EFFECT_TEST_H_
