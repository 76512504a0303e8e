// The interface without Rust: a point intersected from two images, arrays that are wrong, a point that is not
// determined.
#include <cmath>

#include "effect_test.h"
#include "solve.h"

using namespace misclosure;
using namespace misclosure::test;

namespace {

template <class T>
Span<T> Of(const std::vector<T>& values) {
  return {values.data(), values.size()};
}

// Two nadir images 50 m above the ground and 20 m apart, with everything but the point held.
struct TwoImages {
  std::vector<double> interiors = {5000, 2500, 2000, 2500, 2000, 0, 0, 0, 0, 0, 0, 0};
  std::vector<double> ones = std::vector<double>(12, 1.0);
  std::vector<uint8_t> held = std::vector<uint8_t>(12, 0);
  std::vector<misclosure_context> contexts = std::vector<misclosure_context>(2);
  std::vector<double> rotations = {0, 1, 0, 0, 0, 1, 0, 0};  // half a turn about x
  std::vector<double> centres = {-10, 0, 50, 10, 0, 50};
  std::vector<double> points = {1.0, 2.0, 3.0};
  std::vector<uint64_t> point_start = {0, 2};
  std::vector<uint32_t> images = {0, 1};
  // The point (2, 5, 0): x = 2500 + 5000 (2 -+ 10) / 50, y = 2000 - 5000 * 5 / 50.
  std::vector<double> xy = {3700, 1500, 1700, 1500};
  std::vector<double> weights = {2, 2};
  std::vector<uint32_t> slot_start = {0};

  TwoImages() {
    for (uint32_t i = 0; i < 2; ++i) {
      contexts[i] = {};
      contexts[i].image = i;
      contexts[i].image_count = 2;
      contexts[i].flight_count = contexts[i].camera_count = 1;
    }
  }

  ProblemView View() const {
    ProblemView view;
    view.interiors = Of(interiors);
    view.camera_scales = view.camera_domains = Of(ones);
    view.camera_free = view.pose_free = Of(held);
    view.slot_start = Of(slot_start);
    view.contexts = Of(contexts);
    view.rotations = Of(rotations);
    view.centres = Of(centres);
    view.points = Of(points);
    view.point_start = Of(point_start);
    view.observation_image = Of(images);
    view.observation_xy = Of(xy);
    view.observation_weight = Of(weights);
    return view;
  }
};

Solution SolveQuietly(const ProblemView& view) {
  SolveOptions options;
  options.covariance = CovarianceOf::kEverything;
  return Solve(view, options, [](const Iteration&) { return true; });
}

void Intersection() {
  const TwoImages two;
  const Solution solution = SolveQuietly(two.View());
  Expect(solution.outcome == Outcome::kConverged, "converged: " + solution.reason);
  const double expected[3] = {2, 5, 0};
  for (int k = 0; k < 3; ++k) ExpectNear(solution.points[k], expected[k], 1e-9, "coordinate");
  // Both images see y with 0.5 px at 100 px/m: sigma_y^2 = (0.5 / 100)^2 / 2, but y also hangs on the height.
  const double* covariance = solution.covariance.points.data();
  // By hand: rows (100, 0, a), (0, -100, b) px/m per image with a = 100 (x -+ 10) / 50, b = -100 y / 50, weight 2; N is
  // then 4 [[2e4, 0, 100 (a1 + a2)], [0, 2e4, -200 b], [., ., a1^2 + a2^2 + 2 b^2]].
  const double a1 = 100.0 * 12 / 50, a2 = 100.0 * -8 / 50, b = -100.0 * 5 / 50;
  const double nxz = 100 * (a1 + a2), nyz = -200 * b, nzz = a1 * a1 + a2 * a2 + 2 * b * b;
  const double height = 1.0 / (4 * (nzz - nxz * nxz / 2e4 - nyz * nyz / 2e4));
  ExpectNear(covariance[8], height, 1e-9 * height, "variance of the height");
  const double in_y = 1.0 / (4 * 2e4) + height * (nyz / 2e4) * (nyz / 2e4);
  ExpectNear(covariance[4], in_y, 1e-9 * in_y, "variance of y");
}

void ExpectThrows(const TwoImages& two, const std::string& message) {
  try {
    Evaluate(two.View());
    Expect(false, "no exception: " + message);
  } catch (const std::invalid_argument& error) {
    Expect(error.what() == message, std::string(error.what()) + " instead of " + message);
  }
}

void WrongArrays() {
  TwoImages two;
  two.images[1] = 2;
  ExpectThrows(two, "array `observation_image`: entry 1 is 2, expected less than 2");
  two = {};
  two.rotations[1] = 0.5;
  ExpectThrows(two, "array `rotations`: entry 0 is not a unit quaternion");
  two = {};
  two.held.pop_back();
  ExpectThrows(two, "array `camera_free`: has 11 entries, expected 12");
  two = {};
  two.points.push_back(1.0);
  ExpectThrows(two, "array `points`: has 4 entries, expected a multiple of 3");
  two = {};
  two.centres[2] = NAN;
  ExpectThrows(two, "array `centres`: entry 2 is not finite");
}

void Undetermined() {
  TwoImages two;
  two.centres[0] = two.centres[3];  // both images at one place: no height
  two.xy[0] = two.xy[2];
  try {
    SolveQuietly(two.View());
    Expect(false, "a point without parallax is singular");
  } catch (const Singular& singular) {
    Expect(singular.directions.size() == 1 && singular.directions[0].unknowns[0] == 12 + 12 + 2, "its height is named");
  }
  two = {};
  two.points[2] = 60.0;  // above the cameras
  try {
    SolveQuietly(two.View());
    Expect(false, "a point behind the camera is refused");
  } catch (const CannotProject& failure) {
    Expect(failure.image == 0 && failure.point == 0, "the place is named");
  }
}

}  // namespace

int main() {
  Intersection();
  WrongArrays();
  Undetermined();
  return Finish();
}
