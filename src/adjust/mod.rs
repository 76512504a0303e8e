//! Least squares: one problem, two solvers of independent derivation, and the check that they agree.

pub mod agreement;
#[cfg(feature = "ceres")]
pub mod ceres;
pub mod native;

use crate::problem::{Problem, State};
use nalgebra::{DMatrix, Matrix3, Matrix3xX, SMatrix};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Linear algebra of the reduced camera system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LinearSolver {
    /// The solver chooses: the native one dense where unknowns are few or the envelope of the image blocks is narrow,
    /// else sparse.
    #[default]
    Auto,
    /// Dense Cholesky.
    Dense,
    /// Sparse Cholesky.
    Sparse,
    /// Preconditioned conjugate gradients.
    Iterative,
}

/// What to compute the covariance of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum CovarianceOf {
    /// Nothing.
    Nothing,
    /// Camera and effect parameters.
    Shared,
    /// These, every pose and every point.
    #[default]
    Everything,
    /// These, and what the covariance of points is made of ([`PointParts`]). The native solver alone has it.
    WithParts,
}

/// Options of a solve. Each solver destructures them without `..`: a new option that one of them forgets does not
/// compile.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Most steps tried, accepted or not.
    pub max_iterations: usize,
    /// Stop when a full step, without damping, would change chi-square (`sum rho`, twice the cost) by less than this,
    /// absolutely: by the Newton decrement. Where chi-square is so large that its rounding is more, that counts. Less
    /// than [`CHI_SQUARE_CHANGE`] asks to go on there too, by the gradient alone.
    pub chi_square_change: f64,
    /// Stop, too, after so many steps in a row that gain less than `chi_square_change` each, where full steps promise
    /// more but little: along the kink of a flaw the promise is never kept. For fits that are compared by their
    /// chi-square; `None`: never. The native solver alone can.
    pub idle_steps: Option<usize>,
    /// Give the state after `max_iterations` steps as it is, rather than fail: for a search of what stands far off. The
    /// native solver alone can.
    pub may_stay_unconverged: bool,
    /// Threads of the solver.
    pub threads: usize,
    /// Linear algebra.
    pub linear_solver: LinearSolver,
    /// Covariance.
    pub covariance: CovarianceOf,
    /// Ends the solve at the next iteration, from another thread.
    pub stop: Stop,
}

/// A wish to end a solve with [`AdjustError::Cancelled`]; clones are the same wish.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Wishes it.
    pub fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Is it wished?
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl PartialEq for Stop {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.is_raised() == other.is_raised()
    }
}

/// A parameter is wrong by `sqrt(change)` of its sigma at most when chi-square stops changing by `change`: 1e-8 leaves
/// 1e-4 sigma, a tenth of what the agreement of the solvers allows.
pub const CHI_SQUARE_CHANGE: f64 = 1e-8;

/// Ten times what a block with start values within the basin of convergence takes.
pub const MAX_ITERATIONS: usize = 200;

impl Default for Options {
    fn default() -> Self {
        Self {
            max_iterations: MAX_ITERATIONS,
            chi_square_change: CHI_SQUARE_CHANGE,
            idle_steps: None,
            may_stay_unconverged: false,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            linear_solver: LinearSolver::Auto,
            covariance: CovarianceOf::Everything,
            stop: Stop::default(),
        }
    }
}

/// Progress of one iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iteration {
    /// From 0 (the start values).
    pub number: usize,
    /// `sum rho / 2`.
    pub cost: f64,
    /// Largest gradient entry by scaled unknowns.
    pub gradient_max: f64,
    /// Seconds since the start.
    pub seconds: f64,
}

/// Called after each iteration; `Break` cancels the solve.
pub type Progress<'a> = dyn FnMut(&Iteration) -> ControlFlow<()> + 'a;

/// Covariance for unit weight (sigma0 = 1) in the problem's own datum.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Free camera and effect parameters (image-scoped ones left out), as unknowns of the layout; rows of `shared`.
    pub shared_unknowns: Vec<usize>,
    /// Their covariance, raw units.
    pub shared: DMatrix<f64>,
    /// Per image, rotation (rad) and centre (m); zero where held. Empty unless asked for.
    pub poses: Vec<SMatrix<f64, 6, 6>>,
    /// Per point, m^2. Empty unless asked for.
    pub points: Vec<Matrix3<f64>>,
    /// Per value of `theta`: its variance (image-scoped ones included; zero where held).
    pub theta_variances: Vec<f64>,
    /// Per point. Empty unless asked for.
    pub point_parts: Vec<PointParts>,
}

/// What the covariance of a point is made of.
///
/// With the covariance `X` (`3 x shared`) of the point and the shared parameters, and theirs, `C`, the point has
/// `C_point - X C^-1 X'` where all shared parameters are known, and `C_point - x x' / C_kk` where the `k`-th is.
#[derive(Debug, Clone, PartialEq)]
pub struct PointParts {
    /// Its covariance where every pose, camera and effect is known, m^2.
    pub rays: Matrix3<f64>,
    /// Covariance with each of [`Covariance::shared_unknowns`], m and raw units.
    pub with_shared: Matrix3xX<f64>,
}

/// What a solver found.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Estimated values.
    pub state: State,
    /// `sum rho / 2`.
    pub cost: f64,
    /// Did it meet its stopping rule?
    pub converged: bool,
    /// Steps tried.
    pub iterations: usize,
    /// Wall-clock seconds of the solve, covariance excluded.
    pub seconds: f64,
    /// Largest gradient entry at the solution, by scaled unknowns.
    pub gradient_max: f64,
    /// As asked for.
    pub covariance: Option<Covariance>,
}

/// Residuals and Jacobian at a given state, robust loss not applied.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// In the problem's order.
    pub residuals: Vec<f64>,
    /// Row `i` of the Jacobian of the residuals: entries `row_start[i]..row_start[i + 1]`.
    pub row_start: Vec<usize>,
    /// Unknowns (layout numbering, free ones alone), ascending within a row.
    pub columns: Vec<usize>,
    /// Derivatives by raw unknowns; rotations by `w`.
    pub values: Vec<f64>,
}

/// Normal equations after elimination of the points, robust weights not applied.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedSystem {
    /// Free unknowns that are not points, ascending.
    pub unknowns: Vec<usize>,
    /// `J'J` reduced, raw units.
    pub matrix: DMatrix<f64>,
    /// `J'r` reduced.
    pub gradient: Vec<f64>,
}

/// A direction that the measurements do not determine.
#[derive(Debug, Clone, PartialEq)]
pub struct NullDirection {
    /// Parameters that take part, by falling share, with their component (scaled by the parameter's domain).
    pub components: Vec<(String, f64)>,
}

/// Parameters of a direction that a message names: more are no hint, and half a block can take part.
const NAMED_PARAMETERS: usize = 8;

impl std::fmt::Display for NullDirection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, (name, component)) in self.components.iter().take(NAMED_PARAMETERS).enumerate() {
            write!(f, "{}{name} ({component:+.2})", if k == 0 { "" } else { ", " })?;
        }
        match self.components.len().saturating_sub(NAMED_PARAMETERS) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

/// Why an adjustment failed.
#[derive(Debug, Clone, thiserror::Error)]
pub enum AdjustError {
    /// Directions without information.
    #[error("{solver}: the measurements do not determine: {}; hold or tie these parameters (--fix, --tie) or give them \
             a prior", .directions.iter().map(ToString::to_string).collect::<Vec<_>>().join("; and: "))]
    Singular {
        /// Which solver found it.
        solver: &'static str,
        /// The null space.
        directions: Vec<NullDirection>,
    },
    /// Rays that are as good as parallel, or one alone: a point that they do not fix.
    #[error(
        "{solver}: the measurements do not determine: {point} (its rays do not meet); remove the point, or what is \
         wrong of its measurements"
    )]
    RaysDoNotMeet {
        /// Which solver found it.
        solver: &'static str,
        /// The point.
        point: String,
    },
    /// Stopped by the iteration limit or stuck.
    #[error("{solver}: not converged after {iterations} iterations: {reason}")]
    NotConverged {
        /// Which solver.
        solver: &'static str,
        /// Steps tried.
        iterations: usize,
        /// Why it stopped.
        reason: String,
    },
    /// An observation cannot be computed at the start values.
    #[error("at the start values {} cannot be computed: {reason}", observation(.image, .point))]
    BadStart {
        /// Name; `None` for surveyed coordinates.
        image: Option<String>,
        /// Name; `None` for an antenna position and for an image of which nothing can be computed.
        point: Option<String>,
        /// Behind the camera, outside an effect's domain.
        reason: String,
    },
    /// The progress callback asked to stop.
    #[error("{solver}: cancelled")]
    Cancelled {
        /// Which solver.
        solver: &'static str,
    },
    /// An option that this solver cannot honour.
    #[error("{solver} cannot honour {option}")]
    Unsupported {
        /// Which solver.
        solver: &'static str,
        /// The option, and what can be done instead.
        option: String,
    },
    /// A plug-in whose derivatives are not those of its values.
    #[error(
        "the derivative by {column} ({place}) is not that of the effect's values: they differ by {relative:.1e} of the \
         column's largest. `misclosure effects check FILE.so` tells more"
    )]
    WrongDerivative {
        /// The unknown.
        column: String,
        /// Stage, image, point.
        place: String,
        /// Largest difference.
        relative: f64,
    },
    /// Threads that the system does not give.
    #[error(
        "{solver}: {threads} threads cannot be started ({reason}); there is too little memory for them: allow more, or \
         --threads with fewer"
    )]
    NoThreads {
        /// Which solver.
        solver: &'static str,
        /// How many were asked for.
        threads: usize,
        /// The system's reason.
        reason: String,
    },
    /// The system gives too little memory.
    #[error("{solver}: {what}")]
    NoMemory {
        /// Which solver.
        solver: &'static str,
        /// For what, in words.
        what: &'static str,
    },
    /// The C++ side reported an error.
    #[error("ceres: {0}")]
    Bridge(String),
}

/// What an observation is of, for people.
fn observation(image: &Option<String>, point: &Option<String>) -> String {
    match (image, point) {
        (Some(image), Some(point)) => format!("point `{point}` in image `{image}`"),
        (Some(image), None) => format!("image `{image}`"),
        (None, Some(point)) => format!("the surveyed coordinates of point `{point}`"),
        (None, None) => "an observation".into(),
    }
}

/// The solvers of this build. A build without Cargo's feature `ceres` has the native one alone.
pub const BUILT: &[&dyn Solver] = &[
    &native::Native,
    #[cfg(feature = "ceres")]
    &ceres::Ceres,
];

/// A solver of [`Problem`].
pub trait Solver: Sync {
    /// `ceres` or `native`.
    fn name(&self) -> &'static str;
    /// Solves from `problem.start`.
    fn solve(&self, problem: &Problem, options: &Options, progress: &mut Progress<'_>)
    -> Result<Solution, AdjustError>;
    /// Residuals and Jacobian at `state`.
    fn evaluate(&self, problem: &Problem, state: &State) -> Result<Evaluation, AdjustError>;
    /// Reduced normal equations at `state`.
    fn reduced_system(&self, problem: &Problem, state: &State) -> Result<ReducedSystem, AdjustError>;
    /// Covariance of camera and effect parameters ([`CovarianceOf::Shared`]) as a solve gives it that ends at `state`.
    fn covariance_at(&self, problem: &Problem, state: &State) -> Result<Covariance, AdjustError>;
}
