/* A focal length that is longer by theta[0], and what can be wrong with it: each macro is a fault. */
#include <math.h>
#include "effect.h"

#ifndef VERSION
#define VERSION MISCLOSURE_ABI_VERSION
#endif
#ifndef SIZE
#define SIZE sizeof(misclosure_effect)
#endif
#ifndef ID
#define ID "longer"
#endif
#ifndef COUNT
#define COUNT 1
#endif
#ifndef LENGTH /* of the focal length, in f and a */
#define LENGTH f + a
#endif
#ifndef SLOPE
#define SLOPE 1.0
#endif
#ifndef RANGE /* least and greatest plausible value, and where that comes from */
#define RANGE -50.0, 50.0, "a test"
#endif
#ifndef PICTURE /* of what, against what */
#define PICTURE 4, 1
#endif
#ifndef WORDS
#define WORDS "What it is.", "What to do.", "what tells"
#endif
/* Version 2 of the header has none of the three. */
#if STATES_NOTHING
#define OF_PARAMETER
#define OF_EFFECT
#else
#define OF_PARAMETER , RANGE
#define OF_EFFECT , PICTURE, WORDS
#endif

double nowhere(double);

static const misclosure_parameter parameters[COUNT + 1] = {
    {"a", "px", 0, 0, 0.0, 1.0, 0, 0, 0.0, 0.0, 0, 0 OF_PARAMETER}};

static int eval(void* self, const misclosure_context* context, const double* in, const double* theta, double* out,
                double* d_in, double* d_theta) {
  const double f = in[0], a = COUNT > 0 ? theta[0] : 0.0;
  for (int i = 0; i < 12; ++i) {
    out[i] = in[i];
    for (int k = 0; d_in && k < 15; ++k) d_in[15 * i + k] = i == k;
    if (d_theta) d_theta[i] = i == 0 ? SLOPE : 0.0;
  }
  out[0] = LENGTH;
  (void)self, (void)context, (void)a;
  return MISCLOSURE_DONE;
}

static const misclosure_effect table = {
    VERSION, SIZE, sizeof(misclosure_parameter), sizeof(misclosure_name), sizeof(misclosure_context), 2, 0, COUNT, 0, ID,
    "longer", "f + a", "", "a test", parameters, 0, 0, eval OF_EFFECT};

__attribute__((visibility("default"))) const misclosure_effect* misclosure_plugin(void) { return &table; }
