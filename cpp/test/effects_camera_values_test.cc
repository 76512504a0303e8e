// Effects on the camera and the image against numbers worked by hand, and against a numerical integration of their
// physics.
#include "effects/decentring-high.h"
#include "effects/focal-flight.h"
#include "effects/focal-image.h"
#include "effects/focal-spline.h"
#include "effects/focal-temperature.h"
#include "effects/gravity-sag.h"
#include "effects/image-fourier.h"
#include "effects/image-grid.h"
#include "effects/pp-flight.h"
#include "effects/pp-image.h"
#include "effects/pp-time.h"
#include "effects/radial-high.h"
#include "effects/unflatness.h"
#include "effects_values.h"

using namespace misclosure;
using namespace misclosure::test;

namespace {

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
  ExpectNear(At<FocalTemperature>(c, in, {1, 50}, ramp).out[0], 5000 + 5 - 3.16060279414279, 1e-11,
             "lag within a piece");
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
  ExpectNear(At<FocalTemperature>(c, in, {1, lag}, course).out[0], 5000 + lens - 20.0, 1e-5,
             "lag against Euler's method");
  // A vanishing lag is none, and the derivative by the lag is a times minus the slope, 2 K in 70 s.
  ExpectNear(At<FocalTemperature>(c, in, {1, 1e-200}, course).out[0], 5000 + c.temperature_c - 20.0, 1e-11,
             "vanishing lag");
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

  // At (3750, 750) the arguments are 1/2 and -1/2 and the slopes 5/16 and -3/16. P_1 to P_4 of 1/2: 1/2, -1/8, -7/16,
  // -37/128.
  ExpectNames<Unflatness>(
      {"c_02", "c_03", "c_04", "c_11", "c_12", "c_13", "c_20", "c_21", "c_22", "c_30", "c_31", "c_40"});
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
      for (int j = 0; j < 6; ++j)
        names.push_back(std::string(component) + "_" + std::to_string(i) + "_" + std::to_string(j));
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
          names[component == 'y'].push_back(std::string(sine ? "b" : "a") + component + "_" + std::to_string(m) + "_" +
                                            std::to_string(n));
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

}  // namespace

int main() {
  InteriorEffects();
  FocalSplineCourse();
  Temperature();
  ImageEffects();
  Grid();
  Fourier();
  return Finish();
}
