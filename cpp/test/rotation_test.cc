// Rotations and the projection: the helpers against each other and against numbers worked by hand.
#include <cmath>

#include "effect_test.h"
#include "residuals.h"

using namespace misclosure;
using namespace misclosure::test;

namespace {

constexpr double kExact = 1e-14;

// |r| near zero, ordinary, near pi: where the formulas change branch.
const double kVectors[][3] = {{0, 0, 0},        {1e-7, -2e-7, 1e-7}, {9e-5, 1e-6, 0},    {1.1e-4, 0, 1e-5},
                              {0.3, -0.2, 1.1}, {3.1, 0.1, -0.2},    {kPi - 1e-9, 0, 0}, {0, -2.2, 2.2}};

void RoundTrip() {
  const double p[3] = {1.0, -2.0, 0.5};
  for (const auto& r : kVectors) {
    double q[4], back[3], by_vector[3], by_quaternion[3], again[3];
    QuaternionOf(r, q);
    RotationVectorOf(q, back);
    Rotate(r, p, by_vector);
    RotateByQuaternion(q, p, by_quaternion);
    RotateBack(r, by_vector, again);
    for (int k = 0; k < 3; ++k) {
      // Near half a turn r and -r are the same rotation to 1e-9: compare what they do.
      ExpectNear(by_vector[k], by_quaternion[k], 10 * kExact, "vector and quaternion turn alike");
      ExpectNear(again[k], p[k], 10 * kExact, "there and back");
    }
    double q_back[4];
    QuaternionOf(back, q_back);
    const double sign = q[0] * q_back[0] + q[1] * q_back[1] + q[2] * q_back[2] + q[3] * q_back[3];
    ExpectNear(std::abs(sign), 1.0, kExact, "the same rotation");
  }
}

// Turn(a, r) is first r, then a; at a = 0 it is r to the last bit with the derivative of the general formula.
void Turned() {
  const double p[3] = {1.0, -2.0, 0.5};
  for (const auto& a : kVectors) {
    for (const auto& r : kVectors) {
      double turned[3], once[3], first[3], twice[3];
      Turn(a, r, turned);
      Rotate(turned, p, once);
      Rotate(r, p, first);
      Rotate(a, first, twice);
      for (int k = 0; k < 3; ++k) ExpectNear(once[k], twice[k], 20 * kExact, "first r, then a");
    }
  }
  using Jet = ceres::Jet<double, 6>;
  for (const auto& r : kVectors) {
    const double angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    const double step = 1e-6;
    Jet at_zero[3], a[3], b[3];
    for (int k = 0; k < 3; ++k) {
      a[k] = Jet(0.0, k);
      b[k] = Jet(r[k], 3 + k);
    }
    Turn(a, b, at_zero);
    for (int i = 0; i < 3; ++i) {
      Expect(at_zero[i].a == r[i], "no turn changes nothing");
      if (angle2 > 9.0) continue;  // differences would cross half a turn
      for (int k = 0; k < 3; ++k) {
        double up[3] = {0, 0, 0}, down[3] = {0, 0, 0}, above[3], below[3];
        up[k] = step;
        down[k] = -step;
        Turn(up, r, above);
        Turn(down, r, below);
        ExpectNear(at_zero[i].v[k], (above[i] - below[i]) / (2.0 * step), 1e-8, "derivative of Turn by a");
        ExpectNear(at_zero[i].v[3 + k], i == k ? 1.0 : 0.0, 0.0, "derivative of Turn by r");
      }
    }
  }
}

// The block format's formula by hand: f = 1000, pp = (500, 400), dc = (490, 410); (X, Y, Z) = (1, 2, 10) gives u = 600,
// v = 600, du = 110, dv = 190, r2 = 48200.
void WorkedProjection() {
  const double v[3] = {1.0, 2.0, 10.0};
  double interior[12] = {1000, 500, 400, 490, 410, 0, 0, 0, 0, 0, 0, 0};
  double xy[2];
  const auto expect = [&](int parameter, double value, double x, double y) {
    interior[parameter] = value;
    Expect(Project(interior, v, xy), "in front");
    ExpectNear(xy[0], x, 1e-10, "x with parameter " + std::to_string(parameter));
    ExpectNear(xy[1], y, 1e-10, "y with parameter " + std::to_string(parameter));
    interior[parameter] = 0.0;
  };
  expect(5, 0.0, 600.0, 600.0);
  expect(5, 1e-8, 600.0 + 110 * 48200e-8, 600.0 + 190 * 48200e-8);
  expect(6, 1e-12, 600.0 + 110 * 2323.24e-6, 600.0 + 190 * 2323.24e-6);
  expect(7, 1e-16, 600.0 + 110 * 111.980168e12 * 1e-16, 600.0 + 190 * 111.980168e12 * 1e-16);
  expect(8, 1e-6, 600.0 + (48200 + 2 * 12100) * 1e-6, 600.0 + 2 * 110 * 190 * 1e-6);
  expect(9, 1e-6, 600.0 + 2 * 110 * 190 * 1e-6, 600.0 + (48200 + 2 * 36100) * 1e-6);
  expect(10, 1e-3, 600.11, 600.0);
  expect(11, 1e-3, 600.19, 600.0);
  const double behind[3] = {1.0, 2.0, 0.0};
  Expect(!Project(interior, behind, xy), "Z = 0 is refused");
}

// Two stages of Jets give what one wide Jet over the whole formula gives.
void StagedJets() {
  const double v[3] = {1.3, -2.1, 9.7};
  const double interior[12] = {5500, 2540, 1946, 2530, 1956, -4e-9, 3e-17, -1e-24, 3e-7, -2e-7, 2e-4, -1e-4};
  using Jet = ceres::Jet<double, 15>;
  Jet wide_interior[12], wide_v[3], wide[2];
  for (int k = 0; k < 12; ++k) wide_interior[k] = Jet(interior[k], k);
  for (int k = 0; k < 3; ++k) wide_v[k] = Jet(v[k], 12 + k);
  Expect(Project(wide_interior, wide_v, wide), "in front");
  double xy[2];
  RowMajor<2, 12> by_interior;
  RowMajor<2, 3> by_v;
  Expect(Projected(interior, v, xy, &by_interior, &by_v), "in front");
  for (int i = 0; i < 2; ++i) {
    ExpectNear(xy[i], wide[i].a, 1e-11, "value");
    for (int k = 0; k < 12; ++k) {
      ExpectNear(by_interior(i, k), wide[i].v[k], 1e-13 * std::abs(wide[i].v[k]), "by interior " + std::to_string(k));
    }
    for (int k = 0; k < 3; ++k) ExpectNear(by_v(i, k), wide[i].v[12 + k], 1e-13 * std::abs(wide[i].v[12 + k]), "by v");
  }
}

}  // namespace

int main() {
  RoundTrip();
  Turned();
  WorkedProjection();
  StagedJets();
  return Finish();
}
