#include "guarded.h"

int misclosure_guarded_eval(const misclosure_effect* effect, const misclosure_context* context, const double* in,
                            const double* theta, double* out, double* d_in, double* d_theta) noexcept {
  try {
    return effect->eval(effect->self, context, in, theta, out, d_in, d_theta);
  } catch (...) {
    return MISCLOSURE_THREW;
  }
}
