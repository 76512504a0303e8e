// Effects on exposure, ray, positions and frame against numbers worked by hand, and against another way to the same
// physics: a traced ray.
#include "effects/earth-curvature.h"
#include "effects/flat-port.h"
#include "effects/forward-motion.h"
#include "effects/gnss-delay.h"
#include "effects/gnss-drift.h"
#include "effects/gnss-shift.h"
#include "effects/map-scale.h"
#include "effects/refraction.h"
#include "effects/rolling-shutter.h"
#include "effects_values.h"

using namespace misclosure;
using namespace misclosure::test;

namespace {

void Motion() {
  Context c = Camera();
  c.velocity[0] = 5, c.velocity[1] = -2, c.velocity[2] = 1;
  ExpectOut<ForwardMotion>(c, {0.1, 0.2, 0.3, 10, 20, 30}, {0.004}, {0.1, 0.2, 0.3, 10.01, 19.996, 30.002});

  // The last row is half of t late, the first half of t early.
  c.row_px = 3000;
  ExpectOut<RollingShutter>(c, {0.1, 0.2, 0.3, 10, 20, 30}, {0.04, 0, 0, 0}, {0.1, 0.2, 0.3, 10.1, 19.96, 30.02});
  // A derived velocity is off by (0.5, -0.5, 1).
  ExpectOut<RollingShutter>(c, {0.1, 0.2, 0.3, 10, 20, 30}, {0.04, 0.5, -0.5, 1}, {0.1, 0.2, 0.3, 10.11, 19.95, 30.04});
  c.row_px = 0;
  ExpectOut<RollingShutter>(c, {0.1, 0.2, 0.3, 10, 20, 30}, {0.04, 0, 0, 0}, {0.1, 0.2, 0.3, 9.9, 20.04, 29.98});
  // A camera that turns by 0.5 rad/s about its axis, x to y, for 0.02 s: what stands still turns back by 0.01 rad.
  c.row_px = 3000;
  c.angular_velocity[2] = 0.5;
  ExpectOut<RollingShutter>(c, {0, 0, 0, 0, 0, 0}, {0.04, 0, 0, 0}, {0, 0, -0.01});

  // Turning about all axes, from several rotations, straight down among them: R' = -[omega]x R by the midpoint rule in
  // 2000 steps, whose error is below (omega dt / 2000)^2.
  c.angular_velocity[0] = 0.4, c.angular_velocity[1] = -0.3, c.angular_velocity[2] = 0.8;
  const double* w = c.angular_velocity;
  for (const Values& r :
       {Values{0, 0, 0}, Values{0.3, -0.2, 0.5}, Values{kPi, 0, 0}, Values{2.2, -2.2, 0.3}, Values{0, 0, -3.1}}) {
    const Values in = {r[0], r[1], r[2], 0, 0, 0};
    for (const double t : {-0.4, 1e-7, 0.4}) {
      const Result result = At<RollingShutter>(c, in, {t, 0, 0, 0});
      Expect(result.ok, "rolling-shutter: outside the domain");
      for (int axis = 0; axis < 3; ++axis) {
        const double world[3] = {axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
        double p[3], turned[3];
        Rotate(r.data(), world, p);
        const double h = 0.5 * t / 2000.0;
        const auto rate = [&](const double* q, int k) {
          return -(w[(k + 1) % 3] * q[(k + 2) % 3] - w[(k + 2) % 3] * q[(k + 1) % 3]);
        };
        for (int step = 0; step < 2000; ++step) {
          double middle[3], next[3];
          for (int k = 0; k < 3; ++k) middle[k] = p[k] + 0.5 * h * rate(p, k);
          for (int k = 0; k < 3; ++k) next[k] = p[k] + h * rate(middle, k);
          for (int k = 0; k < 3; ++k) p[k] = next[k];
        }
        Rotate(result.out.data(), world, turned);
        for (int k = 0; k < 3; ++k) ExpectNear(turned[k], p[k], 1e-8, "rolling-shutter: turned direction");
      }
    }
  }
}

void Rays() {
  Context c = Camera();
  // H = 100, |d| = 50: kappa H (1 + tan^2 z) = 1e-6 * 125.
  ExpectOut<Refraction>(c, {0, 0, 0, 10, 20, 130, 40, 60, 30}, {1e-6}, {40 + 30 * 125e-6, 60 + 40 * 125e-6, 30});
  ExpectOutside<Refraction>(c, {0, 0, 0, 10, 20, 30, 40, 60, 31}, {1e-6}, "a point above the camera");
}

// Of the ray from the lens at the angle a, the distance from the axis at the depth z, behind a plate of thickness d and
// index n.
double Traced(double a, double z, double d, double n) {
  const double b = std::asin(std::sin(a) / n);
  return (z - d) * std::tan(a) + d * std::tan(b);
}

void Port() {
  const Context c = Camera();
  const double n = 1.33;
  // By hand, a = 45 degrees, n^2 = 1.7689: cos a / (n cos b) = sqrt(0.5 / 1.2689) = 0.627726. D = 0.1 m moves the point
  // by 0.1 * 0.372274 / 2 = 0.0186137 m away from the axis, and by the same length towards the camera.
  const Values shifted = At<FlatPort>(c, {0, 0, 0, 0, 0, 0, 2, 0, 2}, {0.1, n}).out;
  ExpectNear(shifted[0], 2.0186137, 5e-7, "flat-port: across the axis");
  ExpectNear(shifted[1], 0.0, kRounding, "flat-port: in the plane of ray and axis");
  ExpectNear(shifted[2], 1.9813863, 5e-7, "flat-port: along the axis");

  // Against a traced ray: the lens sees the point at the angle a of the ray that reaches it, which bisection finds.
  const double r[3] = {0.4, -2.3, 1.1}, centre[3] = {3, -4, 5};
  for (const double z : {0.5, 2.0}) {
    for (const double slope : {0.05, 0.3, 0.8}) {
      double error[2], effect = 0.0;
      for (int k = 0; k < 2; ++k) {
        const double d = k == 0 ? 0.02 : 0.002;
        const double rho = slope * z;
        double low = 0.0, high = 1.5;
        for (int half = 0; half < 100; ++half) {
          const double middle = 0.5 * (low + high);
          (Traced(middle, z, d, n) < rho ? low : high) = middle;
        }
        // The same point for a camera that stands and looks anywhere, 0.6 : 0.8 beside the axis.
        const double camera[3] = {0.6 * rho, 0.8 * rho, z};
        double world[3], back[3];
        RotateBack(r, camera, world);
        Values in(r, r + 3);
        for (int i = 0; i < 3; ++i) in.push_back(centre[i]);
        for (int i = 0; i < 3; ++i) in.push_back(centre[i] + world[i]);
        const Values out = At<FlatPort>(c, in, {d, n}).out;
        for (int i = 0; i < 3; ++i) world[i] = out[i] - centre[i];
        Rotate(r, world, back);
        ExpectNear(back[0] * 0.8, back[1] * 0.6, 1e-14, "flat-port: in the plane of ray and axis");
        error[k] = std::abs(std::hypot(back[0], back[1]) / back[2] - std::tan(low));
        if (k == 0) effect = std::abs(std::tan(low) - slope);
      }
      // The formula leaves what is of second order in D / z: some hundredths of the effect, a hundredth of that for a
      // tenth of D.
      Expect(error[0] < 0.03 * effect,
             "flat-port: against a traced ray: " + std::to_string(error[0] / effect) + " of the effect");
      Expect(error[1] < 0.015 * error[0] && error[1] > 0.005 * error[0], "flat-port: the rest is not of second order");
    }
  }
  // On the axis nothing is shifted, and the derivative is finite.
  const Result axis = Evaluate(EffectOf<FlatPort>(), Place{c, {}, {0, 0, 0, 0, 0, 0, 0, 0, 2}, {0.1, n}}, true);
  Expect(axis.ok && axis.out == Values{0, 0, 2}, "flat-port: on the axis");
  // There P moves by D (1 - 1/n) of its angle: d x' / d x = 1 + 0.1 / 2 (1 - 1/1.33).
  ExpectNear(axis.d_in[6], 1.0 + 0.05 * (1.0 - 1.0 / n), kRounding, "flat-port: derivative on the axis");
  ExpectOutside<FlatPort>(c, {0, 0, 0, 0, 0, 0, 1, 0, -1}, {0.1, n}, "behind the camera");
  ExpectOutside<FlatPort>(c, {0, 0, 0, 0, 0, 0, 2, 0, 1}, {0.1, 0.75}, "a window less dense than its medium");
}

void Positions() {
  Context c = Camera();
  c.velocity[0] = 5, c.velocity[1] = -2, c.velocity[2] = 1;
  c.flight_time_s = 200;
  const Values in = {0.1, 0.2, 0.3, 10, 20, 30};
  ExpectOut<GnssDelay>(c, in, {0.02}, {10.1, 19.96, 30.02});
  ExpectOut<GnssShift>(c, in, {1, 2, -3}, {11, 22, 27});
  ExpectOut<GnssDrift>(c, in, {1, 2, -3, 1e-3, -2e-3, 5e-3}, {11.2, 21.6, 28});
}

// A point of the sphere's tangent system as a map shows it, without approximation: the length of the arc and the
// height.
Values OnSphere(double x, double y, double h, double radius) {
  const double distance = std::hypot(x, y);
  const double arc = radius * std::atan2(distance, radius + h);
  return {x * arc / distance, y * arc / distance, std::hypot(distance, radius + h) - radius};
}

void Frame() {
  Context c = Camera();
  c.survey_mean[0] = 100, c.survey_mean[1] = 200, c.survey_mean[2] = 50;
  c.surveyed_kind = 0;
  ExpectNames<EarthCurvature>({"q", "in"});
  ExpectNames<MapScale>({"m", "in"});
  // q = 0.6371 bends as an earth of 1e7 m does. 600 m east, 800 m north, 500 m above the centre: -600 500 / 1e7 =
  // -0.03, -800 500 / 1e7 = -0.04, (360000 + 640000) / 2e7 = 0.05.
  const Values point = {700, 1000, 550}, bent = {699.97, 999.96, 550.05};
  ExpectOut<EarthCurvature>(c, point, {0.6371, 0}, bent);
  // 300 m west, 400 m south, 20 m below the centre, twice the earth: 2 * -(-300 * -20) / 6371000 = -12000 / 6371000,
  // 2 * -(-400 * -20) / 6371000 = -16000 / 6371000, 2 * 250000 / 12742000 = 250000 / 6371000.
  ExpectOut<EarthCurvature>(c, {-200, -200, 30}, {2, 0},
                            {-200 - 12000 / 6371000.0, -200 - 16000 / 6371000.0, 30 + 250000 / 6371000.0});
  // 1000 m east and 2000 m north, at any height: 0.4 and 0.8 m.
  const Values far = {1100, 2200, 5}, stretched = {1100.4, 2200.8, 5};
  ExpectOut<MapScale>(c, far, {4e-4, 0}, stretched);

  // in = control (1) and gnss (2), for a control point and for an antenna.
  for (const double kind : {0.0, 1.0}) {
    c.surveyed_kind = kind;
    for (const double in : {0.0, 1.0, 2.0}) {
      const bool acts = in == 0.0 || in == kind + 1.0;
      ExpectOut<EarthCurvature>(c, point, {0.6371, in}, acts ? bent : point);
      ExpectOut<MapScale>(c, far, {4e-4, in}, acts ? stretched : far);
    }
    ExpectOutside<EarthCurvature>(c, point, {1, 3}, "for a choice that there is not");
    ExpectOutside<MapScale>(c, point, {1, 0.5}, "for a choice that there is not");
  }
  // A coordinate of unknown kind is bent where all are, else refused.
  c.surveyed_kind = kUnknown;
  ExpectOut<EarthCurvature>(c, point, {0.6371, 0}, bent);
  ExpectOutside<EarthCurvature>(c, point, {1, 1}, "a coordinate of unknown kind");
  ExpectOutside<MapScale>(c, point, {1, 2}, "a coordinate of unknown kind");
  for (const misclosure_effect* effect : {&EffectOf<EarthCurvature>(), &EffectOf<MapScale>()}) {
    const Parameter& in = effect->parameters[1];
    const char* names[] = {"both", "control", "gnss"};
    Expect(in.role == static_cast<uint32_t>(Role::kGiven) && in.nominal == 0.0 && in.name_count == 3,
           "`in` and its default");
    for (uint32_t k = 0; k < in.name_count; ++k) {
      Expect(std::string(in.names[k].name) == names[k] && in.names[k].value == k, std::string("in=") + names[k]);
    }
  }

  // Without a survey there is no centre: no answer.
  for (double& mean : c.survey_mean) mean = kUnknown;
  ExpectOutside<EarthCurvature>(c, point, {1, 0}, "without a survey");
  ExpectOutside<MapScale>(c, point, {1, 0}, "without a survey");
}

// q = 1 is the earth: what the formula leaves of an exact sphere is of third order in distance and height.
void Sphere() {
  Context c = Camera();
  c.survey_mean[0] = 5000, c.survey_mean[1] = -3000, c.survey_mean[2] = 200;
  const double x = 6000, y = -8000, h = 3000;
  double error[2];
  for (int k = 0; k < 2; ++k) {
    const double s = k == 0 ? 1.0 : 0.5;
    const Values exact = OnSphere(s * x, s * y, s * h, 6371000.0);
    const Values in = {5000 + s * x, -3000 + s * y, 200 + s * h};
    const Values out = At<EarthCurvature>(c, in, {1, 0}).out;
    error[k] = 0.0;
    for (int i = 0; i < 3; ++i) error[k] = std::max(error[k], std::abs(out[i] - c.survey_mean[i] - exact[i]));
  }
  // At 10 km and 3 km above, of 4.7 m aside and 7.8 m upwards some millimetres are left, an eighth at half the way.
  Expect(error[0] < 0.01, "earth-curvature: against a sphere: " + std::to_string(error[0]) + " m");
  ExpectNear(error[1], error[0] / 8, 1e-3 * error[0], "earth-curvature: the rest is not of third order");
}

}  // namespace

int main() {
  Motion();
  Rays();
  Port();
  Positions();
  Frame();
  Sphere();
  return Finish();
}
