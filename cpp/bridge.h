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

// From now on an allocation of 4 MiB and more, of either language, is a mapping of its own, which goes back to the system when it is let
// go. Left to itself, glibc raises this limit with what is freed, and a diagnosis of two million measurements then holds a
// quarter of a gigabyte more than it needs. With 1 MiB the matrices of small blocks would come and go with every fit: a quarter of their time.
// Other C libraries are left as they are.
void map_large_allocations();

}  // namespace misclosure::bridge

#endif  // MISCLOSURE_BRIDGE_H_
