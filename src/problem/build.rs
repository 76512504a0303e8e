//! From a block and a model to the problem.

use super::align::Pair;
use super::context::{block_context, image_contexts};
use super::order::ranks_along_block;
use super::{
    CameraPrior, EffectInstance, ImageObservation, MeasurementKind, PointSource, PositionObservation, Problem, State,
    ThetaEntry,
};
use crate::block::{Block, Measurement, PointId, Role};
use crate::camera::{self, Camera, Interior, undistort::undistort};
use crate::effects::{self, ImageContext, Need, Scope};
use crate::math::intersect::intersect_rays;
use crate::model::{Datum, EffectTerm, Model, PRIOR_KEY, TieWeights};
use nalgebra::Vector3;

/// Why a block and a model do not make a problem.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// A datum without its observations.
    #[error("datum `{datum}` needs {needs}, and the block has none; use --datum free")]
    Datum {
        /// Its name.
        datum: &'static str,
        /// What it needs.
        needs: &'static str,
    },
    /// A name of the model that the block does not have.
    #[error("the model names {kind} `{name}`, which the block does not have{hint}")]
    Unknown {
        /// camera, parameter, ...
        kind: &'static str,
        /// The name.
        name: String,
        /// `; it has ...`, or empty.
        hint: String,
    },
    /// An effect whose observations the block lacks.
    #[error("effect `{effect}` needs {needs}")]
    Need {
        /// Id.
        effect: String,
        /// What is missing.
        needs: &'static str,
    },
    /// A value that cannot be used.
    #[error("{0}")]
    Value(String),
    /// Nothing to adjust.
    #[error("no point is measured in two images: nothing to adjust")]
    Empty,
    /// A tie point without coordinates whose rays do not meet.
    #[error(
        "tie point `{point}` has no approximate coordinates and its rays do not meet in front of the cameras; give it a row in points.csv or remove it"
    )]
    NoIntersection {
        /// Name.
        point: String,
    },
}

/// What of an effect's needs the block lacks under a datum; `None`: it can be tested.
pub fn missing_need(block: &Block, contexts: &[ImageContext], need: Need, datum: Datum) -> Option<&'static str> {
    let known = |value: fn(&ImageContext) -> f64| contexts.iter().all(|context| !value(context).is_nan());
    let controls = block.count(Role::Control) > 0;
    let gnss = block.images.iter().any(|image| image.gnss.is_some());
    let uses_control = controls && matches!(datum, Datum::Control | Datum::All);
    let uses_gnss = gnss && matches!(datum, Datum::Gnss | Datum::All);
    let (met, what) = match need {
        Need::Time => (known(|c| c.time_s), "time_s of every image"),
        Need::Temperature => (known(|c| c.temperature_c), "temperature_c of every image"),
        Need::Flights => (block.flights.len() > 1, "at least two flights"),
        Need::Velocity => (known(|c| c.velocity.x), "vx, vy, vz, or times of at least two images of every flight"),
        Need::Gnss => (uses_gnss, "GNSS positions, in a datum that uses them"),
        Need::Control => (uses_control, "control points, in a datum that uses them"),
        Need::Vertical => (uses_control || uses_gnss, "a datum that is not free"),
    };
    (!met).then_some(what)
}

/// Value of the option `against` that takes an image's place in the table instead of its time.
const AGAINST_ORDER: f64 = 1.0;

impl Problem {
    /// This problem at `state` with further effects at their start values (absent: nominal), numbered after those that it has.
    pub fn with_effects(
        &self,
        block: &Block,
        datum: Datum,
        terms: &[EffectTerm],
        state: &State,
    ) -> Result<(Problem, State), ProblemError> {
        let mut problem = self.clone();
        problem.start = state.clone();
        for term in terms {
            problem.add_effect(block, datum, term)?;
        }
        let state = problem.start.clone();
        Ok((problem, state))
    }

    /// Lays out the least-squares problem. Tie points with fewer than two rays, and images without any measurement, do not take part.
    pub fn new(block: &Block, model: &Model) -> Result<Self, ProblemError> {
        let (uses_control, uses_gnss) = datum_parts(block, model.datum)?;
        let contexts = image_contexts(block);
        let (interiors, camera_free) = cameras(block, model)?;
        let poses: Vec<_> = block.images.iter().map(|image| image.pose).collect();
        let ranks = ranks_along_block(&poses.iter().map(|pose| pose.centre).collect::<Vec<_>>());

        let mut points = collect_points(block, model, uses_control, &ranks);
        set_aside_unoriented(block, uses_gnss, &mut points);
        if points.iter().all(|point| point.observations.len() < 2) {
            return Err(ProblemError::Empty);
        }
        let mut point_start = vec![0];
        let mut observations = Vec::with_capacity(points.iter().map(|point| point.observations.len()).sum());
        let mut positions = Vec::with_capacity(points.len());
        for point in &points {
            observations.extend_from_slice(&point.observations);
            point_start.push(observations.len());
            positions.push(start_position(block, &interiors, point)?);
        }

        let control =
            if uses_control { control_observations(block, &points, model.sigma_factors.control) } else { Vec::new() };
        let mut problem = Problem {
            camera_names: block.cameras.iter().map(|camera| camera.id.clone()).collect(),
            camera_free,
            camera_scales: block.cameras.iter().map(Camera::scales).collect(),
            camera_domains: block.cameras.iter().map(Camera::domains).collect(),
            tie_dc_to_pp: model.tie_dc_to_pp,
            image_names: block.images.iter().map(|image| image.name.clone()).collect(),
            image_contexts: contexts,
            image_ranks: ranks,
            block_context: block_context(block),
            pose_free: vec![[true; 6]; block.images.len()],
            point_sources: points.iter().map(|point| point.source).collect(),
            point_names: points.iter().map(|point| point_name(block, point.source)).collect(),
            point_start,
            observations,
            control,
            gnss: Vec::new(),
            effects: Vec::new(),
            theta: Vec::new(),
            camera_priors: camera_priors(block, model)?,
            loss: model.loss,
            start: State { interiors, theta: Vec::new(), poses, points: positions },
            datum_defect: 0,
        };
        problem.hold_unmeasured_images();
        if uses_gnss {
            problem.gnss = gnss_observations(block, &problem.pose_free, model.sigma_factors.gnss);
        }
        if uses_control || uses_gnss {
            let pairs = problem.observed_pairs(block);
            problem.align_start(&pairs);
        } else {
            problem.hold_datum();
        }
        for term in &model.effects {
            problem.add_effect(block, model.datum, term)?;
        }
        Ok(problem)
    }

    /// Names of the images that take no part: without measurements, or with too few to orient them. Their poses stay as they were given.
    pub fn images_without_part(&self) -> Vec<&str> {
        let mut measured = vec![false; self.image_names.len()];
        for observation in &self.observations {
            measured[observation.image as usize] = true;
        }
        self.image_names.iter().zip(measured).filter(|(_, measured)| !measured).map(|(name, _)| name.as_str()).collect()
    }

    /// Images that its measurements cannot orient; those without any are among them.
    pub fn unoriented_images(&self) -> Vec<bool> {
        let mut gnss = vec![false; self.image_names.len()];
        self.gnss.iter().for_each(|observation| gnss[observation.index as usize] = true);
        let points = (0..self.point_sources.len())
            .map(|j| (self.point_sources[j], &self.observations[self.point_start[j]..self.point_start[j + 1]]));
        unoriented(&gnss, points)
    }

    /// Images without a measurement keep their approximate pose; a camera that none of the measured images used keeps its parameters.
    fn hold_unmeasured_images(&mut self) {
        let mut measured = vec![false; self.pose_free.len()];
        for observation in &self.observations {
            measured[observation.image as usize] = true;
        }
        let mut used = vec![false; self.camera_free.len()];
        for (image, measured) in measured.iter().enumerate() {
            if *measured {
                used[self.image_contexts[image].camera as usize] = true;
            } else {
                self.pose_free[image] = [false; 6];
            }
        }
        for (free, used) in self.camera_free.iter_mut().zip(used) {
            if !used {
                *free = [false; 12];
            }
        }
    }

    /// Positions of the approximate block that were observed: projection centres, and control points intersected from their marks.
    fn observed_pairs(&self, block: &Block) -> Vec<Pair> {
        let centre = |observed: &PositionObservation| {
            Some(Pair::new(self.start.poses[observed.index as usize].centre, observed))
        };
        let point = |observed: &PositionObservation| {
            let j = observed.index as usize;
            let marks = &self.observations[self.point_start[j]..self.point_start[j + 1]];
            intersect(block, &self.start.interiors, marks).map(|source| Pair::new(source, observed))
        };
        self.gnss.iter().filter_map(centre).chain(self.control.iter().filter_map(point)).collect()
    }

    /// Minimal constraints: the pose of one image, and of the measured image farthest from it the coordinate in which they differ most.
    fn hold_datum(&mut self) {
        let measured: Vec<usize> = (0..self.pose_free.len()).filter(|image| self.pose_free[*image][0]).collect();
        let Some(&first) = measured.first() else { return };
        let base = self.start.poses[first].centre;
        let from_base = |image: usize| self.start.poses[image].centre - base;
        let farthest = measured.iter().copied().max_by(|a, b| from_base(*a).norm().total_cmp(&from_base(*b).norm()));
        self.pose_free[first] = [false; 6];
        if let Some(farthest) = farthest.filter(|farthest| *farthest != first) {
            self.pose_free[farthest][3 + from_base(farthest).iamax()] = false;
        }
        self.datum_defect = 7;
    }

    /// Adds an effect: its values in `theta`, start values from the term.
    fn add_effect(&mut self, block: &Block, datum: Datum, term: &EffectTerm) -> Result<(), ProblemError> {
        let descriptor = term.effect.descriptor();
        for need in &descriptor.needs {
            // An option may make a need void: focal-time against the order of images needs no times.
            let void = *need == Need::Time && term.values.get("against") == Some(&AGAINST_ORDER);
            if let Some(needs) = missing_need(block, &self.image_contexts, *need, datum).filter(|_| !void) {
                return Err(ProblemError::Need { effect: descriptor.id.to_string(), needs });
            }
        }
        let mut known: Vec<String> = Vec::new();
        let mut slots = Vec::new();
        let effect = self.effects.len() as u32;
        for (p, parameter) in descriptor.parameters.iter().enumerate() {
            slots.push((parameter.scope, self.theta.len() as u32));
            let names: Vec<Option<&str>> = match parameter.scope {
                Scope::Global => vec![None],
                Scope::Camera => block.cameras.iter().map(|camera| Some(camera.id.as_str())).collect(),
                Scope::Flight | Scope::FlightButFirst => block.flights.iter().map(|name| Some(name.as_str())).collect(),
                Scope::Image => block.images.iter().map(|image| Some(image.name.as_str())).collect(),
            };
            let given = matches!(parameter.role, effects::Role::Given(_));
            let weak = term.values.get(PRIOR_KEY).filter(|_| parameter.role == effects::Role::Estimated);
            let held = term.held.iter().any(|name| *name == parameter.name);
            let prior_sigma = match &parameter.role {
                effects::Role::Random(sigma) => {
                    known.push((*sigma).to_string());
                    let value = term.values.get(*sigma).copied().unwrap_or(parameter.typical);
                    if value.is_nan() || value <= 0.0 {
                        return Err(ProblemError::Value(format!(
                            "effect `{}`: {sigma} is a standard deviation, expected above 0, got {value}",
                            descriptor.id
                        )));
                    }
                    Some(value)
                }
                _ => weak.map(|factor| factor * parameter.typical.abs()),
            };
            for (instance, name) in names.iter().enumerate() {
                let short = name.map_or_else(|| parameter.name.to_string(), |n| format!("{}[{n}]", parameter.name));
                let of_term = term.values.get(&short).or_else(|| term.values.get(parameter.name.as_ref()));
                let reference = parameter.scope == Scope::FlightButFirst && instance == 0;
                // A random effect's typical size is that of its standard deviation.
                let start = if reference { parameter.nominal } else { *of_term.unwrap_or(&self.nominal(parameter)) };
                self.start.theta.push(start);
                self.theta.push(ThetaEntry {
                    effect,
                    parameter: p as u32,
                    instance: instance as u32,
                    name: format!("{}.{short}", descriptor.id),
                    free: !given && !held && !reference,
                    scale: parameter.typical.abs(),
                    prior_sigma: prior_sigma.filter(|_| !held),
                    prior_mean: parameter.nominal,
                });
                known.push(short);
            }
            known.push(parameter.name.to_string());
        }
        known.push(PRIOR_KEY.to_string());
        if let Some(factor) = term.values.get(PRIOR_KEY).filter(|factor| factor.is_nan() || **factor <= 0.0) {
            let text = format!("effect `{}`: {PRIOR_KEY} is {factor}, expected above 0", descriptor.id);
            return Err(ProblemError::Value(text));
        }
        let unknown = term.values.keys().chain(&term.held).find(|name| !known.contains(name));
        if let Some(name) = unknown {
            let names: Vec<&str> = descriptor.parameters.iter().map(|p| p.name.as_ref()).collect();
            let hint = format!("; effect `{}` has {}", descriptor.id, names.join(", "));
            return Err(ProblemError::Unknown { kind: "parameter", name: name.clone(), hint });
        }
        self.effects.push(EffectInstance { effect: term.effect.clone(), slots });
        Ok(())
    }

    /// Default of a parameter; a searched one starts in the middle of its domain on the first camera's sensor.
    fn nominal(&self, parameter: &effects::Parameter) -> f64 {
        let effects::Role::Searched(domain) = &parameter.role else { return parameter.nominal };
        let Some(context) = self.image_contexts.first() else { return parameter.nominal };
        match domain {
            effects::Domain::SensorX => 0.5 * context.width_px,
            effects::Domain::SensorY => 0.5 * context.height_px,
            effects::Domain::SensorFraction(a, b) => 0.25 * (a + b) * context.width_px.hypot(context.height_px),
            effects::Domain::Range(..) => parameter.nominal,
        }
    }
}

/// Which observations take part: control, GNSS.
fn datum_parts(block: &Block, datum: Datum) -> Result<(bool, bool), ProblemError> {
    let control = block.count(Role::Control) > 0;
    let gnss = block.images.iter().any(|image| image.gnss.is_some());
    match datum {
        Datum::Free => Ok((false, false)),
        Datum::Control if control => Ok((true, false)),
        Datum::Control => Err(ProblemError::Datum { datum: "control", needs: "control points" }),
        Datum::Gnss if gnss => Ok((false, true)),
        Datum::Gnss => Err(ProblemError::Datum { datum: "gnss", needs: "GNSS positions" }),
        Datum::All if control || gnss => Ok((control, gnss)),
        Datum::All => Err(ProblemError::Datum { datum: "all", needs: "control points or GNSS positions" }),
    }
}

/// Start values of the interior orientations, and which are free.
fn cameras(block: &Block, model: &Model) -> Result<(Vec<Interior>, Vec<[bool; 12]>), ProblemError> {
    let mut interiors: Vec<Interior> = block.cameras.iter().map(|camera| camera.interior).collect();
    for (id, values) in &model.camera_values {
        let camera = camera_position(block, id)?;
        for (name, value) in values {
            interiors[camera][parameter_position(name)?] = *value;
        }
    }
    let mut free = model.free;
    if model.tie_dc_to_pp {
        free[3] = false;
        free[4] = false;
        for interior in &mut interiors {
            interior[3] = interior[1];
            interior[4] = interior[2];
        }
    }
    Ok((interiors, vec![free; block.cameras.len()]))
}

fn camera_position(block: &Block, id: &str) -> Result<usize, ProblemError> {
    block.cameras.iter().position(|camera| camera.id == id).ok_or_else(|| {
        let ids: Vec<&str> = block.cameras.iter().map(|camera| camera.id.as_str()).collect();
        ProblemError::Unknown { kind: "camera", name: id.into(), hint: format!("; it has {}", ids.join(", ")) }
    })
}

fn parameter_position(name: &str) -> Result<usize, ProblemError> {
    camera::PARAMETERS.iter().position(|parameter| *parameter == name).ok_or_else(|| ProblemError::Unknown {
        kind: "camera parameter",
        name: name.into(),
        hint: format!("; a camera has {}", camera::PARAMETERS.join(", ")),
    })
}

fn camera_priors(block: &Block, model: &Model) -> Result<Vec<CameraPrior>, ProblemError> {
    let prior = |prior: &crate::model::Prior| {
        if prior.sigma.is_nan() || prior.sigma <= 0.0 {
            let text = format!("prior of `{}`: sigma is {}, expected above 0", prior.parameter, prior.sigma);
            return Err(ProblemError::Value(text));
        }
        Ok(CameraPrior {
            camera: camera_position(block, &prior.camera)? as u32,
            parameter: parameter_position(&prior.parameter)? as u32,
            value: prior.value,
            sigma: prior.sigma,
        })
    };
    model.priors.iter().map(prior).collect()
}

/// A point and its measurements.
struct PointRows {
    source: PointSource,
    observations: Vec<ImageObservation>,
}

fn point_name(block: &Block, source: PointSource) -> String {
    match source {
        PointSource::Tie(id) => block.tie_points[id.index()].name.clone(),
        PointSource::Control(id) => block.surveyed[id.index()].name.clone(),
    }
}

/// Tie points with two rays or more in order along the block, then control points.
fn collect_points(block: &Block, model: &Model, uses_control: bool, ranks: &[u32]) -> Vec<PointRows> {
    let factor = model.sigma_factors.image;
    let ties = by_point(&block.ties, block.tie_points.len());
    let mut points: Vec<PointRows> = ties
        .into_iter()
        .enumerate()
        .filter(|(_, rows)| rows.len() > 1)
        .map(|(id, rows)| {
            let m = rows.len() as f64;
            let weight = match model.tie_weights {
                TieWeights::Unit => 1.0,
                TieWeights::Multi => m * (m - 1.0),
                TieWeights::Pairs => m * (m - 1.0) * (m - 1.0),
            };
            let mut observations: Vec<_> = rows
                .into_iter()
                .map(|row| observation(row, MeasurementKind::Tie, block.sigma.tie_px, weight.sqrt() / factor))
                .collect();
            observations.sort_by_key(|o| ranks[o.image as usize]);
            PointRows { source: PointSource::Tie(PointId::from(id)), observations }
        })
        .collect();
    points.sort_by_key(|point| {
        let first = point.observations.first().map_or(0, |o| ranks[o.image as usize]);
        let last = point.observations.last().map_or(0, |o| ranks[o.image as usize]);
        (first, last)
    });
    if uses_control {
        for (id, rows) in by_point(&block.marks, block.surveyed.len()).into_iter().enumerate() {
            if block.surveyed[id].role != Role::Control || rows.is_empty() {
                continue;
            }
            let mut observations: Vec<_> = rows
                .into_iter()
                .map(|row| observation(row, MeasurementKind::Mark, block.sigma.mark_px, 1.0 / factor))
                .collect();
            observations.sort_by_key(|o| ranks[o.image as usize]);
            points.push(PointRows { source: PointSource::Control(PointId::from(id)), observations });
        }
    }
    points
}

/// Images whose measurements cannot orient them: each gives two numbers less its share of the point's three, a GNSS position three more, and
/// a pose wants six and three points.
fn unoriented<'a>(gnss: &[bool], points: impl Iterator<Item = (PointSource, &'a [ImageObservation])>) -> Vec<bool> {
    let mut numbers: Vec<f64> = gnss.iter().map(|gnss| if *gnss { 3.0 } else { 0.0 }).collect();
    let mut seen = vec![0; gnss.len()];
    for (source, observations) in points {
        let known = matches!(source, PointSource::Control(_));
        let share = if known { 2.0 } else { 2.0 - 3.0 / observations.len() as f64 };
        for observation in observations {
            numbers[observation.image as usize] += share;
            seen[observation.image as usize] += 1;
        }
    }
    seen.iter().zip(numbers).map(|(seen, numbers)| *seen < POSE_POINTS || numbers < POSE_NUMBERS).collect()
}

/// Takes the measurements of such images out. Their points may fall to one ray and go too, so it repeats. What is out is known by
/// [`Problem::images_without_part`].
fn set_aside_unoriented(block: &Block, uses_gnss: bool, points: &mut Vec<PointRows>) {
    let gnss: Vec<bool> = block.images.iter().map(|image| uses_gnss && image.gnss.is_some()).collect();
    loop {
        let unoriented = unoriented(&gnss, points.iter().map(|point| (point.source, point.observations.as_slice())));
        let measured = |point: &PointRows| point.observations.iter().any(|row| unoriented[row.image as usize]);
        if !points.iter().any(measured) {
            return;
        }
        for point in points.iter_mut() {
            point.observations.retain(|observation| !unoriented[observation.image as usize]);
        }
        points.retain(|point| match point.source {
            PointSource::Tie(_) => point.observations.len() > 1,
            PointSource::Control(_) => !point.observations.is_empty(),
        });
    }
}

/// Unknowns of an exterior orientation.
const POSE_NUMBERS: f64 = 6.0;
/// Points that fix a rotation whatever else is known.
const POSE_POINTS: usize = 3;

fn by_point(measurements: &[Measurement], points: usize) -> Vec<Vec<&Measurement>> {
    let mut rows = vec![Vec::new(); points];
    for measurement in measurements {
        rows[measurement.point.index()].push(measurement);
    }
    rows
}

fn observation(row: &Measurement, kind: MeasurementKind, sigma: f64, root_weight: f64) -> ImageObservation {
    ImageObservation {
        image: row.image.0,
        kind,
        x: row.x,
        y: row.y,
        inverse_sigma: root_weight / row.sigma.unwrap_or(sigma),
    }
}

/// Start coordinates: given, surveyed, or intersected from the approximate orientation.
fn start_position(block: &Block, interiors: &[Interior], point: &PointRows) -> Result<Vector3<f64>, ProblemError> {
    match point.source {
        PointSource::Control(id) => Ok(block.surveyed[id.index()].position),
        PointSource::Tie(id) => match block.tie_points[id.index()].position {
            Some(position) => Ok(position),
            None => intersect(block, interiors, &point.observations)
                .ok_or_else(|| ProblemError::NoIntersection { point: point_name(block, point.source) }),
        },
    }
}

/// Least-squares intersection of the rays of the measurements, in front of every camera.
fn intersect(block: &Block, interiors: &[Interior], observations: &[ImageObservation]) -> Option<Vector3<f64>> {
    let mut origins = Vec::with_capacity(observations.len());
    let mut directions = Vec::with_capacity(observations.len());
    for observation in observations {
        let image = &block.images[observation.image as usize];
        let interior = &interiors[image.camera.index()];
        let [u, v] = undistort(interior, [observation.x, observation.y])?;
        let ray = Vector3::new((u - interior[1]) / interior[0], (v - interior[2]) / interior[0], 1.0);
        origins.push(image.pose.centre);
        directions.push(image.pose.rotation.inverse() * ray.normalize());
    }
    let point = intersect_rays(&origins, &directions)?;
    let in_front = |o: &ImageObservation| block.images[o.image as usize].pose.cam_from_world(&point).z > 0.0;
    observations.iter().all(in_front).then_some(point)
}

fn control_observations(block: &Block, points: &[PointRows], factor: f64) -> Vec<PositionObservation> {
    let observed = |(j, point): (usize, &PointRows)| match point.source {
        PointSource::Tie(_) => None,
        PointSource::Control(id) => {
            let surveyed = &block.surveyed[id.index()];
            let xy = factor * surveyed.sigma_xy.unwrap_or(block.sigma.control_xy_m);
            let z = factor * surveyed.sigma_z.unwrap_or(block.sigma.control_z_m);
            Some(PositionObservation { index: j as u32, position: surveyed.position, sigma: Vector3::new(xy, xy, z) })
        }
    };
    points.iter().enumerate().filter_map(observed).collect()
}

/// Antenna positions of the images that take part.
fn gnss_observations(block: &Block, pose_free: &[[bool; 6]], factor: f64) -> Vec<PositionObservation> {
    let observed = |(i, image): (usize, &crate::block::Image)| {
        let gnss = image.gnss.filter(|_| pose_free[i] != [false; 6])?;
        let xy = factor * gnss.sigma_xy.unwrap_or(block.sigma.gnss_xy_m);
        let z = factor * gnss.sigma_z.unwrap_or(block.sigma.gnss_z_m);
        Some(PositionObservation { index: i as u32, position: gnss.position, sigma: Vector3::new(xy, xy, z) })
    };
    block.images.iter().enumerate().filter_map(observed).collect()
}
