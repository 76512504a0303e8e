// C++ end of the bridge: what cxx needs to see before it declares its own types.

#ifndef MISCLOSURE_BRIDGE_H_
#define MISCLOSURE_BRIDGE_H_

#include "rust/cxx.h"
#include "solve.h"

// Address of an effect's table, for arrays.
struct misclosure_effect_handle {
  const misclosure_effect* effect;
};

namespace misclosure::bridge {

struct View;
struct SolveOptions;
struct SolveResult;
struct EvaluateResult;
struct ReduceResult;
struct CovarianceResult;
struct Watch;

SolveResult solve(const View& view, const SolveOptions& options, Watch& watch);
EvaluateResult evaluate(const View& view);
ReduceResult reduce(const View& view);
CovarianceResult covariance_at(const View& view);

}  // namespace misclosure::bridge

#endif  // MISCLOSURE_BRIDGE_H_
