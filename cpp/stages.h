// Stages of the measurement chain with their derivatives. Jets stay within one stage each, and there are as wide as one
// of its arguments: two narrow Jets through a stage cost less than one wide one.

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

// v = R p and its derivatives by q and by p.
inline void Rotated(const double* q, const double* p, double v[3], RowMajor<3, 4>* v_q, RowMajor<3, 3>* v_p) {
  using JetOfQ = ceres::Jet<double, 4>;
  using JetOfP = ceres::Jet<double, 3>;
  JetOfQ jet_q[4], by_q[3];
  JetOfP jet_p[3], by_p[3];
  for (int k = 0; k < 4; ++k) jet_q[k] = JetOfQ(q[k], k);
  for (int k = 0; k < 3; ++k) jet_p[k] = JetOfP(p[k], k);
  RotateByQuaternion(jet_q, p, by_q);
  RotateByQuaternion(q, jet_p, by_p);
  for (int k = 0; k < 3; ++k) {
    v[k] = by_q[k].a;
    v_q->row(k) = by_q[k].v.transpose();
    v_p->row(k) = by_p[k].v.transpose();
  }
}

// Fraser projection and its derivatives by the interior orientation and by v: the perspective, then the distortion.
inline bool Projected(const double* interior, const double* v, double xy[2], RowMajor<2, 12>* by_interior,
                      RowMajor<2, 3>* by_v) {
  using Front = ceres::Jet<double, 4>;  // f, v
  const Front f(interior[kF], 0);
  const Front front_v[3] = {Front(v[0], 1), Front(v[1], 2), Front(v[2], 3)};
  Front ideal[2];
  if (!Perspective(f, front_v, ideal)) return false;

  using JetOfD = ceres::Jet<double, 2>;
  using JetOfC = ceres::Jet<double, kCoefficients>;
  JetOfD jet_d[2], by_d[2];
  JetOfC jet_c[kCoefficients], by_c[2];
  double d[2];
  for (int k = 0; k < 2; ++k) {
    d[k] = ideal[k].a + interior[kPpx + k] - interior[kDcx + k];
    jet_d[k] = JetOfD(d[k], k);
  }
  for (int k = 0; k < kCoefficients; ++k) jet_c[k] = JetOfC(interior[kK1 + k], k);
  Distortion(jet_d, interior + kK1, by_d);
  Distortion(d, jet_c, by_c);

  RowMajor<2, 2> shift_d;
  for (int i = 0; i < 2; ++i) {
    xy[i] = interior[kPpx + i] + ideal[i].a + by_d[i].a;
    shift_d.row(i) = by_d[i].v.transpose();
    by_interior->row(i).tail<kCoefficients>() = by_c[i].v.transpose();
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
