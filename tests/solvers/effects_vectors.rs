//! The effects against measurements that another program made under one effect each: formulas, signs and contexts.
//!
//! Every folder of `../shared/vectors` is a block with exact measurements at the true poses, points and camera. With
//! the effect at the values of its `case.json` the whole chain must meet the measurements to rounding; without it, it
//! must miss them by what is stated there.

use crate::beside;
use misclosure::block::{Block, Image, ImageId, Measurement};
use misclosure::camera::fraser;
use misclosure::effects::{
    BlockContext, Context, Effect, ImageContext, Parameter, Role, Scope, Stage, SurveyedKind, find,
};
use misclosure::io::block::read_block;
use misclosure::math::rotation::{exp, log};
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Rounding at 5000 px is 1e-12 px, and a chain of a few hundred operations loses little of that; 5e-12 px was met.
const IMAGE_TOLERANCE_PX: f64 = 1e-9;
/// Rounding at coordinates of 100 m is 1e-14 m; less than 1e-15 m was met.
const POSITION_TOLERANCE_M: f64 = 1e-12;
/// What `case.json` states is measured on exact values.
const CHANGE_TOLERANCE: f64 = 0.01;

/// `in=control` of the effects of the frame stage.
const IN_CONTROL: f64 = 1.0;

/// An effect and one set of parameter values per image.
struct Term {
    effect: &'static dyn Effect,
    theta: Vec<Vec<f64>>,
}

/// A block at its true values.
struct Case {
    block: Block,
    /// True coordinates of the surveyed points.
    surveyed: Vec<Vector3<f64>>,
    /// `[r, C]` of every image.
    poses: Vec<Vec<f64>>,
    contexts: Vec<ImageContext>,
    constants: BlockContext,
    stated: serde_json::Value,
}

fn mean(values: impl ExactSizeIterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let count = values.len() as f64;
    values.sum::<Vector3<f64>>() / count
}

/// First and last of some times.
fn span(times: impl Iterator<Item = f64>) -> [f64; 2] {
    times.fold([f64::MAX, f64::MIN], |[first, last], time| [first.min(time), last.max(time)])
}

fn contexts(block: &Block) -> Vec<ImageContext> {
    let time = |image: &Image| image.time_s.expect("a time");
    let count = block.images.len() as f64;
    let mean_time = block.images.iter().map(time).sum::<f64>() / count;
    let [first, last] = span(block.images.iter().map(time));
    let context = |(index, image): (usize, &Image)| {
        let camera = block.camera_of(ImageId::from(index));
        let [start, end] = span(block.images.iter().filter(|other| other.flight == image.flight).map(time));
        ImageContext {
            image: index as u32,
            flight: image.flight.0,
            width_px: camera.width_px.into(),
            height_px: camera.height_px.into(),
            time_s: time(image),
            tau: (time(image) - mean_time) / (last - first),
            tau_order: index as f64 / (count - 1.0) - 0.5,
            flight_time_s: time(image) - start,
            flight_span_s: end - start,
            temperature_c: image.temperature_c.expect("a temperature"),
            velocity: image.velocity.expect("a velocity"),
            ..Default::default()
        }
    };
    block.images.iter().enumerate().map(context).collect()
}

fn constants(block: &Block) -> BlockContext {
    let mut history: Vec<[f64; 2]> =
        block.images.iter().filter_map(|image| Some([image.time_s?, image.temperature_c?])).collect();
    history.sort_by(|a, b| a[0].total_cmp(&b[0]));
    BlockContext {
        centre: mean(block.images.iter().map(|image| image.pose.centre)),
        survey_centre: mean(block.surveyed.iter().map(|point| point.position)),
        counts: [block.images.len(), block.flights.len(), block.cameras.len()].map(|count| count as u32),
        mean_temperature_c: history.iter().map(|row| row[1]).sum::<f64>() / history.len() as f64,
        temperature_history: history,
    }
}

impl Case {
    fn read(folder: &Path) -> Self {
        let loaded = read_block(folder).expect("a block");
        assert!(loaded.set_aside.is_empty(), "{}", loaded.set_aside);
        let block = loaded.block;
        // The survey of the block without effect is the truth.
        let truth = read_block(&folder.join("../none")).expect("a block").block.surveyed;
        assert!(truth.iter().map(|point| &point.name).eq(block.surveyed.iter().map(|point| &point.name)));
        let stated = std::fs::read_to_string(folder.join("case.json")).expect("case.json");
        let pose = |image: &Image| {
            let r = log(image.pose.rotation.to_rotation_matrix().matrix());
            [r.as_slice(), image.pose.centre.as_slice()].concat()
        };
        Self {
            surveyed: truth.iter().map(|point| point.position).collect(),
            poses: block.images.iter().map(pose).collect(),
            contexts: contexts(&block),
            constants: constants(&block),
            stated: serde_json::from_str(&stated).expect("JSON"),
            block,
        }
    }

    /// The effect of the case at its values, of which none may be left over.
    fn term(&self) -> Option<Term> {
        let effect = find(self.stated["effect"].as_str()?).expect("an effect of the catalogue");
        let values = self.stated["parameters"].as_object().expect("parameters");
        let mut used = BTreeSet::new();
        let mut value = |image: &Image, parameter: &Parameter| {
            let name = &parameter.name;
            let key = match parameter.scope {
                Scope::Global => name.to_string(),
                Scope::Flight | Scope::FlightButFirst => {
                    format!("{name}[{}]", self.block.flights[image.flight.index()])
                }
                Scope::Camera => format!("{name}[{}]", self.block.cameras[image.camera.index()].id),
                Scope::Image => format!("{name}[{}]", image.name),
            };
            let found = values.get(&key).and_then(serde_json::Value::as_f64);
            let first_flight = parameter.scope == Scope::FlightButFirst && image.flight.0 == 0;
            let optional = matches!(parameter.role, Role::Given(_) | Role::VelocityError) || first_flight;
            assert!(found.is_some() || optional, "no value of {key}");
            used.insert(key);
            // The other program's map has the survey alone.
            let default = if *name == "in" { IN_CONTROL } else { parameter.nominal };
            found.unwrap_or(default)
        };
        let parameters = &effect.descriptor().parameters;
        let images = self.block.images.iter();
        let theta = images.map(|image| parameters.iter().map(|p| value(image, p)).collect()).collect();
        let unused: Vec<_> = values.keys().filter(|key| !used.contains(*key)).collect();
        assert!(unused.is_empty(), "unknown parameters {unused:?}");
        Some(Term { effect, theta })
    }

    /// One stage of the chain: the effect if it acts there, else the identity.
    fn stage(&self, term: Option<&Term>, stage: Stage, image: usize, observed: [f64; 2], input: &[f64]) -> Vec<f64> {
        self.stage_of(term, stage, None, image, observed, input)
    }

    /// The same; at the frame stage of a kind of surveyed coordinate.
    fn stage_of(
        &self,
        term: Option<&Term>,
        stage: Stage,
        surveyed: Option<SurveyedKind>,
        image: usize,
        observed: [f64; 2],
        input: &[f64],
    ) -> Vec<f64> {
        let offset = stage.identity_offset();
        let mut out = input[offset..offset + stage.outputs()].to_vec();
        if let Some(term) = term.filter(|term| term.effect.descriptor().stage == stage) {
            let [column_px, row_px] = observed;
            let (block, image_context) = (&self.constants, &self.contexts[image]);
            let context = Context { block, image: image_context, column_px, row_px, surveyed };
            term.effect.eval(&context, input, &term.theta[image], &mut out, None, None).expect("inside the domain");
        }
        out
    }

    /// The whole chain of an image measurement.
    fn predict(&self, term: Option<&Term>, measurement: &Measurement, point: &Vector3<f64>) -> Vec<f64> {
        let image = measurement.image.index();
        let observed = [measurement.x, measurement.y];
        let pose = self.stage(term, Stage::Exposure, image, observed, &self.poses[image]);
        let seen = self.stage(term, Stage::Ray, image, observed, &[&pose, point.as_slice()].concat());
        let interior = &self.block.camera_of(measurement.image).interior;
        let interior = self.stage(term, Stage::Interior, image, observed, &[interior, &pose[..3]].concat());
        let interior: [f64; 12] = interior.try_into().expect("twelve");
        let from_centre = Vector3::from_vec(seen) - Vector3::from_column_slice(&pose[3..]);
        let in_camera = exp(&Vector3::from_column_slice(&pose[..3])) * from_centre;
        let ideal = fraser::project(&interior, in_camera.into()).expect("before the camera");
        self.stage(term, Stage::Image, image, observed, &[&ideal[..], &interior].concat())
    }

    /// Largest residual of image points (px), antenna positions and surveyed coordinates (m), in any one coordinate.
    fn largest_residuals(&self, term: Option<&Term>) -> [f64; 3] {
        let mut largest = [0.0_f64; 3];
        let mut note = |group: usize, residual: &[f64]| {
            assert!(residual.iter().all(|value| value.is_finite()));
            largest[group] = residual.iter().fold(largest[group], |most, value| most.max(value.abs()));
        };
        let ties = self.block.ties.iter().map(|tie| (tie, self.block.tie_points[tie.point.index()].position));
        let marks = self.block.marks.iter().map(|mark| (mark, Some(self.surveyed[mark.point.index()])));
        for (measurement, point) in ties.chain(marks) {
            let predicted = self.predict(term, measurement, &point.expect("points.csv has every tie point"));
            note(0, &[predicted[0] - measurement.x, predicted[1] - measurement.y]);
        }
        let none = [f64::NAN; 2];
        for (index, image) in self.block.images.iter().enumerate() {
            let antenna = self.stage(term, Stage::Position, index, none, &self.poses[index]);
            let kind = Some(SurveyedKind::Antenna);
            let antenna = Vector3::from_vec(self.stage_of(term, Stage::Frame, kind, index, none, &antenna));
            note(1, (antenna - image.gnss.expect("a position").position).as_slice());
        }
        for (point, truth) in self.block.surveyed.iter().zip(&self.surveyed) {
            let surveyed = self.stage(term, Stage::Control, 0, none, truth.as_slice());
            let kind = Some(SurveyedKind::Point);
            let surveyed = Vector3::from_vec(self.stage_of(term, Stage::Frame, kind, 0, none, &surveyed));
            note(2, (surveyed - point.position).as_slice());
        }
        largest
    }
}

#[test]
fn effects_meet_the_measurements_of_another_program() {
    let Some(folder) = beside::shared("vectors") else { return };
    let mut folders: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    folders.sort();
    assert!(!folders.is_empty());
    let tolerances = [IMAGE_TOLERANCE_PX, POSITION_TOLERANCE_M, POSITION_TOLERANCE_M];
    let keys = ["largest_change_px", "largest_change_gnss_m", "largest_change_survey_m"];
    let mut wrong = Vec::new();
    for folder in folders {
        let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
        let case = Case::read(&folder);
        let with = case.largest_residuals(case.term().as_ref());
        let without = case.largest_residuals(None);
        println!("{name}: with {with:?}, without {without:?}");
        for group in 0..3 {
            if with[group] > tolerances[group] {
                wrong.push(format!("{name}: with the effect {:e} is left, {}", with[group], keys[group]));
            }
            let stated = case.stated[keys[group]].as_f64().expect("a number");
            let found = without[group];
            if (found - stated).abs() > CHANGE_TOLERANCE * stated + tolerances[group] {
                wrong.push(format!("{name}: without the effect {found:e} is left, stated {stated:e}, {}", keys[group]));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
