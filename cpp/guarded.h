// A call of an effect that no exception leaves, and no number that is none: a plug-in may throw where it should not,
// and what it throws must reach neither Ceres' threads nor Rust.
#ifndef MISCLOSURE_GUARDED_H_
#define MISCLOSURE_GUARDED_H_

#include "effect.h"

// The effect's eval, MISCLOSURE_THREW or MISCLOSURE_NOT_FINITE.
extern "C" int misclosure_guarded_eval(const misclosure_effect* effect, const misclosure_context* context,
                                       const double* in, const double* theta, double* out, double* d_in,
                                       double* d_theta) noexcept;

#endif  // MISCLOSURE_GUARDED_H_
