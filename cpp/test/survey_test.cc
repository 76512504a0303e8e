// Surveyed coordinates through the solver's interface: the stages control and position, then the frame; numbers worked
// by hand, and the Jacobian against differences.
#include <cmath>

#include "effect_test.h"
#include "effects/earth-curvature.h"
#include "effects/gnss-lever-arm.h"
#include "effects/map-scale.h"
#include "solve.h"

namespace misclosure {

// A shift of every coordinate, before the frame. It answers only where the kind of the coordinate is not told.
template <Stage S>
struct Shift {
  static constexpr const char* id = S == Stage::kControl ? "control-shift" : "antenna-shift";
  static constexpr Stage stage = S;
  static constexpr Kind kind = Kind::kPhysical;
  static constexpr const char *summary = "", *formula = "", *confused_with = "", *source = "";
  static constexpr Parameter parameters[] = {Estimated("s", "m", Scope::kGlobal, 0.0, 1.0)};
  static constexpr std::array<Need, 0> needs = {};
  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    for (int k = 0; k < 3; ++k) out[k] = in[IdentityOffset(S) + k] + theta[0];
    return std::isnan(context.surveyed_kind);
  }
};

}  // namespace misclosure

using namespace misclosure;
using namespace misclosure::test;

namespace {

template <class T>
Span<T> Of(const std::vector<T>& values) {
  return {values.data(), values.size()};
}

enum Theta { kQ, kCurvatureIn, kM, kScaleIn, kControlShift, kAntennaShift, kArm };

// One point, surveyed, and one nadir image with an antenna. The frame's effects stand first in the model and still act
// last.
struct Survey {
  std::vector<const misclosure_effect*> effects = {&EffectOf<EarthCurvature>(), &EffectOf<MapScale>(),
                                                   &EffectOf<Shift<Stage::kControl>>(),
                                                   &EffectOf<Shift<Stage::kPosition>>(), &EffectOf<GnssLeverArm>()};
  std::vector<uint8_t> effect_reads_place = std::vector<uint8_t>(10, 0);
  std::vector<uint32_t> slot_start = {0, 2, 4, 5, 6, 9};
  std::vector<uint32_t> slot_scope = std::vector<uint32_t>(9, 0), slot_base = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  // An earth of 1000 m radius: q / Re = 1e-3.
  std::vector<double> theta = {6371, kInBoth, 0.1, kInBoth, 2, -1, 2, -3, 2};
  std::vector<double> theta_scales = {3, 1, 2, 1, 4, 5, 6, 7, 8};
  std::vector<uint8_t> theta_free = {1, 0, 1, 0, 1, 1, 1, 1, 1};
  std::vector<double> interiors = {5000, 2500, 2000, 2500, 2000, 0, 0, 0, 0, 0, 0, 0},
                      ones = std::vector<double>(12, 1.0);
  std::vector<uint8_t> held = std::vector<uint8_t>(12, 0), pose_free = std::vector<uint8_t>(6, 1);
  std::vector<misclosure_context> contexts = std::vector<misclosure_context>(1);
  misclosure_context control_context = {};
  std::vector<double> rotations = {0, 1, 0, 0};  // half a turn about x
  std::vector<double> centres = {10, 0, 50}, points = {2, 5, 0};
  std::vector<uint64_t> point_start = {0, 0};
  std::vector<uint32_t> first = {0};
  std::vector<double> control = {5, 8, 3}, control_sigma = {0.1, 0.2, 0.5};
  std::vector<double> antenna = {12, 2, 47}, antenna_sigma = {0.5, 0.1, 0.05};

  Survey() {
    contexts[0] = {};
    contexts[0].image_count = contexts[0].flight_count = contexts[0].camera_count = 1;
    for (misclosure_context* context : {&contexts[0], &control_context}) {
      context->survey_mean[0] = 1, context->survey_mean[1] = 3, context->survey_mean[2] = -3;
      context->surveyed_kind = 0;  // the solver's to say, whatever stands here
    }
  }

  ProblemView View() const {
    ProblemView view;
    view.interiors = Of(interiors);
    view.camera_scales = view.camera_domains = Of(ones);
    view.camera_free = Of(held);
    view.pose_free = Of(pose_free);
    view.theta = Of(theta);
    view.theta_scales = Of(theta_scales);
    view.theta_free = Of(theta_free);
    view.effects = Of(effects);
    view.effect_reads_place = Of(effect_reads_place);
    view.slot_start = Of(slot_start);
    view.slot_scope = Of(slot_scope);
    view.slot_base = Of(slot_base);
    view.contexts = Of(contexts);
    view.control_context = control_context;
    view.rotations = Of(rotations);
    view.centres = Of(centres);
    view.points = Of(points);
    view.point_start = Of(point_start);
    view.control_point = view.gnss_image = Of(first);
    view.control_position = Of(control);
    view.control_sigma = Of(control_sigma);
    view.gnss_position = Of(antenna);
    view.gnss_sigma = Of(antenna_sigma);
    return view;
  }
};

// The surveyed coordinates that the residuals were formed with: point, antenna.
void ExpectSurveyed(const Survey& survey, const std::vector<double>& expected, const std::string& what) {
  const std::vector<double> residuals = Evaluate(survey.View()).residuals;
  Expect(residuals.size() == 6, what + ": number of residuals");
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const bool point = k < 3;
    const double observed = point ? survey.control[k] : survey.antenna[k - 3];
    const double sigma = point ? survey.control_sigma[k] : survey.antenna_sigma[k - 3];
    ExpectNear(observed - sigma * residuals[k], expected[k], 1e-12, what + ", coordinate " + std::to_string(k));
  }
}

void Order() {
  // The point (2, 5, 0) shifted by 2 is (4, 7, 2): (3, 4, 5) from the centre. Bent by (-3 * 5, -4 * 5, 25 / 2) * 1e-3
  // it is (3.985, 6.98, 2.0125), (2.985, 3.98) from the centre, of which a tenth is added.
  const double point[] = {4.2835, 7.378, 2.0125};
  // The arm (2, -3, 2) is (2, 3, -2) in the world. With the shift by -1 the antenna is at (11, 2, 47): (10, -1, 50)
  // from the centre. Bent by (-10 * 50, 50, 101 / 2) * 1e-3 it is (10.5, 2.05, 47.0505), (9.5, -0.95) from the centre.
  const double antenna[] = {11.45, 1.955, 47.0505};
  // Without curvature: a tenth of (3, 4), and of (10, -1).
  const double flat_point[] = {4.3, 7.4, 2}, flat_antenna[] = {12, 1.9, 47};
  Survey survey;
  const auto expect = [&](double in, const double* p, const double* a, const char* what) {
    survey.theta[kCurvatureIn] = in;
    ExpectSurveyed(survey, {p[0], p[1], p[2], a[0], a[1], a[2]}, what);
  };
  expect(kInBoth, point, antenna, "curvature in both");
  expect(kInControl, point, flat_antenna, "curvature in control");
  expect(kInGnss, flat_point, antenna, "curvature in gnss");
}

// Without an effect of the position stage no rotation takes part.
void Unturned() {
  Survey survey;
  survey.effects.resize(2);
  survey.effect_reads_place.resize(4);
  survey.slot_start.resize(3);
  for (auto* slots : {&survey.slot_scope, &survey.slot_base}) slots->resize(4);
  for (auto* values : {&survey.theta, &survey.theta_scales}) values->resize(4);
  survey.theta_free.resize(4);
  // The point is (1, 2, 3) from the centre and bent to (-3, -6, 5 / 2) * 1e-3 more; the antenna, (9, -3, 53) from it,
  // by (-477, 159, 45) * 1e-3. A tenth of (0.997, 1.994) and of (8.523, -2.841) is added.
  ExpectSurveyed(survey, {2.0967, 5.1934, 0.0025, 10.3753, -0.1251, 50.045}, "no stage before the frame");
  const Evaluation evaluation = Evaluate(survey.View());
  const std::size_t poses = survey.View().pose_unknown(0, 0);
  for (std::size_t k = 0; k < evaluation.columns.size(); ++k) {
    const std::size_t unknown = evaluation.columns[k];
    if (unknown >= poses && unknown < poses + 3) Expect(evaluation.values[k] == 0.0, "a derivative by the rotation");
  }
}

// The same block with one unknown moved.
Survey Moved(Survey survey, const ProblemView& view, std::size_t unknown, double h) {
  const std::size_t theta = view.theta_unknown(0), pose = view.pose_unknown(0, 0), point = view.point_unknown(0, 0);
  if (unknown >= point) {
    survey.points[unknown - point] += h;
  } else if (unknown >= pose + 3) {
    survey.centres[unknown - pose - 3] += h;
  } else if (unknown >= pose) {
    double w[3] = {0, 0, 0}, r[3], turned[3];
    w[unknown - pose] = h;
    RotationVectorOf(survey.rotations.data(), r);
    Turn(w, r, turned);
    QuaternionOf(turned, survey.rotations.data());
  } else {
    survey.theta[unknown - theta] += h;
  }
  return survey;
}

void Jacobian(double curvature_in, double scale_in) {
  Survey survey;
  survey.theta[kCurvatureIn] = curvature_in;
  survey.theta[kScaleIn] = scale_in;
  survey.rotations = {0.1, 0.7, -0.5, 0.5};  // 0.01 + 0.49 + 0.25 + 0.25 = 1
  const ProblemView view = survey.View();
  const Evaluation evaluation = Evaluate(view);
  std::vector<std::vector<double>> rows(6, std::vector<double>(view.unknowns(), 0.0));
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t k = evaluation.row_start[row]; k < evaluation.row_start[row + 1]; ++k) {
      rows[row][evaluation.columns[k]] = evaluation.values[k];
    }
  }
  // The residuals are of second order in each unknown but the rotation: central differences are exact but for rounding,
  // and those by the rotation good to h^2.
  const double h = 1e-4, tolerance = 1e-5;
  for (std::size_t unknown = view.theta_unknown(0); unknown < view.unknowns(); ++unknown) {
    const std::size_t t = unknown - view.theta_unknown(0);
    if (t < survey.theta.size() && !survey.theta_free[t]) continue;
    const std::vector<double> above = Evaluate(Moved(survey, view, unknown, h).View()).residuals;
    const std::vector<double> below = Evaluate(Moved(survey, view, unknown, -h).View()).residuals;
    for (std::size_t row = 0; row < 6; ++row) {
      const double slope = (above[row] - below[row]) / (2 * h);
      ExpectNear(rows[row][unknown], slope, tolerance,
                 "residual " + std::to_string(row) + " by unknown " + std::to_string(unknown));
    }
  }
}

void WrongScope() {
  Survey survey;
  survey.slot_scope[kQ] = static_cast<uint32_t>(Scope::kImage);
  try {
    Evaluate(survey.View());
    Expect(false, "a frame effect per image is refused");
  } catch (const std::invalid_argument& error) {
    const std::string expected =
        "array `slot_scope`: entry 0: effect earth-curvature acts on surveyed points and must be global";
    Expect(error.what() == expected, error.what());
  }
}

}  // namespace

int main() {
  Order();
  Unturned();
  for (const double curvature : {kInBoth, kInControl, kInGnss}) {
    for (const double scale : {kInBoth, kInControl, kInGnss}) Jacobian(curvature, scale);
  }
  WrongScope();
  return Finish();
}
