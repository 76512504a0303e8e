//! Every measurement of a node as columns, with what was recorded of its image and point.

use super::quantity::{Component, Quantity};
use crate::block::Block;
use crate::problem::context::image_contexts;
use crate::run::folder::{ImageRow, PointRow, ResidualRef};
use crate::run::{ResidualKind, ResidualRow, heading_deg};
use nalgebra::Vector3;
use std::collections::HashMap;

/// Positions in a block by name.
pub struct Names<'a> {
    images: HashMap<&'a str, u32>,
    ties: HashMap<&'a str, u32>,
    surveyed: HashMap<&'a str, u32>,
}

impl<'a> Names<'a> {
    /// Those of a block.
    pub fn of(block: &'a Block) -> Self {
        fn positions<'a>(names: impl Iterator<Item = &'a String>) -> HashMap<&'a str, u32> {
            names.enumerate().map(|(k, name)| (name.as_str(), k as u32)).collect()
        }
        Self {
            images: positions(block.images.iter().map(|image| &image.name)),
            ties: positions(block.tie_points.iter().map(|point| &point.name)),
            surveyed: positions(block.surveyed.iter().map(|point| &point.name)),
        }
    }
}

/// What is known of an image.
#[derive(Debug, Clone)]
pub struct ImageColumns {
    /// Position of its camera.
    pub camera: u32,
    /// Position of its flight.
    pub flight: u32,
    /// s; NaN where not known.
    pub time: f64,
    /// Degrees Celsius; NaN where not known.
    pub temperature: f64,
    /// m/s; NaN where not known.
    pub speed: f64,
    /// Degrees; NaN where not known.
    pub heading: f64,
    /// Projection centre about the block's origin, m.
    pub centre: [f64; 3],
    /// Viewing direction.
    pub view: [f64; 3],
    /// Upwards in the image.
    pub up: [f64; 3],
    /// Unit vector along the motion in the image; NaN where not known.
    along: [f64; 2],
    /// Middle of the sensor, px.
    middle: [f64; 2],
}

/// Columns, one entry per measurement.
#[derive(Debug, Clone)]
pub struct Columns {
    /// Where zero lies in the survey's system, m.
    pub origin: [f64; 3],
    /// Of every image of the block.
    pub images: Vec<ImageColumns>,
    /// Position of the image.
    pub image: Vec<u32>,
    /// Position of the point: of a tie point in the block, of a mark among the surveyed points.
    pub point: Vec<u32>,
    /// Is it a tie?
    pub tie: Vec<bool>,
    /// Measured, px.
    pub x: Vec<f32>,
    /// Measured, px.
    pub y: Vec<f32>,
    /// Residual, px.
    pub rx: Vec<f64>,
    /// Residual, px.
    pub ry: Vec<f64>,
    /// A-priori standard deviation, px.
    pub sigma: Vec<f32>,
    /// Where the tie points lie about the origin, m; NaN where not known.
    pub ties: Vec<[f32; 3]>,
    /// Where the surveyed points lie about the origin, m.
    pub surveyed: Vec<[f32; 3]>,
}

impl Columns {
    /// Columns without measurements: images and points of a node.
    pub fn of_block(block: &Block, images: &[ImageRow], points: &[PointRow]) -> Self {
        let origin = block.origin;
        let centres: Vec<_> = block.images.iter().map(|image| image.pose.centre).collect();
        let contexts = image_contexts(block, &centres);
        let rows: HashMap<&str, &ImageRow> = images.iter().map(|row| (row.image.as_str(), row)).collect();
        let of_image = |(number, image): (usize, &crate::block::Image)| {
            let pose = rows.get(image.name.as_str()).map(|row| {
                let pose = row.pose();
                crate::block::Pose { centre: pose.centre - origin, ..pose }
            });
            let pose = pose.unwrap_or(image.pose);
            let context = &contexts[number];
            let velocity = context.velocity;
            let motion = (pose.rotation * velocity).xy();
            let along = motion.try_normalize(f64::MIN_POSITIVE).map_or([f64::NAN; 2], Into::into);
            let inverse = pose.rotation.inverse();
            ImageColumns {
                camera: image.camera.0,
                flight: image.flight.0,
                time: context.time_s,
                temperature: context.temperature_c,
                speed: velocity.norm(),
                heading: heading_deg(&velocity),
                centre: pose.centre.into(),
                view: (inverse * Vector3::z()).into(),
                up: (inverse * -Vector3::y()).into(),
                along,
                middle: [0.5 * context.width_px, 0.5 * context.height_px],
            }
        };
        let known: HashMap<&str, &PointRow> = points.iter().map(|row| (row.point.as_str(), row)).collect();
        let tie = |point: &crate::block::TiePoint| match known.get(point.name.as_str()) {
            Some(row) => [row.x - origin.x, row.y - origin.y, row.z - origin.z].map(|v| v as f32),
            None => [f32::NAN; 3],
        };
        let surveyed = |point: &crate::block::SurveyedPoint| -> [f32; 3] { point.position.map(|v| v as f32).into() };
        Self {
            origin: origin.into(),
            images: block.images.iter().enumerate().map(of_image).collect(),
            ties: block.tie_points.iter().map(tie).collect(),
            surveyed: block.surveyed.iter().map(surveyed).collect(),
            image: Vec::new(),
            point: Vec::new(),
            tie: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            rx: Vec::new(),
            ry: Vec::new(),
            sigma: Vec::new(),
        }
    }

    /// Takes in a residual of a folder; that of a stranger to the block is left out.
    pub fn take(&mut self, names: &Names<'_>, row: &ResidualRef<'_>) {
        let tie = row.kind == "tie";
        let points = if tie { &names.ties } else { &names.surveyed };
        if let (Some(image), Some(point)) = (names.images.get(row.image), points.get(row.point)) {
            self.push([*image, *point], tie, [row.x, row.y], [row.rx, row.ry], row.sigma);
        }
    }

    /// The same images and points with other residuals.
    pub fn with_rows(&self, rows: &[ResidualRow]) -> Self {
        let mut columns = Self {
            image: Vec::new(),
            point: Vec::new(),
            tie: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            rx: Vec::new(),
            ry: Vec::new(),
            sigma: Vec::new(),
            ..self.clone()
        };
        for row in rows {
            let tie = row.kind == ResidualKind::Tie;
            columns.push([row.image.0, row.point], tie, row.observed, row.residual, row.sigma);
        }
        columns
    }

    fn push(&mut self, [image, point]: [u32; 2], tie: bool, at: [f64; 2], residual: [f64; 2], sigma: f64) {
        self.image.push(image);
        self.point.push(point);
        self.tie.push(tie);
        self.x.push(at[0] as f32);
        self.y.push(at[1] as f32);
        self.rx.push(residual[0]);
        self.ry.push(residual[1]);
        self.sigma.push(sigma as f32);
    }

    /// Number of measurements.
    pub fn len(&self) -> usize {
        self.image.len()
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.image.is_empty()
    }

    /// Numbers of the tie measurements.
    pub fn tie_numbers(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.len()).filter(|k| self.tie[*k])
    }

    /// Where the point of a measurement lies about the origin, m.
    pub fn place(&self, k: usize) -> [f64; 3] {
        let places = if self.tie[k] { &self.ties } else { &self.surveyed };
        places[self.point[k] as usize].map(f64::from)
    }

    /// Value of a quantity; NaN where it is not known.
    pub fn value(&self, quantity: Quantity, k: usize) -> f64 {
        let number = self.image[k] as usize;
        let image = &self.images[number];
        match quantity {
            Quantity::Time => image.time,
            Quantity::Temperature => image.temperature,
            Quantity::Order => number as f64 + 1.0,
            Quantity::Row => f64::from(self.y[k]),
            Quantity::Column => f64::from(self.x[k]),
            Quantity::Radius => {
                let [dx, dy] = self.offset_from_middle(k);
                dx.hypot(dy)
            }
            Quantity::Depth => {
                let place = self.place(k);
                (0..3).map(|axis| (place[axis] - image.centre[axis]) * image.view[axis]).sum()
            }
            Quantity::Speed => image.speed,
            Quantity::Heading => image.heading,
            Quantity::CameraHeight => image.centre[2] + self.origin[2],
            Quantity::PointHeight => self.place(k)[2] + self.origin[2],
            Quantity::East => self.place(k)[0] + self.origin[0],
            Quantity::North => self.place(k)[1] + self.origin[1],
        }
    }

    /// Is the quantity known, and not the same everywhere?
    pub fn varies(&self, quantity: Quantity) -> bool {
        let mut all = (0..self.len()).map(|k| self.value(quantity, k)).filter(|v| v.is_finite());
        let Some(first) = all.next() else { return false };
        all.any(|value| (value - first).abs() > 1e-9 * first.abs().max(1.0))
    }

    fn offset_from_middle(&self, k: usize) -> [f64; 2] {
        let middle = self.images[self.image[k] as usize].middle;
        [f64::from(self.x[k]) - middle[0], f64::from(self.y[k]) - middle[1]]
    }

    /// Component of a residual, px; NaN where its direction is not known.
    pub fn component(&self, component: Component, k: usize) -> f64 {
        let r = [self.rx[k], self.ry[k]];
        let dot = |u: [f64; 2]| r[0] * u[0] + r[1] * u[1];
        let turned = |[x, y]: [f64; 2]| [-y, x];
        let radial = || {
            let [x, y] = self.offset_from_middle(k);
            let length = x.hypot(y);
            [x / length, y / length]
        };
        let along = || self.images[self.image[k] as usize].along;
        match component {
            Component::X => r[0],
            Component::Y => r[1],
            Component::Radial => dot(radial()),
            Component::Tangential => dot(turned(radial())),
            Component::Along => dot(along()),
            Component::Across => dot(turned(along())),
        }
    }

    /// RMS per coordinate of some measurements, px; `None` of none.
    pub fn rms(&self, of: impl Iterator<Item = usize>) -> Option<f64> {
        let (n, sum) = of.fold((0usize, 0.0), |(n, sum), k| (n + 2, sum + self.rx[k].powi(2) + self.ry[k].powi(2)));
        (n > 0).then(|| (sum / n as f64).sqrt())
    }

    /// RMS per coordinate of the ties of each image that are `wanted`, px.
    pub fn rms_of_images(&self, wanted: impl Fn(usize) -> bool) -> Vec<Option<f64>> {
        let residuals =
            self.tie_numbers().filter(|k| wanted(*k)).map(|k| (self.image[k] as usize, [self.rx[k], self.ry[k]]));
        crate::run::rms_by(self.images.len(), residuals)
    }
}
