//! The model options of `adjust`, `diagnose` and `improve`, and the [`Model`] that they describe.

use super::plugins::load_plugins;
use super::words::{effect_term, indices};
use super::{Host, Usage};
#[cfg(feature = "ceres")]
use crate::adjust::ceres::Ceres;
use crate::adjust::native::Native;
use crate::adjust::{Options, Solver};
use crate::block::Block;
use crate::camera::PARAMETER_COUNT;
use crate::effects;
use crate::io::model::read_model;
use crate::model::{Datum, EffectRef, Loss, Model, TieWeights};
use crate::problem::start_interiors;
use crate::run::folder::{self, OutlierRow};
use crate::run::multistart::{best_start, doubtful_cameras};
use crate::run::start_focal::focal_lengths;
use crate::run::start_values::{Doubt, doubts};
use crate::run::{Run, RunError, set_aside};
use clap::builder::{EnumValueParser, TypedValueParser};
use std::path::{Path, PathBuf};

/// Options that describe a model. What is not given stays as `--model` says, else as by default.
#[derive(Debug, Clone, Default, PartialEq, clap::Args)]
#[command(next_help_heading = "Model options")]
pub struct ModelOptions {
    /// Model to begin with; the other options change it
    #[arg(long, value_name = "model.toml")]
    pub model: Option<PathBuf>,
    /// Free camera parameters; the others are held. Names of `f pp dc radial decentring affinity all none`, or single
    /// ones as `k1`, separated by commas [default: all]
    #[arg(long, value_name = "LIST")]
    pub free: Vec<String>,
    /// Camera parameters to hold, taken from those that are free
    #[arg(long, value_name = "LIST")]
    pub fix: Vec<String>,
    /// `dc=pp`: the centre of distortion is the principal point and moves with it (the ten-parameter form)
    #[arg(long, value_name = "dc=pp")]
    pub tie: Option<Tie>,
    /// Effect to add, with start values where the nominal ones do not serve (repeatable; see `misclosure effects`)
    #[arg(long, value_name = "EFFECT[:param=start,...]")]
    pub add: Vec<String>,
    #[cfg_attr(feature = "ceres", doc = "Solver; `both` compares the two and ends with code 4 where they disagree")]
    #[cfg_attr(not(feature = "ceres"), doc = "Solver; this build has no Ceres")]
    #[arg(long, value_parser = SolverChoice::parser(), default_value = SolverChoice::DEFAULT)]
    pub solver: SolverChoice,
    /// Shared library of an effect, to be named with --add or in --model (repeatable)
    #[arg(long, value_name = "FILE.so")]
    pub plugin: Vec<PathBuf>,
    /// What defines position, orientation and scale [default: free for adjust; all for diagnose and improve]
    #[arg(long)]
    pub datum: Option<Datum>,
    /// Robust loss on image measurements [default: none]
    #[arg(long)]
    pub loss: Option<Loss>,
    /// Treatment of outliers [default: none for adjust, which names them; snoop for diagnose and improve]
    #[arg(long, value_enum)]
    pub outliers: Option<Treatment>,
    /// Start from half to twice the focal length, and go on from the best: where its start value is in doubt. Where
    /// most tie points lie behind the images, also with the images turned and the base reversed
    #[arg(long)]
    pub multistart: bool,
    /// Weights of tie points by the number m of their images: 1, m (m - 1), m (m - 1)^2 [default: unit]
    #[arg(long, value_name = "WEIGHTS")]
    pub tie_weights: Option<TieWeights>,
}

/// Which solvers adjust.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum SolverChoice {
    /// Both; results are compared.
    #[cfg_attr(feature = "ceres", default)]
    #[cfg_attr(not(feature = "ceres"), value(hide = true))]
    Both,
    /// Ceres with SuiteSparse.
    #[cfg_attr(not(feature = "ceres"), value(hide = true))]
    Ceres,
    /// The native solver.
    #[cfg_attr(not(feature = "ceres"), default)]
    Native,
}

impl SolverChoice {
    /// Its name on the command line, where none is given.
    pub const DEFAULT: &str = if cfg!(feature = "ceres") { "both" } else { "native" };

    /// Reads a choice and refuses one that this build does not have.
    pub fn parser() -> impl TypedValueParser<Value = Self> {
        EnumValueParser::<Self>::new().try_map(|choice| match choice.found() {
            Some(_) => Ok(choice),
            None => Err("this build has the native solver alone; build it with Cargo's feature ceres"),
        })
    }

    /// The solvers; results are taken from the first.
    pub fn solvers(self) -> Vec<&'static dyn Solver> {
        self.found().expect("the parser refuses what this build does not have")
    }

    /// `None` where this build does not have them.
    fn found(self) -> Option<Vec<&'static dyn Solver>> {
        match self {
            SolverChoice::Native => Some(vec![&Native]),
            #[cfg(feature = "ceres")]
            SolverChoice::Both => Some(vec![&Native, &Ceres]),
            #[cfg(feature = "ceres")]
            SolverChoice::Ceres => Some(vec![&Ceres]),
            #[cfg(not(feature = "ceres"))]
            SolverChoice::Both | SolverChoice::Ceres => None,
        }
    }
}

/// Treatment of outliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Treatment {
    /// Data snooping sets outliers aside, one by one.
    Snoop,
    /// Huber's loss reduces their weight (as --loss huber).
    Huber,
    /// Outliers stay in the adjustment.
    None,
}

/// The one tie there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Tie {
    /// The centre of distortion to the principal point.
    #[value(name = "dc=pp")]
    DcToPp,
}

macro_rules! value_enum {
    ($type:ty: $($variant:path = $name:literal $help:literal),+) => {
        impl clap::ValueEnum for $type {
            fn value_variants<'a>() -> &'a [Self] { &[$($variant),+] }
            fn to_possible_value(&self) -> Option<clap::builder::PossibleValue> {
                Some(match self { $($variant => clap::builder::PossibleValue::new($name).help($help)),+ })
            }
        }
    };
}
value_enum!(Datum:
    Datum::Free = "free" "tie points alone, then a similarity from the control points",
    Datum::Control = "control" "control points as weighted observations",
    Datum::Gnss = "gnss" "GNSS positions as weighted observations",
    Datum::All = "all" "whatever the block has of the two");
value_enum!(Loss:
    Loss::None = "none" "least squares",
    Loss::Huber = "huber" "linear beyond the scale",
    Loss::Cauchy = "cauchy" "logarithmic beyond the scale");
value_enum!(TieWeights:
    TieWeights::Unit = "unit" "by sigma alone",
    TieWeights::Multi = "multi" "as MicMac weights multi-points",
    TieWeights::Pairs = "pairs" "as MicMac weights points that come as pairs");

impl ModelOptions {
    /// The model that the options describe; `datum` where neither they nor `--model` say one.
    ///
    /// # Errors
    /// [`Usage`], and what is wrong with the file of `--model`.
    pub fn model(&self, datum: Datum) -> anyhow::Result<Model> {
        let plugins = load_plugins(&self.plugin)?;
        let plugged = |id: &str| plugins.iter().find(|effect| effect.descriptor().id == id).cloned();
        let find = |id: &str| effects::find(id).map(EffectRef::Builtin).or_else(|| plugged(id).map(EffectRef::Plugin));
        let base = match &self.model {
            Some(path) => read_model(path, &find)?,
            None => Model { datum, ..Model::default() },
        };
        Ok(self.apply(base, &find)?)
    }

    /// The block without what the run that `--model` belongs to set aside, and that; says so.
    ///
    /// # Errors
    /// An `outliers.csv` beside the model that cannot be read, or is not of this block.
    pub fn without_outliers(&self, block: Block, host: &dyn Host) -> anyhow::Result<(Block, Vec<OutlierRow>)> {
        let beside = self.model.as_ref().map(|model| model.parent().unwrap_or(Path::new("")));
        let Some((file, rows)) = beside.map(folder::read_outliers).transpose()?.flatten() else {
            return Ok((block, Vec::new()));
        };
        let left = set_aside::without(&block, &rows, &file)?;
        host.message(&format!("{} measurements are set aside, as {} says", rows.len(), file.display()));
        Ok((left, rows))
    }

    /// Says what is doubtful of the start values.
    ///
    /// # Errors
    /// A camera of the model that the block does not have.
    pub fn judge_start(&self, block: &Block, model: &Model, host: &dyn Host) -> Result<(), RunError> {
        let interiors = start_interiors(block, model)?;
        let mut doubts = doubts(block, &interiors);
        // Where cameras look another way, rays meet at no focal length.
        if !doubts.iter().any(|doubt| matches!(doubt, Doubt::Behind { .. })) {
            match focal_lengths(block, model, &interiors) {
                Ok(judged) => {
                    doubts.extend(judged.doubts);
                    for (camera, factor) in judged.untold {
                        host.message(&format!(
                            "The focal length that camera {camera} starts with cannot be judged: its rays meet about \
                             as well at {factor} times it"
                        ));
                    }
                }
                Err(error) => {
                    let text = "The focal lengths that the cameras start with cannot be judged";
                    host.message(&format!("{text}: {error}"));
                }
            }
        }
        for doubt in doubts {
            host.message(&format!("WARNING: the start values are in doubt: {doubt}{}", self.advice()));
        }
        Ok(())
    }

    /// Block and model with the best start values, where `--multistart` asks for others than their own.
    ///
    /// # Errors
    /// A block of which no problem can be made.
    pub fn started(
        &self,
        block: Block,
        model: Model,
        options: &Options,
        tell: &dyn Fn(&str),
    ) -> Result<(Block, Model), RunError> {
        if self.multistart { best_start(&block, &model, &Native, options, tell) } else { Ok((block, model)) }
    }

    /// What can be done where start values are in doubt.
    fn advice(&self) -> &'static str {
        if self.multistart { "" } else { "; --multistart tries other start values" }
    }

    /// Says where a camera ended so far from its start values that these are in doubt.
    pub fn doubts(&self, block: &Block, run: &Run, host: &dyn Host) {
        let cameras = doubtful_cameras(block, &run.solution().state.interiors);
        if !cameras.is_empty() {
            host.message(&format!("WARNING: the start values are in doubt: {}{}", cameras.join(", "), self.advice()));
        }
    }

    /// The effects of `--plugin`, as candidates of a diagnosis.
    ///
    /// # Errors
    /// A library that cannot be loaded, or an id that is taken.
    pub fn plugin_effects(&self) -> anyhow::Result<Vec<EffectRef>> {
        Ok(load_plugins(&self.plugin)?.into_iter().map(EffectRef::Plugin).collect())
    }

    /// The solvers; results are taken from the first.
    pub fn solvers(&self) -> Vec<&'static dyn Solver> {
        self.solver.solvers()
    }

    /// The model: `base` (of `--model`, or the default) as the options change it.
    ///
    /// # Errors
    /// [`Usage`] names what is unknown and lists what there is.
    pub fn apply(&self, base: Model, find: &dyn Fn(&str) -> Option<EffectRef>) -> Result<Model, Usage> {
        let mut model = base;
        if !self.free.is_empty() {
            model.free = [false; PARAMETER_COUNT];
            indices(&self.free, "--free")?.into_iter().for_each(|k| model.free[k] = true);
        }
        indices(&self.fix, "--fix")?.into_iter().for_each(|k| model.free[k] = false);
        model.tie_dc_to_pp |= self.tie == Some(Tie::DcToPp);
        for text in &self.add {
            let term = effect_term("--add", text, find)?;
            let id = &term.effect.descriptor().id;
            if model.effects.iter().any(|other| other.effect.descriptor().id == *id) {
                return Err(Usage(format!("--add {text}: the model has `{id}` already")));
            }
            model.effects.push(term);
        }
        model.datum = self.datum.unwrap_or(model.datum);
        if let (Some(Treatment::Huber), Some(Loss::None | Loss::Cauchy)) = (self.outliers, self.loss) {
            return Err(Usage("--outliers huber: --loss asks for another loss".into()));
        }
        model.loss = match self.outliers {
            Some(Treatment::Huber) => Loss::Huber,
            _ => self.loss.unwrap_or(model.loss),
        };
        model.tie_weights = self.tie_weights.unwrap_or(model.tie_weights);
        Ok(model)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::PARAMETERS;
    use crate::effects::{Context, Kind, OutsideDomain, Picture, Scope, Stage};
    use crate::effects::{Descriptor, Effect, Parameter, Role};
    use clap::Parser;
    use std::sync::Arc;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        options: ModelOptions,
    }

    struct Drift(Descriptor);

    impl Effect for Drift {
        fn descriptor(&self) -> &Descriptor {
            &self.0
        }
        fn eval(
            &self,
            _: &Context<'_>,
            _: &[f64],
            _: &[f64],
            _: &mut [f64],
            _: Option<&mut [f64]>,
            _: Option<&mut [f64]>,
        ) -> Result<(), OutsideDomain> {
            Err(OutsideDomain)
        }
    }

    fn find(id: &str) -> Option<EffectRef> {
        let parameter = |name: &'static str, role| Parameter {
            name: name.into(),
            unit: "px".into(),
            scope: Scope::Flight,
            nominal: 0.0,
            typical: 1.0,
            role,
            plausible: None,
        };
        let given = Role::Given((&[("time", 0.0), ("order", 1.0)]).into());
        let descriptor = Descriptor {
            id: "drift".into(),
            stage: Stage::Interior,
            kind: Kind::Physical,
            summary: "".into(),
            formula: "".into(),
            parameters: vec![parameter("a", Role::Estimated), parameter("against", given)],
            needs: Vec::new(),
            confused_with: "".into(),
            source: "".into(),
            picture: Picture::Sensor,
            words: None,
        };
        (id == "drift").then(|| EffectRef::Plugin(Arc::new(Drift(descriptor))))
    }

    fn model(arguments: &[&str]) -> Result<Model, Usage> {
        let line = Line::try_parse_from(["x"].iter().chain(arguments)).expect("a valid command line");
        line.options.apply(Model::default(), &find)
    }

    #[test]
    fn nothing_given_is_the_default() {
        let (model, default) = (model(&[]).unwrap(), Model::default());
        assert_eq!(format!("{model:?}"), format!("{default:?}"));
    }

    #[test]
    fn free_replaces_and_fix_takes_away() {
        let free = model(&["--free", "f,radial", "--fix", "k3"]).unwrap().free;
        let names: Vec<&str> = PARAMETERS.iter().zip(free).filter(|(_, free)| *free).map(|(name, _)| *name).collect();
        assert_eq!(names, ["f", "k1", "k2"]);
        assert_eq!(model(&["--free", "none"]).unwrap().free, [false; PARAMETER_COUNT]);
        assert_eq!(model(&["--fix", "f pp", "--fix", "k1"]).unwrap().free.iter().filter(|free| **free).count(), 8);
    }

    #[test]
    fn effects_take_start_values_and_named_ones() {
        let model = model(&["--add", "drift:a=1.5,a[nadir]=-2e-1,against=order", "--tie", "dc=pp"]).unwrap();
        let values: Vec<(&str, f64)> = model.effects[0].values.iter().map(|(key, v)| (key.as_str(), *v)).collect();
        assert_eq!(values, [("a", 1.5), ("a[nadir]", -0.2), ("against", 1.0)]);
        assert!(model.tie_dc_to_pp);
    }

    #[test]
    fn what_is_unknown_is_named_with_what_there_is() {
        let message = |arguments: &[&str]| model(arguments).unwrap_err().0;
        assert!(message(&["--free", "f,q"]).starts_with("--free q: no such parameter; there are the groups f pp dc"));
        assert!(message(&["--add", "wind"]).starts_with("--add wind: unknown effect `wind`; the catalogue has:"));
        assert!(message(&["--add", "drift:b=1"]).ends_with("`drift` has no parameter `b`; it has: a, against"));
        assert!(message(&["--add", "drift:a"]).ends_with("`a` is not of the form param=value"));
        assert!(message(&["--add", "drift:a=NaN"]).ends_with("`a=NaN`: expected a number (px)"));
        assert!(message(&["--add", "drift:against=x"]).ends_with("expected a number (px) or `time` or `order`"));
        assert!(message(&["--add", "drift:against=-7"]).ends_with("`against=-7`: expected 0 (time) or 1 (order)"));
        assert!(message(&["--add", "drift:a=1,a=2"]).ends_with("`a` stands there twice"));
        assert!(message(&["--add", "drift", "--add", "drift"]).ends_with("the model has `drift` already"));
    }
}
