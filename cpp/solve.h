// The Ceres solver behind flat arrays: no Ceres and no Eigen type here, so that the bridge and its tests need neither.
//
// Every function checks each index, length and number first and throws std::invalid_argument with the name of the
// array.

#ifndef MISCLOSURE_SOLVE_H_
#define MISCLOSURE_SOLVE_H_

#include <cstddef>

#include "problem.h"

namespace misclosure {

// Throw CannotProject at the start values, Singular, std::invalid_argument.
Solution Solve(const ProblemView& view, const SolveOptions& options, const Progress& progress);
Evaluation Evaluate(const ProblemView& view);
ReducedSystem Reduce(const ProblemView& view);
// Of the shared unknowns at the start values, robust weights applied: what Solve gives when it ends there. Throws as it
// does.
Covariance CovarianceAt(const ProblemView& view);

// Throws std::invalid_argument with the name of the array that is wrong.
void Check(const ProblemView& view);

}  // namespace misclosure

extern "C" {
// Built-in effects in order of their file names; null behind the last.
const misclosure_effect* misclosure_builtin(std::size_t index);
}

#endif  // MISCLOSURE_SOLVE_H_
