//! The effects against measurements that another program made under one effect each: formulas, signs and contexts.
//!
//! Every folder of `../shared/vectors` is a block with exact measurements at the true poses, points and camera. With the effect at
//! the values of its `case.json` the whole chain must meet the measurements to rounding; without it, it must miss them by what is stated there.

use misclosure::camera::{PARAMETERS, fraser};
use misclosure::effects::{BlockContext, Context, Effect, ImageContext, Role, Scope, Stage, find};
use misclosure::math::rotation::{exp, log};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Rounding at 5000 px is 1e-12 px, and a chain of a few hundred operations loses little of that; 5e-12 px was met.
const IMAGE_TOLERANCE_PX: f64 = 1e-9;
/// Rounding at coordinates of 100 m is 1e-14 m; less than 1e-15 m was met.
const POSITION_TOLERANCE_M: f64 = 1e-12;
/// What `case.json` states is measured on exact values.
const CHANGE_TOLERANCE: f64 = 0.01;

type Row = HashMap<String, String>;

fn table(path: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(path).expect("a readable table");
    reader.deserialize().map(|row| row.expect("a row of the header's width")).collect()
}

fn number(row: &Row, column: &str) -> f64 {
    row.get(column).filter(|cell| !cell.is_empty()).map_or(f64::NAN, |cell| cell.parse().expect("a number"))
}

fn triple(row: &Row, columns: [&str; 3]) -> Vector3<f64> {
    Vector3::from(columns.map(|column| number(row, column)))
}

fn vectors() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/vectors");
    folder.is_dir().then_some(folder)
}

/// An effect and one set of parameter values per image.
struct Term {
    effect: &'static dyn Effect,
    theta: Vec<Vec<f64>>,
}

/// A block at its true values.
struct Case {
    images: Vec<(Row, ImageContext, [f64; 6])>,
    interior: [f64; 12],
    block: BlockContext,
    /// True coordinates by name: tie points and surveyed points.
    points: HashMap<String, Vector3<f64>>,
    surveyed: Vec<Row>,
    measurements: Vec<Row>,
    stated: serde_json::Value,
}

impl Case {
    fn read(folder: &Path) -> Self {
        let text = std::fs::read_to_string(folder.join("block.toml")).expect("block.toml");
        let toml: toml::Table = text.parse().expect("TOML");
        let camera = toml["camera"][0].as_table().expect("a camera");
        let float = |name: &str| camera[name].as_float().unwrap_or_else(|| camera[name].as_integer().unwrap() as f64);
        let rows = table(&folder.join("images.csv"));
        let count = rows.len() as f64;
        let times: Vec<f64> = rows.iter().map(|row| number(row, "time_s")).collect();
        let (first, last) = times.iter().fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(*t), b.max(*t)));
        let mean_time = times.iter().sum::<f64>() / count;
        let mut flights: Vec<&str> = Vec::new();
        let mut images = Vec::new();
        for (index, row) in rows.iter().enumerate() {
            if !flights.contains(&row["flight"].as_str()) {
                flights.push(&row["flight"]);
            }
            let of_flight = || (0..rows.len()).filter(|k| rows[*k]["flight"] == row["flight"]).map(|k| times[k]);
            let (start, end) = of_flight().fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(t), b.max(t)));
            let image = ImageContext {
                image: index as u32,
                flight: flights.iter().position(|flight| *flight == row["flight"]).unwrap() as u32,
                width_px: float("width_px"),
                height_px: float("height_px"),
                time_s: times[index],
                tau: (times[index] - mean_time) / (last - first),
                tau_order: (index as f64 - 0.5 * (count - 1.0)) / (count - 1.0),
                flight_time_s: times[index] - start,
                flight_span_s: end - start,
                temperature_c: number(row, "temperature_c"),
                velocity: triple(row, ["vx", "vy", "vz"]),
                ..Default::default()
            };
            let [w, i, j, k] = ["qw", "qx", "qy", "qz"].map(|column| number(row, column));
            let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)).to_rotation_matrix();
            let (r, c) = (log(rotation.matrix()), triple(row, ["x", "y", "z"]));
            images.push((row.clone(), image, [r.x, r.y, r.z, c.x, c.y, c.z]));
        }
        let xyz = ["x", "y", "z"];
        let surveyed = table(&folder.join("control.csv"));
        // The survey of the block without effect is the truth.
        let truth = table(&folder.join("../none/control.csv"));
        let points = table(&folder.join("points.csv"));
        let mut history: Vec<[f64; 2]> = images.iter().map(|image| [image.1.time_s, image.1.temperature_c]).collect();
        history.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mean = |values: Vec<Vector3<f64>>| values.iter().sum::<Vector3<f64>>() / values.len() as f64;
        let block = BlockContext {
            centre: mean(images.iter().map(|image| Vector3::from_column_slice(&image.2[3..])).collect()),
            survey_mean: mean(surveyed.iter().map(|row| triple(row, xyz)).collect()),
            counts: [images.len() as u32, flights.len() as u32, 1],
            mean_temperature_c: history.iter().map(|row| row[1]).sum::<f64>() / count,
            temperature_history: history,
        };
        let measurements = ["ties.csv", "marks.csv"].iter().flat_map(|name| table(&folder.join(name))).collect();
        let stated = std::fs::read_to_string(folder.join("case.json")).expect("case.json");
        Self {
            interior: PARAMETERS.map(float),
            block,
            points: points.iter().chain(&truth).map(|row| (row["point"].clone(), triple(row, xyz))).collect(),
            images,
            surveyed,
            measurements,
            stated: serde_json::from_str(&stated).expect("JSON"),
        }
    }

    /// The effect of the case at its values, of which none may be left over.
    fn term(&self) -> Option<Term> {
        let effect = find(self.stated["effect"].as_str()?).expect("an effect of the catalogue");
        let values = self.stated["parameters"].as_object().expect("parameters");
        let mut used = std::collections::BTreeSet::new();
        let mut value = |row: &Row, parameter: &misclosure::effects::Parameter| {
            let key = match parameter.scope {
                Scope::Global => parameter.name.to_string(),
                Scope::Flight | Scope::FlightButFirst => format!("{}[{}]", parameter.name, row["flight"]),
                Scope::Camera => format!("{}[{}]", parameter.name, row["camera"]),
                Scope::Image => format!("{}[{}]", parameter.name, row["image"]),
            };
            let found = values.get(&key).and_then(serde_json::Value::as_f64);
            let optional = matches!(parameter.role, Role::Given(_)) || parameter.scope == Scope::FlightButFirst;
            assert!(found.is_some() || optional, "no value of {key}");
            used.insert(key);
            found.unwrap_or(parameter.nominal)
        };
        let parameters = &effect.descriptor().parameters;
        let theta = self.images.iter().map(|(row, ..)| parameters.iter().map(|p| value(row, p)).collect()).collect();
        let unused: Vec<_> = values.keys().filter(|key| !used.contains(*key)).collect();
        assert!(unused.is_empty(), "unknown parameters {unused:?}");
        Some(Term { effect, theta })
    }

    /// One stage of the chain: the effect if it acts there, else the identity.
    fn stage(&self, term: Option<&Term>, stage: Stage, image: usize, observed: [f64; 2], input: &[f64]) -> Vec<f64> {
        let offset = stage.identity_offset();
        let mut out = input[offset..offset + stage.outputs()].to_vec();
        if let Some(term) = term.filter(|term| term.effect.descriptor().stage == stage) {
            let context = Context {
                block: &self.block,
                image: &self.images[image].1,
                column_px: observed[0],
                row_px: observed[1],
            };
            term.effect.eval(&context, input, &term.theta[image], &mut out, None, None).expect("inside the domain");
        }
        out
    }

    /// Largest residual of image points (px), antenna positions and surveyed coordinates (m), in any one coordinate.
    fn largest_residuals(&self, term: Option<&Term>) -> [f64; 3] {
        let mut largest = [0.0_f64; 3];
        let mut note = |group: usize, residual: &[f64]| {
            assert!(residual.iter().all(|value| value.is_finite()));
            largest[group] = residual.iter().fold(largest[group], |most, value| most.max(value.abs()));
        };
        let names: HashMap<&str, usize> =
            self.images.iter().enumerate().map(|(index, image)| (image.0["image"].as_str(), index)).collect();
        for row in &self.measurements {
            let image = names[row["image"].as_str()];
            let observed = ["x", "y"].map(|column| number(row, column));
            let pose = self.stage(term, Stage::Exposure, image, observed, &self.images[image].2);
            let point = self.points[row["point"].as_str()];
            let seen = self.stage(term, Stage::Ray, image, observed, &[&pose, point.as_slice()].concat());
            let interior = self.stage(term, Stage::Interior, image, observed, &[&self.interior, &pose[..3]].concat());
            let interior: [f64; 12] = interior.try_into().unwrap();
            let centre = Vector3::from_column_slice(&pose[3..]);
            let in_camera = exp(&Vector3::from_column_slice(&pose[..3])) * (Vector3::from_column_slice(&seen) - centre);
            let ideal = fraser::project(&interior, in_camera.into()).expect("before the camera");
            let predicted = self.stage(term, Stage::Image, image, observed, &[&ideal[..], &interior].concat());
            note(0, &[predicted[0] - observed[0], predicted[1] - observed[1]]);
        }
        let none = [f64::NAN; 2];
        for (index, (row, _, pose)) in self.images.iter().enumerate() {
            let antenna = Vector3::from_vec(self.stage(term, Stage::Position, index, none, pose));
            note(1, (antenna - triple(row, ["gnss_x", "gnss_y", "gnss_z"])).as_slice());
        }
        for row in &self.surveyed {
            let truth = self.points[row["point"].as_str()];
            let surveyed = Vector3::from_vec(self.stage(term, Stage::Control, 0, none, truth.as_slice()));
            note(2, (surveyed - triple(row, ["x", "y", "z"])).as_slice());
        }
        largest
    }
}

#[test]
fn effects_meet_the_measurements_of_another_program() {
    let Some(folder) = vectors() else {
        eprintln!("skipped: no ../shared/vectors");
        return;
    };
    let mut folders: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.unwrap().path()).collect();
    folders.sort();
    assert!(!folders.is_empty());
    let tolerances = [IMAGE_TOLERANCE_PX, POSITION_TOLERANCE_M, POSITION_TOLERANCE_M];
    let keys = ["largest_change_px", "largest_change_gnss_m", "largest_change_survey_m"];
    let mut wrong = Vec::new();
    for folder in folders {
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
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
