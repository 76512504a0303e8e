// Stages of the measurement chain with their derivatives: Jets stay within one stage each.

#ifndef MISCLOSURE_STAGES_H_
#define MISCLOSURE_STAGES_H_

#include <ceres/jet.h>

#include <Eigen/Core>

#include "effect.h"
#include "fraser.h"

namespace misclosure {

template <int M, int N>
using RowMajor = Eigen::Matrix<double, M, N, Eigen::RowMajor>;

// Rotation vector of a unit quaternion and its derivative.
inline void RotationVector(const double* q, bool derive, double r[3], RowMajor<3, 4>* r_q) {
  if (!derive) {
    RotationVectorOf(q, r);
    return;
  }
  using Jet = ceres::Jet<double, 4>;
  Jet jet_q[4], jet_r[3];
  for (int k = 0; k < 4; ++k) jet_q[k] = Jet(q[k], k);
  RotationVectorOf(jet_q, jet_r);
  for (int k = 0; k < 3; ++k) {
    r[k] = jet_r[k].a;
    r_q->row(k) = jet_r[k].v.transpose();
  }
}

// Quaternion of a rotation vector and its derivative.
inline void Quaternion(const double* r, bool derive, double q[4], RowMajor<4, 3>* q_r) {
  if (!derive) {
    QuaternionOf(r, q);
    return;
  }
  using Jet = ceres::Jet<double, 3>;
  Jet jet_r[3], jet_q[4];
  for (int k = 0; k < 3; ++k) jet_r[k] = Jet(r[k], k);
  QuaternionOf(jet_r, jet_q);
  for (int k = 0; k < 4; ++k) {
    q[k] = jet_q[k].a;
    q_r->row(k) = jet_q[k].v.transpose();
  }
}

// v = R p and its derivatives by q (first four columns) and p.
inline void Rotated(const double* q, const double* p, double v[3], RowMajor<3, 7>* v_qp) {
  using Jet = ceres::Jet<double, 7>;
  Jet jet_q[4], jet_p[3], jet_v[3];
  for (int k = 0; k < 4; ++k) jet_q[k] = Jet(q[k], k);
  for (int k = 0; k < 3; ++k) jet_p[k] = Jet(p[k], 4 + k);
  RotateByQuaternion(jet_q, jet_p, jet_v);
  for (int k = 0; k < 3; ++k) {
    v[k] = jet_v[k].a;
    v_qp->row(k) = jet_v[k].v.transpose();
  }
}

// Fraser projection and its derivatives by the interior orientation and by v, as two stages of Jets.
inline bool Projected(const double* interior, const double* v, double xy[2], RowMajor<2, 12>* by_interior,
                      RowMajor<2, 3>* by_v) {
  using Front = ceres::Jet<double, 4>;  // f, v
  const Front f(interior[kF], 0);
  const Front front_v[3] = {Front(v[0], 1), Front(v[1], 2), Front(v[2], 3)};
  Front ideal[2];
  if (!Perspective(f, front_v, ideal)) return false;

  using Back = ceres::Jet<double, 2 + kCoefficients>;  // d, coefficients
  Back d[2], c[kCoefficients], shift[2];
  for (int k = 0; k < 2; ++k) d[k] = Back(ideal[k].a + interior[kPpx + k] - interior[kDcx + k], k);
  for (int k = 0; k < kCoefficients; ++k) c[k] = Back(interior[kK1 + k], 2 + k);
  Distortion(d, c, shift);

  RowMajor<2, 2> shift_d;
  for (int i = 0; i < 2; ++i) {
    xy[i] = interior[kPpx + i] + ideal[i].a + shift[i].a;
    shift_d.row(i) = shift[i].v.head<2>().transpose();
    by_interior->row(i).tail<kCoefficients>() = shift[i].v.tail<kCoefficients>().transpose();
  }
  // The ideal point and the principal point move the image point directly and through the distortion.
  RowMajor<2, 2> direct = shift_d;
  direct(0, 0) += 1.0;
  direct(1, 1) += 1.0;
  RowMajor<2, 4> ideal_fv;
  ideal_fv.row(0) = ideal[0].v.transpose();
  ideal_fv.row(1) = ideal[1].v.transpose();
  const RowMajor<2, 4> by_fv = direct * ideal_fv;
  by_interior->col(kF) = by_fv.col(0);
  by_interior->block<2, 2>(0, kPpx) = direct;
  by_interior->block<2, 2>(0, kDcx) = -shift_d;
  *by_v = by_fv.rightCols<3>();
  return true;
}

}  // namespace misclosure

#endif  // MISCLOSURE_STAGES_H_
