//! The pictures of a run as data: what the page of a run draws, and whoever shows the same run in another way.

use super::figures::{
    Arrow, ArrowSet, Axis, Cell, FlightPlan, Histogram, ImageBar, ImageBars, LineChart, LineStyle, MapFrame, Panel,
    PlanArrows, PlanEllipses, PlanSigned, Sample, Series, Station, VectorField,
};
use super::numbers::{fixed, significant};
use crate::block::{Block, Image, Role};
use crate::diagnose::verdict::Diagnosis;
use crate::geodesy::crs::Crs;
use crate::geodesy::geographic::LocalSystem;
use crate::plan::{OfPoint, Precision};
use crate::run::CELLS;
use crate::run::folder::{self, CheckRow, GnssRow, ModelCheckRow, SensorRow};

/// The folder of a run, with what a diagnosis left in it.
pub type RunFolder = folder::RunFolder<Diagnosis>;

/// Cells below this p-value are marked. A cell is one of hundreds: 1e-5 marks no cell of a clean block in most
/// pictures.
pub const MARKED_P: f64 = 1e-5;

/// What the horizontal coordinates of a run are.
pub fn frame(run: &RunFolder) -> MapFrame {
    let crs = run.provenance.crs.as_deref().unwrap_or_default();
    match LocalSystem::parse(crs).is_some() || Crs::parse(crs).is_ok_and(|crs| crs.is_projected()) {
        true => MapFrame::EastNorth,
        false => MapFrame::Local,
    }
}

/// A point as one model of a diagnosis has it.
pub fn as_check(row: &ModelCheckRow) -> CheckRow {
    CheckRow {
        point: row.point.clone(),
        role: row.role.clone(),
        dx: row.dx,
        dy: row.dy,
        dz: row.dz,
        x: row.x,
        y: row.y,
        z: row.z,
        sigma_dx: None,
        sigma_dy: None,
        sigma_dz: None,
        images: None,
        rms_px: None,
        easting: None,
        northing: None,
        height: None,
    }
}

/// Tooltip of a point: its name and its differences (m).
fn differing(name: &str, d: [f64; 3]) -> String {
    let [x, y, z] = d.map(|value| fixed(1e3 * value, 1));
    format!("{name}: dX {x}, dY {y}, dZ {z} mm")
}

/// Mean residuals over the sensor of a camera at a stage; `None` without any.
pub fn sensor(run: &RunFolder, camera: &str, stage: &str, title: &str) -> Option<VectorField> {
    let rows: Vec<&SensorRow> = run.sensor.iter().filter(|row| row.camera == camera && row.stage == stage).collect();
    let first = rows.first()?;
    let size = [first.width_px, first.height_px];
    let arrows: Vec<Arrow> = rows.iter().map(|row| ([row.x, row.y], [row.dx, row.dy])).collect();
    let tested = rows.iter().any(|row| row.p_value.is_some());
    let marked = rows.iter().filter(|_| tested).map(|row| row.p_value.is_some_and(|p| p < MARKED_P));
    let tests: Vec<bool> = marked.collect();
    let mut field = VectorField::single(title, size, Vec::new(), "px");
    let cell = cell_size(&arrows, size);
    let words = |k: usize| cell_words(rows[k].n, arrows[k].1, rows[k].p_value.map(|p| p < MARKED_P));
    let cells = rows.iter().enumerate();
    field.cells =
        cells.map(|(k, row)| Cell { centre: [row.x, row.y], size: cell, n: row.n, words: words(k) }).collect();
    field.sets = vec![ArrowSet { arrows, significant: tests, ..ArrowSet::default() }];
    Some(field)
}

/// Width and height of the cells in whose middles these arrows stand, px: the least distance between two.
fn cell_size(arrows: &[Arrow], sensor: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|axis| {
        let mut at: Vec<f64> = arrows.iter().map(|(place, _)| place[axis]).collect();
        at.sort_by(f64::total_cmp);
        let steps = at.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-6 * sensor[axis]);
        let step = steps.fold(f64::INFINITY, f64::min);
        if step.is_finite() { step } else { sensor[0].max(sensor[1]) / CELLS }
    })
}

/// What a cell of the sensor says of itself: its number of measurements, their mean residual (px), and, where it was
/// tested, whether that is significant.
pub fn cell_words(n: usize, mean: [f64; 2], is_significant: Option<bool>) -> String {
    let measurements = if n == 1 { "measurement" } else { "measurements" };
    let tested = match is_significant {
        Some(true) => ", significant",
        Some(false) => ", not significant",
        None => "",
    };
    let [x, y] = mean.map(|value| significant(value, 2));
    format!("{n} {measurements}, mean {x}, {y} px{tested}")
}

/// RMS per image, in the order of the block; `None` where an image has no tie point.
pub fn image_rms(run: &RunFolder, rms: &[Option<f64>]) -> ImageBars {
    let flights = run.flights();
    let bars = run.images.iter().zip(rms).enumerate().filter_map(|(number, (image, rms))| {
        let flight = flights.iter().position(|name| *name == image.flight)?;
        let (value, name) = ((*rms)?, image.image.clone());
        let name = format!("{name}: {} px", significant(value, 3));
        Some(ImageBar { value, flight, image: Some(number), name, ..ImageBar::default() })
    });
    ImageBars {
        title: "RMS of the tie points of each image, per coordinate".into(),
        order: "image in the order of the block".into(),
        y: Axis::new("RMS", "px").from_zero(),
        bars: bars.collect(),
        flights,
        ..ImageBars::default()
    }
}

/// Distribution of the residuals in x and in y.
pub fn residual_histogram(x: Vec<f64>, y: Vec<f64>) -> Histogram {
    let sample = |label: &str, values| Sample { label: label.into(), values, ..Sample::default() };
    Histogram {
        title: "Residuals of the tie points".into(),
        x: Axis::new("observed − computed", "px"),
        samples: vec![sample("x", x), sample("y", y)],
        ..Histogram::default()
    }
}

/// Images, control and check points in plan and from the side.
pub fn flights(run: &RunFolder) -> FlightPlan {
    let flights = run.flights();
    let of_role = |role: &str| -> Vec<[f64; 3]> { of(run, role).map(|row| [row.x, row.y, row.z]).collect() };
    let stations = run.images.iter().filter_map(|image| {
        let flight = flights.iter().position(|name| *name == image.flight)?;
        let (position_m, name) = ([image.x, image.y, image.z], image.image.clone());
        Some(Station { position_m, flight, name, ..Station::default() })
    });
    FlightPlan {
        title: "Projection centres, control and check points".into(),
        images: stations.collect(),
        control_m: of_role("control"),
        control_names: of(run, "control").map(|row| row.point.clone()).collect(),
        check_m: of_role("check"),
        frame: frame(run),
        flights,
        width: None,
    }
}

/// The same of a block that was simulated.
pub fn flights_of_block(block: &Block) -> FlightPlan {
    let of_role = |role: Role| {
        let points = block.surveyed.iter().filter(move |point| point.role == role);
        points.map(|point| point.position.into()).collect()
    };
    let station = |image: &Image| Station {
        position_m: image.pose.centre.into(),
        flight: image.flight.index(),
        name: image.name.clone(),
        ..Station::default()
    };
    FlightPlan {
        title: "Images, control and check points".into(),
        flights: block.flights.clone(),
        images: block.images.iter().map(station).collect(),
        control_m: of_role(Role::Control),
        check_m: of_role(Role::Check),
        ..FlightPlan::default()
    }
}

/// Error ellipses of the tie points of a plan.
pub fn ellipses_of_plan(precision: &Precision) -> PlanEllipses {
    let of_point = |own: &OfPoint| {
        let sigma = own.sigma_m * 1e3;
        ([own.position.x, own.position.y], [sigma.x, sigma.y, sigma.z], own.correlation)
    };
    PlanEllipses {
        title: "Error ellipses of tie points".into(),
        ellipses: precision.points.iter().map(of_point).collect(),
        frame: MapFrame::Local,
        unit: "mm".into(),
    }
}

fn of<'a>(run: &'a RunFolder, role: &'a str) -> impl Iterator<Item = &'a CheckRow> + 'a {
    run.checks.iter().filter(move |row| row.role == role)
}

/// Errors of points in plan.
pub fn plan<'a>(name: &str, frame: MapFrame, rows: impl Iterator<Item = &'a CheckRow>) -> PlanArrows {
    let (arrows, names) = rows
        .map(|row| (([row.x, row.y], [1e3 * row.dx, 1e3 * row.dy]), differing(&row.point, [row.dx, row.dy, row.dz])))
        .unzip();
    PlanArrows {
        title: format!("{name}: residuals in planimetry"),
        arrows,
        names,
        frame,
        unit: "mm".into(),
        ..PlanArrows::default()
    }
}

/// Errors of points in height.
pub fn heights<'a>(name: &str, frame: MapFrame, rows: impl Iterator<Item = &'a CheckRow>) -> PlanSigned {
    let (values, names) =
        rows.map(|row| (([row.x, row.y], 1e3 * row.dz), differing(&row.point, [row.dx, row.dy, row.dz]))).unzip();
    PlanSigned {
        title: format!("{name}: residuals in height"),
        values,
        names,
        frame,
        unit: "mm".into(),
        ..PlanSigned::default()
    }
}

/// Distribution of the errors of points.
pub fn check_histogram(name: &str, rows: &[&CheckRow]) -> Histogram {
    let sample = |label: &str, value: fn(&CheckRow) -> f64| Sample {
        label: label.into(),
        values: rows.iter().map(|row| 1e3 * value(row)).collect(),
        ..Sample::default()
    };
    Histogram {
        title: format!("{name}: distribution of the residuals"),
        x: Axis::new("computed − surveyed", "mm"),
        samples: vec![sample("X", |row| row.dx), sample("Y", |row| row.dy), sample("Z", |row| row.dz)],
        // More of them than the square root of the values, and they show noise.
        bins: ((rows.len() as f64).sqrt().ceil() as usize).clamp(5, 40),
        ..Histogram::default()
    }
}

fn gnss_names(rows: &[GnssRow]) -> Vec<String> {
    rows.iter().map(|row| differing(&row.image, [row.dx, row.dy, row.dz])).collect()
}

/// Residuals of GNSS positions in plan.
pub fn gnss_plan(frame: MapFrame, rows: &[GnssRow]) -> PlanArrows {
    PlanArrows {
        names: gnss_names(rows),
        frame,
        title: "GNSS positions: residuals in planimetry".into(),
        arrows: rows.iter().map(|row| ([row.x, row.y], [row.dx, row.dy])).collect(),
        unit: "m".into(),
        ..PlanArrows::default()
    }
}

/// Residuals of GNSS positions in height.
pub fn gnss_heights(frame: MapFrame, rows: &[GnssRow]) -> PlanSigned {
    PlanSigned {
        names: gnss_names(rows),
        frame,
        title: "GNSS positions: residuals in height".into(),
        values: rows.iter().map(|row| ([row.x, row.y], row.dz)).collect(),
        unit: "m".into(),
        ..PlanSigned::default()
    }
}

/// What residuals of GNSS positions can be held against: an offset of the clock or of the antenna turns with the
/// heading, a drift grows with time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GnssAgainst {
    /// Time of exposure.
    Time,
    /// Heading of the platform.
    Heading,
}

impl GnssAgainst {
    /// What stands at the axis, and its unit.
    pub fn about(self) -> (&'static str, &'static str) {
        match self {
            Self::Time => ("time", "s"),
            Self::Heading => ("heading, from north to east", "degrees"),
        }
    }

    /// The value of a row, where it is known.
    pub fn value(self, row: &GnssRow) -> Option<f64> {
        match self {
            Self::Time => row.time_s,
            Self::Heading => row.heading_deg,
        }
    }
}

/// Residuals of GNSS positions against what was recorded; those that are `chosen`, where somebody chose, stand out.
/// `None` where it is known of no image.
pub fn gnss_series(rows: &[GnssRow], against: GnssAgainst, chosen: Option<&[bool]>) -> Option<LineChart> {
    rows.iter().find_map(|row| against.value(row))?;
    let components = [("X", 0), ("Y", 1), ("Z", 2)];
    let points = |k: usize, wanted: Option<&[bool]>| -> Vec<[f64; 2]> {
        let kept = rows.iter().enumerate().filter(|(row, _)| wanted.is_none_or(|wanted| wanted[*row]));
        kept.filter_map(|(_, row)| Some([against.value(row)?, [row.dx, row.dy, row.dz][k]])).collect()
    };
    let series = |label: String, points| Series::new(label, points).style(LineStyle::Markers);
    let all = components.iter().map(|(name, k)| match chosen {
        Some(_) => series(format!("{name} of all"), points(*k, None)).dimmed(true),
        None => series(name.to_string(), points(*k, None)),
    });
    let mut all: Vec<Series> = all.collect();
    if chosen.is_some() {
        let brushed = |(name, k): &(&str, usize)| series(format!("{name} of the brushed"), points(*k, chosen));
        all.extend(components.iter().map(brushed));
    }
    let (label, unit) = against.about();
    let what = if against == GnssAgainst::Time { "time" } else { "heading" };
    Some(LineChart {
        title: format!("GNSS positions: residuals against {what}"),
        panels: vec![Panel {
            x: Axis::new(label, unit),
            y: Axis::new("computed − measured", "m"),
            series: all,
            ..Panel::default()
        }],
        ..LineChart::default()
    })
}
