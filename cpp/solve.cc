#include "solve.h"

#include <dlfcn.h>
#include <glog/logging.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>
#include <optional>
#include <sstream>

#include "adjustment.h"
#include "normal.h"

namespace misclosure {
namespace {

// Damping 1e-7 to start with; Ceres' own 1e-4 takes many more steps along weak directions.
constexpr double kFirstRadius = 1e7;
// After the stopping rule was met with damping: (nearly) none, to reach what weak directions still hold.
constexpr double kLastRadius = 1e14;
constexpr double kLargestRadius = 1e18;
// Rounds without damping; one or two are met in practice.
constexpr int kMostRounds = 10;
// Chi-square itself is not known better than this share of it: differences of coordinates of some thousand pixels keep
// 1e-12 px, and are squared and summed.
constexpr double kCostRounding = 1e-12;
// What a full step may still gain, in units of what is allowed, for rounding to be the reason that Ceres took none.
// What keeps it from a larger gain is something else, such as an effect that fails there.
constexpr double kMostHidden = 10.0;
// Steps that polish at most. Large residuals make each leave a share of what was left.
constexpr int kMostPolishing = 50;
// Least share of a step that polishes: along a weak direction chi-square may be curved some times more than its
// linearisation, and a full step then goes too far.
constexpr double kLeastShare = 1.0 / 16.0;
// Reduced systems up to this size are dense: looking up the blocks of a sparse one, for every pair of images of every
// point, takes longer than the dense factorisation.
constexpr int kLargestDense = 1000;
// A Cholesky that fails in a weak direction shrinks the radius and tries again; each failure shrinks it more.
constexpr int kMostInvalidSteps = 20;

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// Stops by the absolute change of chi-square, reports progress, and hands on the wish to cancel.
class Watch final : public ceres::IterationCallback {
 public:
  Watch(double change, const Progress& progress) : change_(change), progress_(progress), start_(Clock::now()) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (summary.iteration == 0 && offset_ > 0) return ceres::SOLVER_CONTINUE;  // the last state again
    number_ = offset_ + summary.iteration;
    if (summary.iteration == 0 || summary.step_is_successful) {
      cost_ = summary.cost;
      gradient_max_ = summary.gradient_max_norm;
    }
    if (!progress_({number_, cost_, gradient_max_, SecondsSince(start_)})) {
      cancelled_ = true;
      return ceres::SOLVER_ABORT;
    }
    if (summary.iteration == 0 || !summary.step_is_valid) return ceres::SOLVER_CONTINUE;
    const double small = std::max(change_, 2.0 * summary.cost * kCostRounding);
    const double change = 2.0 * std::abs(summary.cost_change);
    const double predicted = summary.relative_decrease == 0.0 ? 0.0 : std::abs(change / summary.relative_decrease);
    // Also for a step that was refused: within rounding chi-square can rise.
    if (change < small && predicted < small) return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    return ceres::SOLVER_CONTINUE;
  }

  void NextRound() { offset_ = number_; }
  bool cancelled() const { return cancelled_; }
  int number() const { return number_; }
  double cost() const { return cost_; }
  double gradient_max() const { return gradient_max_; }
  double seconds() const { return SecondsSince(start_); }

 private:
  double change_;
  const Progress& progress_;
  Clock::time_point start_;
  int offset_ = 0, number_ = 0;
  double cost_ = 0.0, gradient_max_ = 0.0;
  bool cancelled_ = false;
};

ceres::Solver::Options CeresOptions(const Adjustment& adjustment, const SolveOptions& options) {
  ceres::Solver::Options ceres_options;
  ceres_options.minimizer_type = ceres::TRUST_REGION;
  ceres_options.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  const bool dense = options.linear_solver == LinearSolver::kDense ||
                     (options.linear_solver == LinearSolver::kAuto && adjustment.ReducedSize() <= kLargestDense);
  ceres_options.linear_solver_type = dense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  if (options.linear_solver == LinearSolver::kIterative) {
    ceres_options.linear_solver_type = ceres::ITERATIVE_SCHUR;
    ceres_options.preconditioner_type = ceres::SCHUR_JACOBI;
    ceres_options.use_explicit_schur_complement = true;  // one product per step, not one per iteration
    ceres_options.max_linear_solver_iterations = 1000;
    // Inexact steps; the stopping rule and the certificate hold as for the direct solvers.
    ceres_options.eta = 1e-3;
  }
  ceres_options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  ceres_options.linear_solver_ordering = adjustment.Ordering();
  ceres_options.num_threads = options.threads;
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.max_num_consecutive_invalid_steps = kMostInvalidSteps;
  ceres_options.initial_trust_region_radius = kFirstRadius;
  ceres_options.max_trust_region_radius = kLargestRadius;
  // The callback decides; these must not stop before it does.
  ceres_options.function_tolerance = 0.0;
  ceres_options.gradient_tolerance = 0.0;
  ceres_options.parameter_tolerance = 0.0;
  ceres_options.logging_type = ceres::SILENT;
  return ceres_options;
}

// Ceres takes no step that does not reduce chi-square, whose rounding hides the last of what there is to gain. The
// decrement has its digits from the gradient: steps from Ceres' derivatives, halved where it rises, for as long as it
// falls. Gives the steps taken; `normal` is that of the last state.
int Polish(const ProblemView& view, Adjustment& adjustment, double asked, std::optional<Normal>& normal) {
  const auto move = [&](const std::vector<double>& step, double share) {
    std::vector<double> part(step);
    for (double& value : part) value *= share;
    adjustment.Move(part);
    normal.emplace(view, adjustment, true);
    normal->Factorise();
    return normal->Decrement();
  };
  double least = normal->Decrement();
  for (int steps = 0; steps < kMostPolishing; ++steps) {
    const std::vector<double> step = normal->Step();
    double share = 1.0;
    double left = move(step, share);
    while (!(left < least) && share > kLeastShare) {
      share *= 0.5;
      left = move(step, -share);  // half of the way back
    }
    if (!(left < least)) {
      move(step, -share);
      return steps;
    }
    if (left <= asked) return steps + 1;
    least = left;
  }
  return kMostPolishing;
}

// Ceres writes its warnings to standard error; what matters comes back as an outcome. CHOLMOD's OpenMP, of which it has
// one short loop, prints a message and ends the program where no thread can be started. So no parallel region has more
// than the calling thread.
void Quiet() {
  FLAGS_minloglevel = google::GLOG_FATAL;
  using SetLevels = void (*)(int);
  static const auto set_levels = reinterpret_cast<SetLevels>(dlsym(RTLD_DEFAULT, "omp_set_max_active_levels"));
  // A setting of the calling thread.
  if (set_levels != nullptr) set_levels(0);
}

// What Ceres says of a factorisation that CHOLMOD could not make for want of memory.
constexpr char kNoFactor[] = "unrecoverable non-numeric causes";

}  // namespace

Solution Solve(const ProblemView& view, const SolveOptions& options, const Progress& progress) {
  Quiet();
  Check(view);
  if (options.threads < 1) throw std::invalid_argument("`threads` is less than 1");
  if (options.max_iterations < 1) throw std::invalid_argument("`max_iterations` is less than 1");
  if (!(options.chi_square_change > 0.0)) throw std::invalid_argument("`chi_square_change` is not positive");
  Adjustment adjustment(view);
  Watch watch(options.chi_square_change, progress);
  ceres::Solver::Options ceres_options = CeresOptions(adjustment, options);
  ceres_options.callbacks.push_back(&watch);

  Solution solution;
  for (int round = 0;; ++round) {
    ceres::Solver::Summary summary;
    ceres::Solve(ceres_options, &adjustment.problem(), &summary);
    if (watch.cancelled()) {
      solution.outcome = Outcome::kCancelled;
      return solution;
    }
    if (summary.termination_type == ceres::FAILURE && summary.message.find(kNoFactor) != std::string::npos)
      throw std::bad_alloc();
    const bool stopped =
        summary.termination_type == ceres::CONVERGENCE || summary.termination_type == ceres::USER_SUCCESS;
    if (summary.termination_type == ceres::FAILURE && watch.number() == 0) adjustment.FindCulprit();
    solution.seconds = watch.seconds();
    solution.iterations = watch.number();
    solution.cost = watch.cost();
    solution.gradient_max = watch.gradient_max();

    // The certificate: is there information in every direction, and what would a full step still gain?
    std::optional<Normal> normal(std::in_place, view, adjustment, true);
    normal->Factorise();
    double left = normal->Decrement();
    const double allowed = std::max(options.chi_square_change, 2.0 * solution.cost * kCostRounding);
    // The rounding of chi-square may hide more than is allowed: round after round takes no step.
    const bool hidden = left >= allowed && left < kMostHidden * allowed;
    if (stopped && hidden && round == kMostRounds) {
      solution.iterations += Polish(view, adjustment, allowed, normal);
      left = normal->Decrement();
    }
    if (left < allowed && stopped) {
      solution.outcome = Outcome::kConverged;
      // Less than usual is asked for: as far as the gradient tells.
      const bool finer =
          options.chi_square_change < SolveOptions().chi_square_change && left > options.chi_square_change;
      if (finer) solution.iterations += Polish(view, adjustment, options.chi_square_change, normal);
      if (options.covariance != CovarianceOf::kNothing) {
        solution.covariance = normal->Invert(options.covariance == CovarianceOf::kEverything);
      }
      break;
    }
    if (!stopped || round == kMostRounds || watch.number() >= options.max_iterations) {
      if (summary.termination_type == ceres::FAILURE) {
        solution.reason = summary.message;
      } else {
        std::ostringstream reason;
        reason << (stopped ? "" : "iteration limit reached; ") << "a full step would still change chi-square by "
               << left << ", allowed are " << allowed;
        solution.reason = reason.str();
      }
      break;
    }
    watch.NextRound();
    ceres_options.max_num_iterations = options.max_iterations - watch.number();
    ceres_options.initial_trust_region_radius = kLastRadius;
  }
  adjustment.Store(solution);
  return solution;
}

Evaluation Evaluate(const ProblemView& view) {
  Quiet();
  Check(view);
  return Adjustment(view).Evaluate();
}

ReducedSystem Reduce(const ProblemView& view) {
  Quiet();
  Check(view);
  const Adjustment adjustment(view);
  return Normal(view, adjustment, false).Dense();
}

Covariance CovarianceAt(const ProblemView& view) {
  Quiet();
  Check(view);
  const Adjustment adjustment(view);
  Normal normal(view, adjustment, true);
  normal.Factorise();
  return normal.Invert(false);
}

}  // namespace misclosure
