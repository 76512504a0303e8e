// The Fraser camera in pixels, forward formula for any number type; derivatives come from Jets. The formula is the one
// of the block format: distortion acts on the ideal image point, from object to image, about its own centre (dcx, dcy).

#ifndef MISCLOSURE_FRASER_H_
#define MISCLOSURE_FRASER_H_

namespace misclosure {

// Positions in the interior orientation.
enum : int { kF = 0, kPpx = 1, kPpy = 2, kDcx = 3, kDcy = 4, kK1 = 5, kInteriorSize = 12 };
constexpr int kCoefficients = 7;  // k1, k2, k3, p1, p2, b1, b2, from kK1 on

// Ideal image point from the principal point, px, of a point v in the camera frame; false unless the point is in front.
template <class T>
bool Perspective(const T& f, const T v[3], T ideal[2]) {
  if (!(v[2] > 0.0)) return false;
  ideal[0] = f * v[0] / v[2];
  ideal[1] = f * v[1] / v[2];
  return true;
}

// Distortion, px, at d from the centre of distortion, with k1, k2, k3, p1, p2, b1, b2. Either can be plain numbers
// while the other has derivatives.
template <class D, class C, class T>
void Distortion(const D d[2], const C c[kCoefficients], T out[2]) {
  const D xx = d[0] * d[0];
  const D yy = d[1] * d[1];
  const D xy = d[0] * d[1];
  const D r2 = xx + yy;
  const T radial = r2 * (c[0] + r2 * (c[1] + r2 * c[2]));
  out[0] = d[0] * radial + c[3] * (r2 + 2.0 * xx) + 2.0 * c[4] * xy + c[5] * d[0] + c[6] * d[1];
  out[1] = d[1] * radial + c[4] * (r2 + 2.0 * yy) + 2.0 * c[3] * xy;
}

// Image point, px, of a point v in the camera frame; false unless the point is in front.
template <class T>
bool Project(const T interior[kInteriorSize], const T v[3], T xy[2]) {
  T ideal[2];
  if (!Perspective(interior[kF], v, ideal)) return false;
  T d[2], shift[2];
  for (int k = 0; k < 2; ++k) d[k] = ideal[k] + interior[kPpx + k] - interior[kDcx + k];
  Distortion(d, interior + kK1, shift);
  for (int k = 0; k < 2; ++k) xy[k] = interior[kPpx + k] + ideal[k] + shift[k];
  return true;
}

// v = R p for the unit quaternion (w, x, y, z) of R. Either can be plain numbers while the other has derivatives.
template <class Q, class P, class V>
void RotateByQuaternion(const Q q[4], const P p[3], V v[3]) {
  const V t[3] = {2.0 * (q[2] * p[2] - q[3] * p[1]), 2.0 * (q[3] * p[0] - q[1] * p[2]),
                  2.0 * (q[1] * p[1] - q[2] * p[0])};
  v[0] = p[0] + q[0] * t[0] + (q[2] * t[2] - q[3] * t[1]);
  v[1] = p[1] + q[0] * t[1] + (q[3] * t[0] - q[1] * t[2]);
  v[2] = p[2] + q[0] * t[2] + (q[1] * t[1] - q[2] * t[0]);
}

}  // namespace misclosure

#endif  // MISCLOSURE_FRASER_H_
