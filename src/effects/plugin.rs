//! Effects from shared libraries: a header of `cpp/effect.h`'s kind, compiled (`misclosure effects build`), loaded by
//! explicit path.
//!
//! Before the first call the file is read whole (its hash is what a report names), its segments are found inside it,
//! every symbol is bound, and the table is checked: version, sizes, pointers, counts. Then [`laws::admission`] asks for
//! what no model can do without.

#![allow(unsafe_code)] // loading

use super::abi::{AbiError, CEffect, EvalFault, RawEffect, Watched};
use super::*;
use libloading::os::unix;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why a plug-in was not loaded.
#[derive(Debug, thiserror::Error)]
pub enum PluginError {
    /// No file that can be read.
    #[error("{path}: cannot be read: {source}", path = .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's message.
        source: std::io::Error,
    },
    /// Not a library that this machine can load.
    #[error("{path}: cannot be loaded: {source}", path = .path.display())]
    Load {
        /// The file.
        path: PathBuf,
        /// The loader's message.
        source: libloading::Error,
    },
    /// A library of which a part is missing: the loader would crash on it.
    #[error("{path}: is not whole: {found} bytes, its segments take {expected}", path = .path.display())]
    NotWhole {
        /// The file.
        path: PathBuf,
        /// Its length.
        found: u64,
        /// The end of its last segment.
        expected: u64,
    },
    /// A library, but not a plug-in.
    #[error("{path}: has no symbol `misclosure_plugin`: compile the header with \
             -DMISCLOSURE_PLUGIN", path = .path.display())]
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

/// Where an effect came from: what a report says of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// The file, as it was named.
    pub path: PathBuf,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
}

/// A measurement for which a plug-in gave no values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// What it did instead.
    pub what: EvalFault,
    /// Position of the image; [`super::abi::NO_IMAGE`] at a surveyed point.
    pub image: u32,
    /// Predicted image point, px; NaN where it is not known.
    pub place: [f64; 2],
}

impl Fault {
    /// The place of the context; where nobody asks for it, the point that an image effect got.
    pub(super) fn place_of(column_px: f64, row_px: f64, stage: Stage, input: &[f64]) -> [f64; 2] {
        match stage {
            Stage::Image if column_px.is_nan() || row_px.is_nan() => [input[0], input[1]],
            _ => [column_px, row_px],
        }
    }
}

/// An effect whose library is loaded.
pub struct Plugin {
    loaded: Arc<Loaded>,
    derivatives: Derivatives,
}

struct Loaded {
    effect: Watched, // before the library: dropped first
    origin: Origin,
    /// See [`Effect::reads_place`].
    reads_place: [bool; 2],
    _library: libloading::Library,
}

/// What [`Effect::eval`] of a plug-in gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Derivatives {
    /// Numerical ones of the values: for whoever compares or tests.
    OfValues,
    /// The library's own: for the iterations of a solver, whose result is compared.
    Own,
}

/// Loads a plug-in; the library stays loaded as long as the effect. A name without a slash is a file in the working
/// directory, never one from the system's search path.
///
/// # Errors
/// [`PluginError`], with the path.
pub fn load(path: &Path) -> Result<Arc<dyn Effect>, PluginError> {
    let plugin = open(path)?;
    laws::admission(&plugin, plugin.table()).map_err(|fault| {
        let id = plugin.descriptor().id.to_string();
        PluginError::Effect { path: path.to_path_buf(), id, fault }
    })?;
    Ok(Arc::new(plugin))
}

/// The effect of a library, its table checked, but none of its laws: for a check that says which of them it breaks.
///
/// # Errors
/// [`PluginError`], with the path.
pub fn open(path: &Path) -> Result<Plugin, PluginError> {
    let explicit = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let bytes =
        crate::files::read(&explicit).map_err(|source| PluginError::Read { path: path.to_path_buf(), source })?;
    let (found, expected) = (bytes.len() as u64, segments_end(&bytes).unwrap_or(0));
    if expected > found {
        return Err(PluginError::NotWhole { path: path.to_path_buf(), found, expected });
    }
    let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    // Every symbol is bound now: one that is missing is an error here, not the end of the program when it is first
    // called. SAFETY: loading runs the library's initialisers; that it may is what the user says by naming the file.
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
    let origin = Origin { path: path.to_path_buf(), sha256 };
    let reads_place = laws::reads_place(effect.descriptor(), |sample, out| {
        effect.evaluate(&sample.context(), &sample.input, &sample.theta, out, None, None).is_ok()
    });
    let loaded = Arc::new(Loaded { effect: Watched::new(effect), origin, reads_place, _library: library });
    Ok(Plugin { loaded, derivatives: Derivatives::OfValues })
}

/// Where the last segment of a 64-bit ELF file of this machine's byte order ends; `None` for what is none. The loader
/// maps segments without looking whether the file has them, and a file that was cut off ends the program with a bus
/// error.
fn segments_end(bytes: &[u8]) -> Option<u64> {
    let at = |offset: u64, size: usize| bytes.get(usize::try_from(offset).ok()?..)?.get(..size);
    let short = |offset: u64| Some(u64::from(u16::from_ne_bytes(at(offset, 2)?.try_into().ok()?)));
    let long = |offset: u64| Some(u64::from_ne_bytes(at(offset, 8)?.try_into().ok()?));
    if at(0, 5)? != [0x7f, b'E', b'L', b'F', 2] {
        return None;
    }
    let (table, size, count) = (long(0x20)?, short(0x36)?, short(0x38)?);
    let mut end = table.saturating_add(size * count);
    for k in 0..count {
        let header = table.checked_add(k * size)?;
        // A table that the file does not hold is itself what is missing.
        let (Some(offset), Some(length)) = (long(header.checked_add(8)?), long(header.checked_add(0x20)?)) else {
            break;
        };
        end = end.max(offset.saturating_add(length));
    }
    Some(end)
}

impl Plugin {
    /// The effect as its library gives it, derivatives included.
    pub fn table(&self) -> &CEffect {
        self.loaded.effect.effect()
    }

    /// The file.
    pub fn origin(&self) -> &Origin {
        &self.loaded.origin
    }

    /// What the library answers, with its own derivatives where asked for.
    fn answer(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        self.table().evaluate(context, input, theta, out, d_input, d_theta).map_err(|what| {
            self.loaded.effect.note(Fault {
                what,
                image: context.image.image,
                place: Fault::place_of(context.column_px, context.row_px, self.descriptor().stage, input),
            });
            OutsideDomain
        })
    }
}

impl Effect for Plugin {
    fn descriptor(&self) -> &Descriptor {
        self.table().descriptor()
    }

    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        if self.derivatives == Derivatives::Own {
            return self.answer(context, input, theta, out, d_input, d_theta);
        }
        self.answer(context, input, theta, out, None, None)?;
        if let Some(matrix) = d_input {
            let values = |x: &[f64], out: &mut [f64]| self.answer(context, x, theta, out, None, None);
            numeric::by_input(self.descriptor(), context, &values, input, out, matrix)?;
        }
        if let Some(matrix) = d_theta {
            let values = |x: &[f64], out: &mut [f64]| self.answer(context, input, x, out, None, None);
            numeric::by_theta(self.descriptor(), &values, theta, out, matrix)?;
        }
        Ok(())
    }

    fn reads_place(&self) -> [bool; 2] {
        self.loaded.reads_place
    }

    fn with_own_derivatives(&self) -> Option<Arc<dyn Effect>> {
        Some(Arc::new(Self { loaded: self.loaded.clone(), derivatives: Derivatives::Own }))
    }

    fn c_abi(&self) -> Option<*const std::ffi::c_void> {
        Some(self.loaded.effect.raw().cast())
    }

    fn origin(&self) -> Option<&Origin> {
        Some(&self.loaded.origin)
    }

    fn take_fault(&self) -> Option<Fault> {
        self.loaded.effect.take_fault()
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

    #[test]
    fn what_is_not_a_plug_in_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing.so");
        assert!(error(&missing).contains("missing.so: cannot be read: "));
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
             __attribute__((visibility(\"default\"))) const misclosure_effect* misclosure_plugin(void) {{ return \
             &table; }}\n"
        )
    }

    #[test]
    fn another_version_another_size_and_empty_tables_are_refused() {
        let sizes = "sizeof(misclosure_effect), sizeof(misclosure_parameter), sizeof(misclosure_name)";
        let cases = [
            (
                "1".to_string(),
                "made for version 1 of effect.h, this program has version 3 and reads 2: compile it again",
            ),
            ("4".to_string(), "made for version 4 of effect.h"),
            ("3, 8".to_string(), "struct misclosure_effect has 8 bytes"),
            // A table of version 3 that says that it is of version 2.
            (format!("2, {sizes}"), "struct misclosure_effect has 144 bytes, expected 112"),
            (format!("3, {sizes}, 16"), "struct misclosure_context has 16 bytes"),
            (format!("3, {sizes}, sizeof(misclosure_context), 0, 0, 1"), "has no valid parameters"),
            (format!("3, {sizes}, sizeof(misclosure_context)"), "has no valid id"),
        ];
        for (fields, expected) in cases {
            let folder = tempfile::tempdir().unwrap();
            let message = error(&compile(folder.path(), &table(&fields), "c", &[]));
            assert!(message.contains(expected), "{message}");
        }
    }
}
