//! Effects from shared libraries: a header of `cpp/effect.h`'s kind, compiled as its first lines say, loaded by explicit path.

#![allow(unsafe_code)] // loading

use super::abi::{AbiError, CEffect, RawEffect};
use super::*;
use crate::camera;
use libloading::os::unix;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why a plug-in was not loaded.
#[derive(Debug, thiserror::Error)]
pub enum PluginError {
    /// Not a library that this machine can load.
    #[error("{path}: cannot be loaded: {source}", path = .path.display())]
    Load {
        /// The file.
        path: PathBuf,
        /// The loader's message.
        source: libloading::Error,
    },
    /// A library, but not a plug-in.
    #[error("{path}: has no symbol `misclosure_plugin`: compile the header with -DMISCLOSURE_PLUGIN", path = .path.display())]
    Symbol {
        /// The file.
        path: PathBuf,
    },
    /// A plug-in for another program.
    #[error("{path}: {source}", path = .path.display())]
    Abi {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: AbiError,
    },
    /// An effect that no model can have.
    #[error("{path}: effect `{id}`: {fault}", path = .path.display())]
    Effect {
        /// The file.
        path: PathBuf,
        /// Its id.
        id: String,
        /// What is wrong.
        fault: String,
    },
}

/// Step of the numerical derivatives, as a share of the sizes in [`Plugin::input_sizes`]: a five-point formula loses 1e-12 of its
/// order and 1e-13 / 1e-3 by rounding.
const STEP: f64 = 1e-3;

/// Change of a value, as a share of it, that leaves a derivative eleven digits.
const VISIBLE: f64 = 1e-5;
/// Steps grow by this, so many times at most.
const GROWTH: f64 = 10.0;
/// See [`GROWTH`].
const MOST_DECADES: usize = 7;

/// Sizes over which effects change: rotation, rad; positions, m; image coordinates, px.
const ANGLE: f64 = 1.0;
const POSITION_M: f64 = 100.0;
const IMAGE_PX: f64 = 300.0;

/// Where the image size is not known.
const HALF_DIAGONAL_PX: f64 = 3000.0;

struct Plugin {
    effect: CEffect, // before the library: dropped first
    _library: libloading::Library,
}

/// Loads a plug-in; the library stays loaded as long as the effect. A name without a slash is a file in the working directory, never
/// one from the system's search path.
///
/// # Errors
/// [`PluginError`], with the path.
pub fn load(path: &Path) -> Result<Arc<dyn Effect>, PluginError> {
    let plugin = open(path)?;
    laws::admission(&plugin, &plugin.effect).map_err(|fault| {
        let id = plugin.descriptor().id.to_string();
        PluginError::Effect { path: path.to_path_buf(), id, fault }
    })?;
    Ok(Arc::new(plugin))
}

/// The effect of a library, its table checked.
fn open(path: &Path) -> Result<Plugin, PluginError> {
    let explicit = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    // Every symbol is bound now: one that is missing is an error here, not the end of the program when it is first called.
    // SAFETY: loading runs the library's initialisers; that it may is what the user says by naming the file.
    let library = unsafe { unix::Library::open(Some(&explicit), unix::RTLD_NOW | unix::RTLD_LOCAL) }
        .map_err(|source| PluginError::Load { path: path.to_path_buf(), source })?;
    let library = libloading::Library::from(library);
    // SAFETY: a symbol of this name has this type, by effect.h.
    let table = unsafe {
        let entry = library
            .get::<unsafe extern "C" fn() -> *const RawEffect>(b"misclosure_plugin")
            .map_err(|_| PluginError::Symbol { path: path.to_path_buf() })?;
        entry()
    };
    // SAFETY: a table of effect.h, in a library that is kept loaded beside the effect.
    let effect =
        unsafe { CEffect::new(table) }.map_err(|source| PluginError::Abi { path: path.to_path_buf(), source })?;
    Ok(Plugin { effect, _library: library })
}

impl Plugin {
    fn values(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
    ) -> Result<(), OutsideDomain> {
        self.effect.evaluate(context, input, theta, out, None, None).map_err(|_| OutsideDomain)
    }

    fn input_sizes(&self, context: &Context<'_>) -> Vec<f64> {
        let diagonal = 0.5 * context.image.width_px.hypot(context.image.height_px);
        let h = if diagonal.is_finite() { diagonal } else { HALF_DIAGONAL_PX };
        // Coefficients by what moves a point at the sensor's edge by as much as an image coordinate's size.
        let mut interior = [IMAGE_PX; camera::PARAMETER_COUNT];
        for (k, power) in [(5, -3), (6, -5), (7, -7), (8, -2), (9, -2), (10, -1), (11, -1)] {
            interior[k] *= h.powi(power);
        }
        let (angles, position, image) = ([ANGLE; 3], [POSITION_M; 3], [IMAGE_PX; 2]);
        match self.effect.descriptor().stage {
            Stage::Exposure | Stage::Position => [angles, position].concat(),
            Stage::Ray => [angles, position, position].concat(),
            Stage::Interior => [&interior[..], &angles].concat(),
            Stage::Image => [&image[..], &interior].concat(),
            Stage::Control | Stage::Frame => position.to_vec(),
        }
    }
}

/// Values of an effect as a function of its input or of its parameters.
type Values<'a> = &'a dyn Fn(&[f64], &mut [f64]) -> Result<(), OutsideDomain>;

/// Derivative of `f` (m outputs) by `x[k]`, five-point formula, into column `k` of the row-major `matrix`.
fn differentiate(
    f: Values<'_>,
    x: &[f64],
    k: usize,
    step: f64,
    m: usize,
    matrix: &mut [f64],
) -> Result<(), OutsideDomain> {
    let mut at = x.to_vec();
    let mut out = vec![0.0; m];
    let mut sum = vec![0.0; m];
    for (offset, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
        at[k] = x[k] + offset * step;
        f(&at, &mut out)?;
        for i in 0..m {
            sum[i] += weight * out[i];
        }
    }
    for i in 0..m {
        matrix[i * x.len() + k] = sum[i] / (12.0 * step);
    }
    Ok(())
}

/// Outputs that have one unit and stand together: by the largest of them their rounding is judged.
const fn together(stage: Stage) -> usize {
    match stage {
        Stage::Interior => 1,
        Stage::Image => 2,
        Stage::Exposure | Stage::Ray | Stage::Position | Stage::Control | Stage::Frame => 3,
    }
}

/// A step of parameter `k` that the values show: a value is what it was without the effect and what that adds, and the rounding of the one hides
/// a small other. For parameters in which values are linear, the step may be as large as it takes. `group`: see [`together`].
fn visible_step(f: Values<'_>, x: &[f64], k: usize, step: f64, m: usize, group: usize) -> f64 {
    let changed = |step: f64| -> Result<bool, OutsideDomain> {
        let (mut low, mut high) = (vec![0.0; m], vec![0.0; m]);
        let mut at = x.to_vec();
        at[k] = x[k] - step;
        f(&at, &mut low)?;
        at[k] = x[k] + step;
        f(&at, &mut high)?;
        // A point at x = 2, y = 3000 px that moves by 1e-4 px in both is seen in x, but its y has lost eight digits.
        let largest =
            |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, value| most.max(value.abs()));
        let seen = |(a, b): (&[f64], &[f64])| {
            let change = largest(&mut a.iter().zip(b).map(|(a, b)| a - b));
            change > 0.0 && change >= VISIBLE * largest(&mut a.iter().chain(b).copied())
        };
        Ok(low.chunks(group).zip(high.chunks(group)).any(seen))
    };
    let mut larger = step;
    for _ in 0..MOST_DECADES {
        // At the edge of a domain a step stays inside.
        match changed(larger) {
            Ok(true) => return larger,
            Ok(false) if changed(GROWTH * larger).is_ok() => larger *= GROWTH,
            _ => break,
        }
    }
    // What still shows nothing is as good as zero, and a small step would leave its rounding. The last decade may end at the edge of a domain.
    (larger / GROWTH).max(step)
}

impl Effect for Plugin {
    fn descriptor(&self) -> &Descriptor {
        self.effect.descriptor()
    }

    /// Values of the plug-in, derivatives from the values: a wrong derivative in the plug-in then shows as a difference between the
    /// solvers.
    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        let m = out.len();
        self.values(context, input, theta, out)?;
        if let Some(matrix) = d_input {
            // Only what the effect adds to the identity is differentiated numerically, so that the null law holds exactly.
            let (n, offset) = (input.len(), self.descriptor().stage.identity_offset());
            let added = |x: &[f64], out: &mut [f64]| {
                self.values(context, x, theta, out)?;
                out.iter_mut().zip(&x[offset..]).for_each(|(out, x)| *out -= x);
                Ok(())
            };
            let sizes = self.input_sizes(context);
            for k in 0..n {
                differentiate(&added, input, k, STEP * sizes[k], m, matrix)?;
            }
            for i in 0..m {
                matrix[i * n + offset + i] += 1.0;
            }
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            for (k, parameter) in self.descriptor().parameters.iter().enumerate() {
                if matches!(parameter.role, Role::Given(_)) {
                    continue;
                }
                let mut step = STEP * parameter.typical.abs().max(theta[k].abs());
                let f = |x: &[f64], out: &mut [f64]| self.values(context, input, x, out);
                if !matches!(parameter.role, Role::Searched(_)) {
                    step = visible_step(&f, theta, k, step, m, together(self.descriptor().stage));
                }
                differentiate(&f, theta, k, step, m, matrix)?;
            }
        }
        Ok(())
    }

    fn c_abi(&self) -> Option<*const std::ffi::c_void> {
        Some(self.effect.raw().cast())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// Derivatives of the plug-in's values against those derived by hand, relative to the largest of the column.
    const DERIVATIVE: f64 = 1e-7;

    /// Compiles `source` in a folder of its own, as the first lines of `effect.h` say.
    fn compile(folder: &Path, source: &str, language: &str, options: &[&str]) -> PathBuf {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let header = folder.join("effect-of-mine.h");
        let library = folder.join("effect-of-mine.so");
        std::fs::write(&header, source).unwrap();
        let status = Command::new("c++")
            .args(["-O1", "-fPIC", "-shared", "-fvisibility=hidden", "-I"])
            .arg(root.join("cpp"))
            .args(["-I", "/usr/include/eigen3", "-x", language])
            .args(options)
            .arg(&header)
            .arg("-o")
            .arg(&library)
            .status()
            .expect("a C++ compiler, which the build needs too");
        assert!(status.success());
        library
    }

    fn error(path: &Path) -> String {
        load(path).err().expect("refused").to_string()
    }

    #[test]
    fn the_unmodified_header_is_a_plug_in() {
        let folder = tempfile::tempdir().unwrap();
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let source = std::fs::read_to_string(root.join("cpp/effects/gnss-lever-arm.h")).unwrap();
        // Not by `load`, which refuses a second effect of this id.
        let plugin = open(&compile(folder.path(), &source, "c++", &["-std=c++17", "-DMISCLOSURE_PLUGIN"])).unwrap();
        let own = find("gnss-lever-arm").unwrap();
        assert!(plugin.c_abi().is_some());
        let without_ranges = |d: &Descriptor| -> Vec<Parameter> {
            d.parameters.iter().map(|p| Parameter { plausible: None, ..p.clone() }).collect()
        };
        assert_eq!(plugin.descriptor().parameters, without_ranges(own.descriptor()));
        let (block, image) = (BlockContext::default(), ImageContext::default());
        let context = Context { block: &block, image: &image, column_px: f64::NAN, row_px: f64::NAN, surveyed: None };
        let input = [3.0, 0.2, -0.1, 500.0, 600.0, 70.0];
        let theta = [0.1, -0.2, 0.3];
        let run = |effect: &dyn Effect| {
            let (mut out, mut d_input, mut d_theta) = ([0.0; 3], [0.0; 18], [0.0; 9]);
            effect.eval(&context, &input, &theta, &mut out, Some(&mut d_input), Some(&mut d_theta)).unwrap();
            [&out[..], &d_input, &d_theta].concat()
        };
        for (a, b) in run(&plugin).iter().zip(run(own)) {
            assert!((a - b).abs() <= DERIVATIVE * b.abs().max(1.0), "{a} instead of {b}");
        }
        let violations = [laws::null_law(&plugin, 3), laws::purity(&plugin, 3), laws::description(&plugin)];
        assert!(violations.iter().all(Result::is_ok), "{violations:?}");
    }

    /// A bend of the sensor, c P_2(x) P_1(y) out of its plane: at the left edge x is small and y is not, and at the zeros of the polynomials
    /// nothing moves. Solvers agree on a column to 1e-9 of its largest entry.
    #[test]
    fn steps_leave_no_rounding_at_edges_and_where_nothing_moves() {
        let scatter = |k: usize, share: f64| (k as f64 * share).fract();
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for k in 0..4000 {
            let x = 5120.0 * scatter(k, 0.754_877_666) * if k % 9 == 0 { 1e-3 } else { 1.0 };
            let y = 3840.0 * scatter(k, 0.569_840_291);
            let (s, t) = (2.0 * x / 5120.0 - 1.0, 2.0 * y / 3840.0 - 1.0);
            let slope = [(x - 2540.0) / 5500.0, (y - 1945.0) / 5500.0].map(|radius| radius * (1.5 * s * s - 0.5) * t);
            let f = |theta: &[f64], out: &mut [f64]| {
                (out[0], out[1]) = (x + slope[0] * theta[0], y + slope[1] * theta[0]);
                Ok(())
            };
            let step = visible_step(&f, &[0.3], 0, STEP * 0.5, 2, together(Stage::Image));
            let mut found = [0.0; 2];
            differentiate(&f, &[0.3], 0, step, 2, &mut found).unwrap();
            for (found, expected) in found.iter().zip(slope) {
                (worst, largest) = (worst.max((found - expected).abs()), largest.max(expected.abs()));
            }
        }
        assert!(worst < 1e-9 * largest, "{:e}", worst / largest);
    }

    #[test]
    fn what_is_not_a_plug_in_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing.so");
        assert!(error(&missing).contains("missing.so: cannot be loaded: "));
        let text = folder.path().join("text.so");
        std::fs::write(&text, "not a library").unwrap();
        assert!(error(&text).contains("text.so: cannot be loaded: "));
        let other = compile(folder.path(), "int something(void) { return 1; }", "c", &[]);
        assert!(error(&other).contains("has no symbol `misclosure_plugin`"), "{}", error(&other));
    }

    /// A table by hand, in C, with `fields` at its front.
    fn table(fields: &str) -> String {
        format!(
            "#include \"effect.h\"\nstatic misclosure_effect table = {{{fields}}};\n\
             __attribute__((visibility(\"default\"))) const misclosure_effect* misclosure_plugin(void) {{ return &table; }}\n"
        )
    }

    #[test]
    fn another_version_another_size_and_empty_tables_are_refused() {
        let sizes = "sizeof(misclosure_effect), sizeof(misclosure_parameter), sizeof(misclosure_name)";
        let cases = [
            ("1".to_string(), "made for version 1 of effect.h, this program has version 2: compile it again"),
            ("2, 8".to_string(), "struct misclosure_effect has 8 bytes"),
            (format!("2, {sizes}, 16"), "struct misclosure_context has 16 bytes"),
            (format!("2, {sizes}, sizeof(misclosure_context), 0, 0, 1"), "has no valid parameters"),
            (format!("2, {sizes}, sizeof(misclosure_context)"), "has no valid id"),
        ];
        for (fields, expected) in cases {
            let folder = tempfile::tempdir().unwrap();
            let message = error(&compile(folder.path(), &table(&fields), "c", &[]));
            assert!(message.contains(expected), "{message}");
        }
    }
}
