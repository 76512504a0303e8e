// Translates between cxx's types and solve.h's. Exceptions that are not a Report become `Err` on the Rust side.

#include "bridge.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <utility>

#include "misclosure/src/adjust/ceres/bridge.rs.h"

namespace misclosure::bridge {
namespace {

static_assert(sizeof(misclosure_effect_handle) == sizeof(const misclosure_effect*),
              "an array of handles is one of addresses");

template <class T>
Span<T> Borrow(rust::Slice<const T> slice) {
  return {slice.data(), slice.size()};
}

template <class To, class From>
rust::Vec<To> Copy(const std::vector<From>& from) {
  rust::Vec<To> to;
  to.reserve(from.size());
  for (const From& value : from) to.push_back(static_cast<To>(value));
  return to;
}

ProblemView Translate(const View& view) {
  if (view.control_context.size() != 1) throw std::invalid_argument("array `control_context`: expected one entry");
  ProblemView out;
  out.interiors = Borrow(view.interiors);
  out.camera_scales = Borrow(view.camera_scales);
  out.camera_domains = Borrow(view.camera_domains);
  out.camera_free = Borrow(view.camera_free);
  out.tie_dc_to_pp = view.tie_dc_to_pp;
  out.theta = Borrow(view.theta);
  out.theta_scales = Borrow(view.theta_scales);
  out.theta_free = Borrow(view.theta_free);
  out.theta_prior_index = Borrow(view.theta_prior_index);
  out.theta_prior_mean = Borrow(view.theta_prior_mean);
  out.theta_prior_sigma = Borrow(view.theta_prior_sigma);
  out.effects = {reinterpret_cast<const misclosure_effect* const*>(view.effects.data()), view.effects.size()};
  out.effect_reads_place = Borrow(view.effect_reads_place);
  out.slot_start = Borrow(view.slot_start);
  out.slot_scope = Borrow(view.slot_scope);
  out.slot_base = Borrow(view.slot_base);
  out.contexts = Borrow(view.contexts);
  out.control_context = view.control_context[0];
  out.rotations = Borrow(view.rotations);
  out.centres = Borrow(view.centres);
  out.pose_free = Borrow(view.pose_free);
  out.points = Borrow(view.points);
  out.point_start = Borrow(view.point_start);
  out.observation_image = Borrow(view.observation_image);
  out.observation_xy = Borrow(view.observation_xy);
  out.observation_weight = Borrow(view.observation_weight);
  out.control_point = Borrow(view.control_point);
  out.control_position = Borrow(view.control_position);
  out.control_sigma = Borrow(view.control_sigma);
  out.gnss_image = Borrow(view.gnss_image);
  out.gnss_position = Borrow(view.gnss_position);
  out.gnss_sigma = Borrow(view.gnss_sigma);
  out.prior_camera = Borrow(view.prior_camera);
  out.prior_parameter = Borrow(view.prior_parameter);
  out.prior_value = Borrow(view.prior_value);
  out.prior_sigma = Borrow(view.prior_sigma);
  out.loss = static_cast<Loss>(view.loss);
  out.loss_scale = view.loss_scale;
  return out;
}

// Runs `call`; failures that have a place in the problem come back in the report.
template <class Call>
void Guard(Report& report, Call call) {
  report.status = Status::Converged;
  report.image = report.point = kNoPoint;
  try {
    call();
  } catch (const CannotProject& failure) {
    report.status = Status::CannotProject;
    report.reason = failure.what();
    report.image = failure.image;
    report.point = failure.point;
  } catch (const Singular& failure) {
    report.status = Status::Singular;
    report.null_start.push_back(0);
    for (const NullDirection& direction : failure.directions) {
      for (std::size_t unknown : direction.unknowns) report.null_unknowns.push_back(unknown);
      for (double component : direction.components) report.null_components.push_back(component);
      report.null_start.push_back(report.null_unknowns.size());
    }
  }
}

}  // namespace

SolveResult solve(const View& view, const SolveOptions& options, Watch& watch) {
  SolveResult result = {};
#ifdef __GLIBC__
  // Of a large block this is where the most memory is needed: what was freed before goes back first.
  malloc_trim(0);
#endif
  Guard(result.report, [&] {
    misclosure::SolveOptions own;
    own.max_iterations = static_cast<int>(options.max_iterations);
    own.chi_square_change = options.chi_square_change;
    own.threads = static_cast<int>(options.threads);
    own.linear_solver = static_cast<LinearSolver>(options.linear_solver);
    own.covariance = static_cast<CovarianceOf>(options.covariance);
    const Solution solution = Solve(Translate(view), own, [&](const Iteration& iteration) {
      return watch.iteration(static_cast<uint32_t>(iteration.number), iteration.cost, iteration.gradient_max,
                             iteration.seconds);
    });
    if (solution.outcome == Outcome::kNotConverged) result.report.status = Status::NotConverged;
    if (solution.outcome == Outcome::kCancelled) result.report.status = Status::Cancelled;
    result.report.reason = rust::String::lossy(solution.reason);
    result.interiors = Copy<double>(solution.interiors);
    result.theta = Copy<double>(solution.theta);
    result.rotations = Copy<double>(solution.rotations);
    result.centres = Copy<double>(solution.centres);
    result.points = Copy<double>(solution.points);
    result.cost = solution.cost;
    result.iterations = static_cast<uint32_t>(solution.iterations);
    result.seconds = solution.seconds;
    result.gradient_max = solution.gradient_max;
    result.shared_unknowns = Copy<uint64_t>(solution.covariance.shared_unknowns);
    result.shared = Copy<double>(solution.covariance.shared);
    result.pose_covariances = Copy<double>(solution.covariance.poses);
    result.point_covariances = Copy<double>(solution.covariance.points);
    result.theta_variances = Copy<double>(solution.covariance.theta_variances);
  });
  return result;
}

EvaluateResult evaluate(const View& view) {
  EvaluateResult result = {};
  Guard(result.report, [&] {
    const Evaluation evaluation = Evaluate(Translate(view));
    result.residuals = Copy<double>(evaluation.residuals);
    result.row_start = Copy<uint64_t>(evaluation.row_start);
    result.columns = Copy<uint64_t>(evaluation.columns);
    result.values = Copy<double>(evaluation.values);
  });
  return result;
}

ReduceResult reduce(const View& view) {
  ReduceResult result = {};
  Guard(result.report, [&] {
    const ReducedSystem system = Reduce(Translate(view));
    result.unknowns = Copy<uint64_t>(system.unknowns);
    result.matrix = Copy<double>(system.matrix);
    result.gradient = Copy<double>(system.gradient);
  });
  return result;
}

CovarianceResult covariance_at(const View& view) {
  CovarianceResult result = {};
  Guard(result.report, [&] {
    const Covariance covariance = CovarianceAt(Translate(view));
    result.shared_unknowns = Copy<uint64_t>(covariance.shared_unknowns);
    result.shared = Copy<double>(covariance.shared);
    result.theta_variances = Copy<double>(covariance.theta_variances);
  });
  return result;
}

}  // namespace misclosure::bridge
