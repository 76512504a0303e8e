// What crosses the bridge: a problem as flat arrays, options, results and errors.
//
// Unknowns are numbered cameras (12 each), effect parameters (theta), poses (6 each: rotation w with R <- exp([w]x) R,
// rad, then projection centre, m), points (3 each, m). Residuals are (observed - computed) / sigma, in the order image
// observations (2 each), control (3 each), GNSS (3 each), priors of theta, priors of camera parameters.

#ifndef MISCLOSURE_PROBLEM_H_
#define MISCLOSURE_PROBLEM_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "effect.h"

namespace misclosure {

// A borrowed array.
template <class T>
struct Span {
  const T* data = nullptr;
  std::size_t size = 0;
  const T& operator[](std::size_t k) const { return data[k]; }
  const T* begin() const { return data; }
  const T* end() const { return data + size; }
};

enum class Loss : uint32_t { kNone = 0, kHuber = 1, kCauchy = 2 };

// The problem; poses, points, interiors and theta are the state to start from.
struct ProblemView {
  // Cameras.
  Span<double> interiors;       // 12 each
  Span<double> camera_scales;   // 12 each: size of one unit inside the solver
  Span<double> camera_domains;  // 12 each: largest plausible range
  Span<uint8_t> camera_free;    // 12 each
  bool tie_dc_to_pp = false;    // centre of distortion = principal point
  // Effect parameters.
  Span<double> theta;
  Span<double> theta_scales;
  Span<uint8_t> theta_free;
  Span<uint32_t> theta_prior_index;
  Span<double> theta_prior_mean;
  Span<double> theta_prior_sigma;
  // Effects in order of action; parameter k of effect e has its values in theta from slot_base[slot_start[e] + k] on.
  Span<const misclosure_effect*> effects;
  Span<uint8_t> effect_reads_place;  // 2 each: whether it reads column, row of the context
  Span<uint32_t> slot_start;         // effects + 1
  Span<uint32_t> slot_scope;
  Span<uint32_t> slot_base;
  // Images.
  Span<misclosure_context> contexts;
  misclosure_context control_context = {};  // what control effects, and frame effects of control points, see
  Span<double> rotations;                   // 4 each: w, x, y, z, world to camera
  Span<double> centres;                     // 3 each
  Span<uint8_t> pose_free;                  // 6 each
  // Points and their image observations.
  Span<double> points;         // 3 each
  Span<uint64_t> point_start;  // points + 1
  Span<uint32_t> observation_image;
  Span<double> observation_xy;      // 2 each
  Span<double> observation_weight;  // 1 / sigma
  // Observed positions.
  Span<uint32_t> control_point;
  Span<double> control_position;  // 3 each
  Span<double> control_sigma;     // 3 each
  Span<uint32_t> gnss_image;
  Span<double> gnss_position;  // 3 each
  Span<double> gnss_sigma;     // 3 each
  // Observed camera parameters.
  Span<uint32_t> prior_camera;
  Span<uint32_t> prior_parameter;
  Span<double> prior_value;
  Span<double> prior_sigma;
  // Robust loss of image observations, scale in standard deviations.
  Loss loss = Loss::kNone;
  double loss_scale = 1.0;

  std::size_t cameras() const { return interiors.size / 12; }
  std::size_t images() const { return contexts.size; }
  std::size_t point_count() const { return points.size / 3; }
  std::size_t camera_unknown(std::size_t c, std::size_t k) const { return 12 * c + k; }
  std::size_t theta_unknown(std::size_t t) const { return 12 * cameras() + t; }
  std::size_t pose_unknown(std::size_t i, std::size_t k) const { return 12 * cameras() + theta.size + 6 * i + k; }
  std::size_t point_unknown(std::size_t j, std::size_t k) const {
    return 12 * cameras() + theta.size + 6 * images() + 3 * j + k;
  }
  std::size_t unknowns() const { return point_unknown(point_count(), 0); }
};

enum class LinearSolver : uint32_t { kAuto = 0, kDense = 1, kSparse = 2, kIterative = 3 };
enum class CovarianceOf : uint32_t { kNothing = 0, kShared = 1, kEverything = 2 };

struct SolveOptions {
  int max_iterations = 200;
  double chi_square_change = 1e-8;
  int threads = 1;
  LinearSolver linear_solver = LinearSolver::kAuto;
  CovarianceOf covariance = CovarianceOf::kNothing;
};

struct Iteration {
  int number;
  double cost;          // sum rho / 2
  double gradient_max;  // by scaled unknowns
  double seconds;
};

// Called after each iteration; false cancels.
using Progress = std::function<bool(const Iteration&)>;

// A state at which an observation cannot be computed. `point` is kNoPoint for an antenna position.
struct CannotProject : std::runtime_error {
  CannotProject(std::size_t image, std::size_t point, const std::string& reason)
      : std::runtime_error(reason), image(image), point(point) {}
  std::size_t image, point;
};
constexpr std::size_t kNoPoint = static_cast<std::size_t>(-1);

// A direction without information: unknowns that take part and their components in units of their domains, by falling
// size.
struct NullDirection {
  std::vector<std::size_t> unknowns;
  std::vector<double> components;
};

struct Singular : std::runtime_error {
  explicit Singular(std::vector<NullDirection> directions)
      : std::runtime_error("singular"), directions(std::move(directions)) {}
  std::vector<NullDirection> directions;
};

// Unit weight, raw units.
struct Covariance {
  std::vector<std::size_t> shared_unknowns;
  std::vector<double> shared;  // square
  std::vector<double> poses;   // 36 per image; empty unless asked for
  std::vector<double> points;  // 9 per point; empty unless asked for
  std::vector<double> theta_variances;
};

enum class Outcome : uint32_t { kConverged = 0, kNotConverged = 1, kCancelled = 2 };

struct Solution {
  Outcome outcome = Outcome::kNotConverged;
  std::string reason;  // of kNotConverged
  std::vector<double> interiors, theta, rotations, centres, points;
  double cost = 0.0;
  int iterations = 0;
  double seconds = 0.0;
  double gradient_max = 0.0;
  Covariance covariance;
};

// Residuals and Jacobian by rows; columns ascending, free unknowns alone; raw units.
struct Evaluation {
  std::vector<double> residuals;
  std::vector<std::size_t> row_start;
  std::vector<std::size_t> columns;
  std::vector<double> values;
};

// Normal equations without the points; robust weights not applied.
struct ReducedSystem {
  std::vector<std::size_t> unknowns;
  std::vector<double> matrix;  // square
  std::vector<double> gradient;
};

}  // namespace misclosure

#endif  // MISCLOSURE_PROBLEM_H_
