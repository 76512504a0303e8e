/* Targets that are thicker than the survey knows: the pole stood on the ground, the images see the top of the board.
 *
 * The effect in plain C, for those who have no C++. The table and `eval` are by hand, with the derivatives that C++
 * and Rust take from the formula:
 *
 *   surveyed z = z of the seen point - a        d z / d a = -1        d(out) / d(in) = identity
 *
 *   cc -std=c11 -O2 -fPIC -shared -fvisibility=hidden -I INCLUDE target-thickness.c -o target-thickness.so
 *   misclosure effects check target-thickness.so
 *   misclosure improve BLOCK -o RUN --plugin target-thickness.so
 *
 * INCLUDE is the folder of effect.h. */
#include "effect.h"

#include <stddef.h>

/* Fields that are not named are zero: given, searched and random parameters need more of them. */
static const misclosure_parameter parameters[] = {{
    .name = "a",
    .unit = "m",
    .scope = 0, /* one value in all */
    .role = 0,  /* estimated */
    .nominal = 0.0,
    .typical = 0.01,
    .plausible_min = 0.0,
    .plausible_max = 0.1,
    .plausible_source = "boards and cushions of targets are at most 0.1 m thick",
}};

static const uint32_t needs[] = {5}; /* control points in the datum */

/* The control stage takes a point (3) to its surveyed coordinates (3). */
static int eval(void* self, const misclosure_context* context, const double* in, const double* theta, double* out,
                double* d_in, double* d_theta) {
  (void)self, (void)context;
  for (int i = 0; i < 3; ++i) {
    out[i] = in[i];
    for (int k = 0; d_in != NULL && k < 3; ++k) d_in[3 * i + k] = i == k;
    if (d_theta != NULL) d_theta[i] = i == 2 ? -1.0 : 0.0;
  }
  out[2] -= theta[0];
  return MISCLOSURE_DONE;
}

static const misclosure_effect table = {
    .abi_version = MISCLOSURE_ABI_VERSION,
    .effect_size = sizeof(misclosure_effect),
    .parameter_size = sizeof(misclosure_parameter),
    .name_size = sizeof(misclosure_name),
    .context_size = sizeof(misclosure_context),
    .stage = 5, /* control */
    .kind = 0,  /* names a cause */
    .parameter_count = 1,
    .need_count = 1,
    .id = "target-thickness",
    .summary = "The survey measured the ground below the targets, and the images see their tops.",
    .formula = "z -= a",
    .confused_with = "gnss-shift, where GNSS is in the datum too: a vertical shift between the two.",
    .source = "practice: targets on boards",
    .parameters = parameters,
    .needs = needs,
    .eval = eval,
    .picture = 0, /* that of the stage */
    .what = "The surveyor put the pole beside the target, and the images see the top of the target. Surveyed heights "
            "are then lower than those in the images, by the thickness of the target.",
    .remedy = "Measure the thickness of a target and correct the heights, or model it.",
    .tell = "a target that was surveyed on its top and beside it",
};

__attribute__((visibility("default"))) const misclosure_effect* misclosure_plugin(void) { return &table; }
