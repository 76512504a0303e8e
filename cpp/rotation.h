// Rotation vectors and quaternions (w, x, y, z), for any number type.

#ifndef MISCLOSURE_ROTATION_H_
#define MISCLOSURE_ROTATION_H_

#include <cmath>

namespace misclosure {

// v = R p with R = exp([r]x) (Rodrigues); a series near r = 0, where the angle has no derivative.
template <class T>
void Rotate(const T r[3], const T p[3], T v[3]) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
  T a, b;  // sin(angle) / angle, (1 - cos(angle)) / angle^2
  if (angle2 > 1e-8) {
    const T angle = sqrt(angle2);
    a = sin(angle) / angle;
    b = (T(1.0) - cos(angle)) / angle2;
  } else {
    a = T(1.0) - angle2 / 6.0;
    b = T(0.5) - angle2 / 24.0;
  }
  const T c[3] = {r[1] * p[2] - r[2] * p[1], r[2] * p[0] - r[0] * p[2], r[0] * p[1] - r[1] * p[0]};
  const T d[3] = {r[1] * c[2] - r[2] * c[1], r[2] * c[0] - r[0] * c[2], r[0] * c[1] - r[1] * c[0]};
  for (int k = 0; k < 3; ++k) v[k] = p[k] + a * c[k] + b * d[k];
}

// v = R^T p: camera to world.
template <class T>
void RotateBack(const T r[3], const T p[3], T v[3]) {
  const T back[3] = {-r[0], -r[1], -r[2]};
  Rotate(back, p, v);
}

// Quaternion (w, x, y, z) of a rotation vector.
template <class T>
void QuaternionOf(const T r[3], T q[4]) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
  T k;  // sin(angle / 2) / angle
  if (angle2 > 1e-8) {
    const T angle = sqrt(angle2);
    q[0] = cos(angle * 0.5);
    k = sin(angle * 0.5) / angle;
  } else {
    q[0] = T(1.0) - angle2 / 8.0 + angle2 * angle2 / 384.0;
    k = T(0.5) - angle2 / 48.0;
  }
  for (int i = 0; i < 3; ++i) q[i + 1] = k * r[i];
}

// Rotation vector, length at most pi, of a unit quaternion (w, x, y, z).
template <class T>
void RotationVectorOf(const T q[4], T r[3]) {
  using std::atan2;
  using std::sqrt;
  const T sine2 = q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  T k;  // angle / sin(angle / 2)
  if (sine2 > 1e-8) {
    const T sine = sqrt(sine2);
    k = 2.0 * (q[0] < 0.0 ? atan2(-sine, -q[0]) : atan2(sine, q[0])) / sine;
  } else {
    const T ratio2 = sine2 / (q[0] * q[0]);
    k = (T(2.0) - ratio2 * (2.0 / 3.0)) / q[0];
  }
  for (int i = 0; i < 3; ++i) r[i] = k * q[i + 1];
}

// Rotation vector of exp([a]x) exp([r]x): r turned by a in the camera's axes. Where a is zero this is r itself, to the
// last bit, as the null law wants it; the derivative there is the limit (inverse left Jacobian of r).
template <class T>
void Turn(const T a[3], const T r[3], T out[3]) {
  if (a[0] == 0.0 && a[1] == 0.0 && a[2] == 0.0) {
    using std::sqrt;
    using std::tan;
    const T angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    T k;
    if (angle2 > 1e-8) {
      const T angle = sqrt(angle2);
      k = T(1.0) / angle2 - T(0.5) / (angle * tan(angle * 0.5));
    } else {
      k = T(1.0 / 12.0) + angle2 / 720.0;
    }
    const T c[3] = {r[1] * a[2] - r[2] * a[1], r[2] * a[0] - r[0] * a[2], r[0] * a[1] - r[1] * a[0]};
    const T d[3] = {r[1] * c[2] - r[2] * c[1], r[2] * c[0] - r[0] * c[2], r[0] * c[1] - r[1] * c[0]};
    for (int i = 0; i < 3; ++i) out[i] = r[i] + a[i] - 0.5 * c[i] + k * d[i];
    return;
  }
  T p[4], q[4], s[4];
  QuaternionOf(a, p);
  QuaternionOf(r, q);
  s[0] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3];
  s[1] = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2];
  s[2] = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1];
  s[3] = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0];
  RotationVectorOf(s, out);
}

}  // namespace misclosure

#endif  // MISCLOSURE_ROTATION_H_
