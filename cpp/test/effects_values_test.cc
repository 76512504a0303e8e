// Effects against numbers worked by hand, and against another way to the same physics: a traced ray, a numerical integration.
#include "effects/decentring-high.h"
#include "effects/earth-curvature.h"
#include "effects/flat-port.h"
#include "effects/focal-flight.h"
#include "effects/focal-image.h"
#include "effects/focal-spline.h"
#include "effects/focal-temperature.h"
#include "effects/forward-motion.h"
#include "effects/gnss-delay.h"
#include "effects/gnss-drift.h"
#include "effects/gnss-shift.h"
#include "effects/gravity-sag.h"
#include "effects/image-fourier.h"
#include "effects/image-grid.h"
#include "effects/map-scale.h"
#include "effects/pp-flight.h"
#include "effects/pp-image.h"
#include "effects/pp-time.h"
#include "effects/radial-high.h"
#include "effects/refraction.h"
#include "effects/rolling-shutter.h"
#include "effects/unflatness.h"
#include "effect_test.h"

using namespace misclosure;
using namespace misclosure::test;

namespace {

constexpr double kRounding = 1e-12;  // relative to numbers of the size of image coordinates, or metres
constexpr double kNadir[3] = {kPi, 0.0, 0.0};

using Values = std::vector<double>;

// A camera of 5000 x 3000 px.
Context Camera() {
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
void ExpectOut(const Context& context, const Values& in, const Values& theta, const Values& expected, const Values& history = {}) {
  const Result result = At<E>(context, in, theta, history);
  Expect(result.ok, std::string(E::id) + ": outside the domain");
  for (size_t k = 0; k < expected.size(); ++k) {
    ExpectNear(result.out[k], expected[k], kRounding * (1.0 + std::abs(expected[k])), std::string(E::id) + " " + std::to_string(k));
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

Values Interior(double f, double ppx, double ppy, double dcx, double dcy, const double r[3]) {
  return {f, ppx, ppy, dcx, dcy, 0, 0, 0, 0, 0, 0, 0, r[0], r[1], r[2]};
}

// An image point, f = 4000, pp = dc = (2500, 1500).
Values Image(double x, double y) { return {x, y, 4000, 2500, 1500, 2500, 1500, 0, 0, 0, 0, 0, 0, 0}; }

void InteriorEffects() {
  Context c = Camera();
  c.tau = 0.25;
  const Values in = Interior(5000, 2501, 1502, 2503, 1504, kNadir);
  ExpectOut<FocalFlight>(c, in, {-3.5}, {4996.5, 2501, 1502, 2503, 1504});
  ExpectOut<FocalImage>(c, in, {0.75}, {5000.75, 2501, 1502, 2503, 1504});
  ExpectOut<PpTime>(c, in, {4, -2}, {5000, 2502, 1501.5, 2504, 1503.5});
  ExpectOut<PpFlight>(c, in, {4, -2}, {5000, 2505, 1500, 2507, 1502});
  ExpectOut<PpImage>(c, in, {4, -2}, {5000, 2505, 1500, 2507, 1502});

  // Straight down, R = diag(1, -1, -1), gravity is along the axis: g = (0, 0, 1), only the third column of S counts.
  const Values sag = {1, 2, 3, 4, 5, 6};
  ExpectOut<GravitySag>(c, in, sag, {5000, 2504, 1508, 2506, 1510});
  // A level camera, world z against its y: R rows (1,0,0), (0,0,-1), (0,1,0), a quarter turn about x. g = (0, 1, 0).
  const double level[3] = {0.5 * kPi, 0.0, 0.0};
  ExpectOut<GravitySag>(c, Interior(5000, 2501, 1502, 2503, 1504, level), sag, {5000, 2503, 1507, 2505, 1509});
}

// Flight of 90 s: pieces of 30 s. B-splines reproduce constants and, with coefficients j - 1, the position itself.
void FocalSplineCourse() {
  Context c = Camera();
  c.flight_span_s = 90.0;
  const Values in = Interior(5000, 0, 0, 0, 0, kNadir);
  for (const double time : {0.0, 12.0, 30.0, 59.9, 60.0, 77.0, 90.0}) {
    c.flight_time_s = time;
    ExpectOut<FocalSpline>(c, in, {7, 7, 7, 7, 7, 7}, {5007});
    ExpectOut<FocalSpline>(c, in, {-1, 0, 1, 2, 3, 4}, {5000 + time / 30.0});
  }
  c.flight_time_s = 45.0;  // t = 1/2 of the middle piece: weights 1, 23, 23, 1 of 48 for a_1 to a_4
  ExpectOut<FocalSpline>(c, in, {0, 48, 0, 4.8, 0, 0}, {5000 + 1.0 + 2.3});
  c.flight_time_s = 90.1;
  ExpectOutside<FocalSpline>(c, in, {0, 0, 0, 0, 0, 0}, "after the end of the flight");
  c.flight_time_s = c.flight_span_s = 0.0;  // a flight of one image: weights 1, 4, 1 of 6
  ExpectOut<FocalSpline>(c, in, {6, 12, 18, 99, 99, 99}, {5012});
}

void Temperature() {
  Context c = Camera();
  c.mean_temperature_c = 20.0;
  const Values in = Interior(5000, 0, 0, 0, 0, kNadir);
  // Rises by 0.1 K/s for 100 s after standing at 20. With a lag of 50 s the lens is behind by 0.1 * 50 (1 - exp(-2)) =
  // 4.32332358 K at the end.
  const Values ramp = {0, 20, 10, 20, 110, 30};
  c.time_s = 110;
  c.temperature_c = 30;
  ExpectOut<FocalTemperature>(c, in, {0.5, 0.0}, {5005}, ramp);
  ExpectNear(At<FocalTemperature>(c, in, {1, 50}, ramp).out[0], 5000 + 10 - 4.32332358381694, 1e-11, "lag on a ramp");
  c.time_s = 60;  // in the middle of the ramp; 0.1 * 50 (1 - exp(-1)) = 3.16060279 behind 25
  c.temperature_c = 25;
  ExpectNear(At<FocalTemperature>(c, in, {1, 50}, ramp).out[0], 5000 + 5 - 3.16060279414279, 1e-11, "lag within a piece");
  c.time_s = 0;  // in equilibrium
  c.temperature_c = 20;
  ExpectOut<FocalTemperature>(c, in, {1, 50}, {5000}, ramp);

  // An uneven course against Euler's method with 1e-4 s, whose error is about step / lag of the amplitude: 1e-5 K here.
  const Values course = {3, 18, 20, 24, 41, 23, 41.5, 27, 90, 15, 90, 19, 160, 21};
  const double lag = 35.0, step = 1e-4;
  double lens = 18.0;
  c.time_s = 137.0;
  c.temperature_c = 19.0 + 2.0 * 47.0 / 70.0;
  for (int k = 0; k < static_cast<int>((c.time_s - 3.0) / step + 0.5); ++k) {
    const double t = 3.0 + k * step;
    size_t piece = 0;
    while (piece + 2 < course.size() / 2 && course[2 * (piece + 1)] <= t) ++piece;
    const double* from = &course[2 * piece];
    const double temperature = from[1] + (from[3] - from[1]) * (t - from[0]) / (from[2] - from[0]);
    lens += step * (temperature - lens) / lag;
  }
  ExpectNear(At<FocalTemperature>(c, in, {1, lag}, course).out[0], 5000 + lens - 20.0, 1e-5, "lag against Euler's method");
  // A vanishing lag is none, and the derivative by the lag is a times minus the slope, 2 K in 70 s.
  ExpectNear(At<FocalTemperature>(c, in, {1, 1e-200}, course).out[0], 5000 + c.temperature_c - 20.0, 1e-11, "vanishing lag");
  const Result none = Evaluate(EffectOf<FocalTemperature>(), Place{c, course, in, {3, 0}}, true);
  ExpectNear(none.d_theta[1], -3.0 * 2.0 / 70.0, kRounding, "derivative at no lag");
  ExpectOutside<FocalTemperature>(c, in, {1, 50}, "with a lag but no history");
  Expect(!At<FocalTemperature>(c, in, {1, -1}, course).ok, "focal-temperature: answers a negative lag");
  c.time_s = 170;
  Expect(!At<FocalTemperature>(c, in, {1, 50}, course).ok, "focal-temperature: answers after the history's end");
}

void ImageEffects() {
  const Context c = Camera();
  // d = (1000, 0): r^8 = 1e24.
  ExpectOut<RadialHigh>(c, Image(3500, 1500), {1e-27}, {3501, 1500});
  // d = (1000, 500): r^2 = 1.25e6, r^2 + 2 dx^2 = 3.25e6, r^2 + 2 dy^2 = 1.75e6, 2 dx dy = 1e6.
  ExpectOut<DecentringHigh>(c, Image(3500, 2000), {1e-12, 0}, {3500 + 4.0625, 2000 + 1.25});
  ExpectOut<DecentringHigh>(c, Image(3500, 2000), {0, 1e-12}, {3500 + 1.25, 2000 + 2.1875});

  // At (3750, 750) the arguments are 1/2 and -1/2 and the slopes 5/16 and -3/16. P_1 to P_4 of 1/2: 1/2, -1/8, -7/16, -37/128.
  ExpectNames<Unflatness>({"c_02", "c_03", "c_04", "c_11", "c_12", "c_13", "c_20", "c_21", "c_22", "c_30", "c_31", "c_40"});
  const double heights[12] = {-1.0 / 8, 7.0 / 16, -37.0 / 128, -1.0 / 4, -1.0 / 16, 7.0 / 32,
                              -1.0 / 8, 1.0 / 16, 1.0 / 64,    -7.0 / 16, 7.0 / 32, -37.0 / 128};
  for (int k = 0; k < 12; ++k) {
    Values theta(12, 0.0);
    theta[k] = 1.0;
    ExpectOut<Unflatness>(c, Image(3750, 750), theta, {3750 + heights[k] * 5.0 / 16, 750 - heights[k] * 3.0 / 16});
  }
}

void Grid() {
  const Context c = Camera();
  std::vector<std::string> names;
  for (const char* component : {"gx", "gy"}) {
    for (int i = 0; i < 8; ++i) {
      for (int j = 0; j < 6; ++j) names.push_back(std::string(component) + "_" + std::to_string(i) + "_" + std::to_string(j));
    }
  }
  for (const char* given : {"centre_x", "centre_y", "cell"}) names.push_back(given);
  ExpectNames<ImageGrid>(names);
  // Spacing 1000 px both ways. With the coefficients (i - 1) (j - 1) the field over the sensor is x y / 1e6.
  Values theta(99, 0.0);
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 6; ++j) {
      theta[6 * i + j] = (i - 1) * (j - 1);
      theta[48 + 6 * i + j] = 2.0 - (j - 1);
    }
  }
  for (const double x : {0.0, 1.0, 999.0, 1000.0, 2700.0, 4999.0, 5000.0}) {
    for (const double y : {0.0, 1500.0, 2000.0, 3000.0}) {
      ExpectOut<ImageGrid>(c, Image(x, y), theta, {x + x * y / 1e6, y + 2.0 - y / 1000.0});
    }
  }
  // One coefficient: at a knot its neighbours have 4/6 and 1/6. gx_3_2 belongs to the knot x = 2000, y = 1000.
  Values one(99, 0.0);
  one[6 * 3 + 2] = 36.0;
  ExpectOut<ImageGrid>(c, Image(2000, 1000), one, {2016, 1000});
  ExpectOut<ImageGrid>(c, Image(3000, 1000), one, {3004, 1000});
  ExpectOut<ImageGrid>(c, Image(3000, 2000), one, {3001, 2000});
  ExpectOut<ImageGrid>(c, Image(4000, 1000), one, {4000, 1000});
  // Outside, the outermost coefficient's function ends after three spacings, one of them over the sensor.
  Values corner(99, 0.0);
  corner[0] = 36.0;
  ExpectOut<ImageGrid>(c, Image(0, 0), corner, {1, 0});
  ExpectOut<ImageGrid>(c, Image(-1000, -1000), corner, {-1000 + 16, -1000});
  for (const double far : {-3000.0, -4000.0, 1000.0, 5000.0, 1e30}) {
    ExpectOut<ImageGrid>(c, Image(far, -1000), corner, {far, -1000});
  }
  // The same function on a part of the sensor: knots every 100 px, that of gx_3_2 at (950, 950).
  one[96] = one[97] = 1000.0;
  one[98] = 100.0;
  ExpectOut<ImageGrid>(c, Image(950, 950), one, {966, 950});
  ExpectOut<ImageGrid>(c, Image(1050, 1050), one, {1051, 1050});
  ExpectOut<ImageGrid>(c, Image(1150, 1150), one, {1150, 1150});
  one[98] = -1.0;
  ExpectOutside<ImageGrid>(c, Image(950, 950), one, "a cell of negative size");
}

void Fourier() {
  const Context c = Camera();
  // Terms at u = pi/2, v = 0, and at u = 0, v = pi/2: cosine and sine of m, or n, quarter turns.
  const double quarter_cos[5] = {-1, 0, 1, 0, -1}, quarter_sin[5] = {0, -1, 0, 1, 0};  // -2 to 2
  std::vector<std::string> names[2];
  size_t k = 0;
  for (int m = 0; m <= 2; ++m) {
    for (int n = -2; n <= 2; ++n) {
      if (m == 0 && n <= 0) continue;
      for (const bool sine : {false, true}) {
        for (const char component : {'x', 'y'}) {
          names[component == 'y'].push_back(std::string(sine ? "b" : "a") + component + "_" + std::to_string(m) + "_" + std::to_string(n));
        }
        const double* quarter = sine ? quarter_sin : quarter_cos;
        Values x(48, 0.0), y(48, 0.0);
        x[k] = y[24 + k] = 1.0;
        ExpectOut<ImageFourier>(c, Image(5000, 1500), x, {5000 + quarter[m + 2], 1500});
        ExpectOut<ImageFourier>(c, Image(2500, 3000), y, {2500, 3000 + quarter[n + 2]});
        ++k;
      }
    }
  }
  names[0].insert(names[0].end(), names[1].begin(), names[1].end());
  ExpectNames<ImageFourier>(names[0]);
}

void Motion() {
  Context c = Camera();
  c.velocity[0] = 5, c.velocity[1] = -2, c.velocity[2] = 1;
  ExpectOut<ForwardMotion>(c, {0.1, 0.2, 0.3, 10, 20, 30}, {0.004}, {0.1, 0.2, 0.3, 10.01, 19.996, 30.002});

  // The last row is half of t late, the first half of t early.
  c.row_px = 3000;
  ExpectOut<RollingShutter>(c, {0.1, 0.2, 0.3, 10, 20, 30}, {0.04}, {0.1, 0.2, 0.3, 10.1, 19.96, 30.02});
  c.row_px = 0;
  ExpectOut<RollingShutter>(c, {0.1, 0.2, 0.3, 10, 20, 30}, {0.04}, {0.1, 0.2, 0.3, 9.9, 20.04, 29.98});
  // A camera that turns by 0.5 rad/s about its axis, x to y, for 0.02 s: what stands still turns back by 0.01 rad.
  c.row_px = 3000;
  c.angular_velocity[2] = 0.5;
  ExpectOut<RollingShutter>(c, {0, 0, 0, 0, 0, 0}, {0.04}, {0, 0, -0.01});

  // Turning about all axes, from several rotations, straight down among them: R' = -[omega]x R by the midpoint rule in 2000 steps,
  // whose error is below (omega dt / 2000)^2.
  c.angular_velocity[0] = 0.4, c.angular_velocity[1] = -0.3, c.angular_velocity[2] = 0.8;
  const double* w = c.angular_velocity;
  for (const Values& r : {Values{0, 0, 0}, Values{0.3, -0.2, 0.5}, Values{kPi, 0, 0}, Values{2.2, -2.2, 0.3}, Values{0, 0, -3.1}}) {
    const Values in = {r[0], r[1], r[2], 0, 0, 0};
    for (const double t : {-0.4, 1e-7, 0.4}) {
      const Result result = At<RollingShutter>(c, in, {t});
      Expect(result.ok, "rolling-shutter: outside the domain");
      for (int axis = 0; axis < 3; ++axis) {
        const double world[3] = {axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
        double p[3], turned[3];
        Rotate(r.data(), world, p);
        const double h = 0.5 * t / 2000.0;
        const auto rate = [&](const double* q, int k) { return -(w[(k + 1) % 3] * q[(k + 2) % 3] - w[(k + 2) % 3] * q[(k + 1) % 3]); };
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

// Of the ray from the lens at the angle a, the distance from the axis at the depth z, behind a plate of thickness d and index n.
double Traced(double a, double z, double d, double n) {
  const double b = std::asin(std::sin(a) / n);
  return (z - d) * std::tan(a) + d * std::tan(b);
}

void Port() {
  const Context c = Camera();
  const double n = 1.33;
  // By hand, a = 45 degrees, n^2 = 1.7689: cos a / (n cos b) = sqrt(0.5 / 1.2689) = 0.627726. D = 0.1 m moves the point by
  // 0.1 * 0.372274 / 2 = 0.0186137 m away from the axis and as much towards the camera.
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
      // The formula leaves what is of second order in D / z: some hundredths of the effect, a hundredth of that for a tenth of D.
      Expect(error[0] < 0.03 * effect, "flat-port: against a traced ray: " + std::to_string(error[0] / effect) + " of the effect");
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

// A point of the sphere's tangent system as a map shows it, without approximation: the length of the arc and the height.
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
  // q = 0.6371 bends as an earth of 1e7 m does. 600 m east, 800 m north, 500 m above the centre: -600 500 / 1e7 = -0.03,
  // -800 500 / 1e7 = -0.04, (360000 + 640000) / 2e7 = 0.05.
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
    Expect(in.role == static_cast<uint32_t>(Role::kGiven) && in.nominal == 0.0 && in.name_count == 3, "`in` and its default");
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
  InteriorEffects();
  FocalSplineCourse();
  Temperature();
  ImageEffects();
  Grid();
  Fourier();
  Motion();
  Rays();
  Port();
  Positions();
  Frame();
  Sphere();
  return Finish();
}
