#include "guarded.h"

#include <cmath>
#include <cstdint>
#include <limits>

namespace {

// Without a branch inside, so that it runs in vector registers.
bool AllFinite(const double* values, std::uint32_t count) {
  int bad = 0;
  for (std::uint32_t k = 0; k < count; ++k) bad += !(std::abs(values[k]) <= std::numeric_limits<double>::max());
  return bad == 0;
}

}  // namespace

int misclosure_guarded_eval(const misclosure_effect* effect, const misclosure_context* context, const double* in,
                            const double* theta, double* out, double* d_in, double* d_theta) noexcept {
  try {
    const int answer = effect->eval(effect->self, context, in, theta, out, d_in, d_theta);
    if (answer != MISCLOSURE_DONE) return answer;
  } catch (...) {
    return MISCLOSURE_THREW;
  }
  const auto stage = static_cast<misclosure::Stage>(effect->stage);
  const std::uint32_t m = misclosure::Outputs(stage), n = misclosure::Inputs(stage);
  const bool finite = AllFinite(out, m) && (d_in == nullptr || AllFinite(d_in, m * n)) &&
                      (d_theta == nullptr || AllFinite(d_theta, m * effect->parameter_count));
  return finite ? MISCLOSURE_DONE : MISCLOSURE_NOT_FINITE;
}
