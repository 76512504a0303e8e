// Uniform cubic B-splines, for effects that are shapes.
#ifndef MISCLOSURE_BSPLINE_H_
#define MISCLOSURE_BSPLINE_H_

namespace misclosure {

// Weights of the four coefficients that count at s, and the position of the first of them. Piece i is i <= s < i + 1
// and has the coefficients i to i + 3: there are three more than pieces. Left and right of all, the outermost
// polynomials go on.
template <class T>
int CubicBSpline(const T& s, int pieces, T weight[4]) {
  int piece = 0;
  while (piece + 1 < pieces && s >= piece + 1.0) ++piece;
  const T t = s - double(piece);
  const T u = T(1.0) - t;
  weight[0] = u * u * u / 6.0;
  weight[1] = (T(4.0) + 3.0 * t * t * (t - 2.0)) / 6.0;
  weight[2] = (T(4.0) + 3.0 * u * u * (u - 2.0)) / 6.0;
  weight[3] = t * t * t / 6.0;
  return piece;
}

}  // namespace misclosure

#endif  // MISCLOSURE_BSPLINE_H_
