//! What the plausibility checks are given: a block's tables as plain values.

use crate::mistakes::survey::Subject;
use nalgebra::Vector3;

/// A camera of `block.toml`.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Its id.
    pub id: String,
    /// Width and height of the sensor, px.
    pub sides: [f64; 2],
    /// Size of a pixel, micrometres, where stated.
    pub pixel_um: Option<f64>,
    /// Focal length, px.
    pub focal: f64,
    /// Principal point, px.
    pub principal: [f64; 2],
    /// Centre of distortion, px.
    pub distortion_centre: [f64; 2],
    /// `k1, k2, k3`, px^-2, px^-4, px^-6.
    pub radial: [f64; 3],
    /// `p1, p2`, px^-1.
    pub decentring: [f64; 2],
}

/// Least focal length as a share of the longer side: a central projection has no angle of view beyond 157 degrees.
const SHORTEST_FOCAL: f64 = 0.1;
/// Greatest one: no lens of a survey has an angle of view below three degrees.
const LONGEST_FOCAL: f64 = 20.0;

impl Camera {
    /// Longer side, px.
    pub fn longer(&self) -> f64 {
        self.sides[0].max(self.sides[1])
    }

    /// Shorter side, px.
    pub fn shorter(&self) -> f64 {
        self.sides[0].min(self.sides[1])
    }

    /// Centre of the sensor, px.
    pub fn centre(&self) -> [f64; 2] {
        self.sides.map(|side| 0.5 * side)
    }

    /// Half the diagonal, px.
    pub fn half_diagonal(&self) -> f64 {
        0.5 * self.sides[0].hypot(self.sides[1])
    }

    /// Pixels per millimetre, where the size of a pixel is stated.
    pub fn per_mm(&self) -> Option<f64> {
        self.pixel_um.map(|um| 1e3 / um).filter(|factor| factor.is_finite() && *factor > 0.0)
    }

    /// Can this be a focal length of the sensor, px?
    pub fn is_focal(&self, px: f64) -> bool {
        px >= SHORTEST_FOCAL * self.longer() && px <= LONGEST_FOCAL * self.longer()
    }
}

/// A row of `images.csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Its name.
    pub name: String,
    /// Number of its camera.
    pub camera: usize,
    /// Number of its flight.
    pub flight: usize,
    /// Exposure time, s.
    pub time_s: Option<f64>,
    /// Temperature of the camera, degrees Celsius.
    pub temperature_c: Option<f64>,
    /// Approximate projection centre, m.
    pub centre: Vector3<f64>,
    /// GNSS position, m.
    pub gnss: Option<Vector3<f64>>,
    /// Velocity of the platform, m/s.
    pub velocity: Option<Vector3<f64>>,
    /// Approximate viewing direction in the world, of length one.
    pub view: Vector3<f64>,
    /// The GNSS position if latitude and longitude were exchanged, m, where the block's system tells it.
    pub gnss_exchanged: Option<Vector3<f64>>,
}

/// A row of `control.csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct Surveyed {
    /// Its name.
    pub name: String,
    /// Control or check.
    pub subject: Subject,
    /// As recorded, m.
    pub position: Vector3<f64>,
    /// The same if latitude and longitude were exchanged, m, where the block's system tells it.
    pub exchanged: Option<Vector3<f64>>,
    /// Where its marks meet at the approximate poses, m; `None` where they do not.
    pub met: Option<Vector3<f64>>,
}

/// A row of `ties.csv` or `marks.csv`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Number of the image.
    pub image: usize,
    /// Number of the point in its list.
    pub point: usize,
    /// px.
    pub xy: [f64; 2],
    /// Standard deviation as stated, of the row or of the block, px.
    pub sigma: f64,
}

/// Which image measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measured {
    /// Tie points.
    Ties,
    /// Surveyed points.
    Marks,
}

impl Measured {
    /// Key of the subject.
    pub fn key(self) -> &'static str {
        match self {
            Self::Ties => "ties",
            Self::Marks => "marks",
        }
    }

    /// The file that holds them.
    pub fn file(self) -> &'static str {
        match self {
            Self::Ties => "ties.csv",
            Self::Marks => "marks.csv",
        }
    }

    /// For a person, at the begin of a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::Ties => "Tie points",
            Self::Marks => "Marks of surveyed points",
        }
    }
}

/// A table of image measurements. Rows are asked for one by one: a block of millions is not copied.
pub struct Table<'a> {
    /// Which.
    pub of: Measured,
    /// Number of rows.
    pub rows: usize,
    /// A row by its number.
    pub row: Box<dyn Fn(usize) -> Row + 'a>,
    /// Number of points.
    pub points: usize,
    /// Name of a point by its number.
    pub point_name: Box<dyn Fn(usize) -> String + 'a>,
}

impl Table<'_> {
    /// All rows, in the order of the file.
    pub fn iter(&self) -> impl Iterator<Item = Row> + '_ {
        (0..self.rows).map(|k| (self.row)(k))
    }
}

/// The tables of a block.
pub struct Tables<'a> {
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Images, in the order of the file.
    pub images: Vec<Image>,
    /// Tie-point measurements.
    pub ties: Table<'a>,
    /// Image measurements of surveyed points.
    pub marks: Table<'a>,
    /// Surveyed points, in the order of the file.
    pub surveyed: Vec<Surveyed>,
    /// Where the zero of all object coordinates lies in the system of the files, m.
    pub origin: Vector3<f64>,
    /// Does the name of the block's system say that it is east, north, up about the block?
    pub is_local: bool,
    /// Distance from which nearly all tie points are seen, m, where they have coordinates.
    pub reach: Option<f64>,
}

impl Tables<'_> {
    /// Camera of an image.
    pub fn camera_of(&self, image: usize) -> &Camera {
        &self.cameras[self.images[image].camera]
    }

    /// Of each surveyed point, the images that mark it.
    fn marking(&self) -> Vec<Vec<usize>> {
        let mut images = vec![Vec::new(); self.surveyed.len()];
        for row in self.marks.iter() {
            if let Some(own) = images.get_mut(row.point) {
                own.push(row.image);
            }
        }
        images
    }

    /// Surveyed points that images mark, with these images; all points where no image marks any yet. A list may hold
    /// the points of a whole country.
    pub fn taking_part(&self) -> Vec<(&Surveyed, Vec<usize>)> {
        let marking = self.marking();
        let is_any_marked = marking.iter().any(|images| !images.is_empty());
        let all = self.surveyed.iter().zip(marking);
        all.filter(|(_, images)| !is_any_marked || !images.is_empty()).collect()
    }

    /// Names of the images of some cameras.
    pub fn images_of(&self, cameras: &[usize]) -> Vec<String> {
        let own = self.images.iter().filter(|image| cameras.contains(&image.camera));
        own.map(|image| image.name.clone()).collect()
    }
}

/// Small tables for the tests of the checks.
#[cfg(test)]
pub(super) mod made {
    use super::*;

    /// 4000 x 3000 px of 2 um, a focal length of 3000 px.
    pub fn camera() -> Camera {
        Camera {
            id: "cam".into(),
            sides: [4000.0, 3000.0],
            pixel_um: Some(2.0),
            focal: 3000.0,
            principal: [2010.0, 1495.0],
            distortion_centre: [2010.0, 1495.0],
            radial: [-1e-8, 2e-16, 0.0],
            decentring: [1e-7, -1e-7],
        }
    }

    /// An image of the first camera and flight at a place.
    pub fn image(k: usize, centre: Vector3<f64>) -> Image {
        let name = format!("i{k}");
        let (velocity, gnss, view) = (None, None, -Vector3::z());
        let (time_s, temperature_c, gnss_exchanged) = (None, None, None);
        Image { name, camera: 0, flight: 0, time_s, temperature_c, centre, gnss, velocity, view, gnss_exchanged }
    }

    /// Strips of ten images over flat ground, 10 m apart at 5 m/s, with times and velocities.
    pub fn images(count: usize) -> Vec<Image> {
        let one = |k: usize| {
            let (strip, along) = (k / 10, (k % 10) as f64);
            let (x, speed) = if strip % 2 == 0 { (10.0 * along, 5.0) } else { (90.0 - 10.0 * along, -5.0) };
            // A little wind across: nothing in a flight is exactly straight.
            let velocity = Vector3::new(speed, 0.0, 0.1 * (k as f64).sin());
            let centre = Vector3::new(x, 20.0 * strip as f64, 50.0);
            Image { time_s: Some(2.0 * k as f64), velocity: Some(velocity), ..image(k, centre) }
        };
        (0..count).map(one).collect()
    }

    /// A table of rows.
    pub fn table(of: Measured, rows: Vec<Row>) -> Table<'static> {
        let points = rows.iter().map(|row| row.point + 1).max().unwrap_or(0);
        let count = rows.len();
        Table {
            of,
            rows: count,
            row: Box::new(move |k| rows[k]),
            points,
            point_name: Box::new(|point| format!("p{point}")),
        }
    }

    /// Measurements over the whole sensor: 50 points in each of a number of images; neighbours share their points.
    pub fn rows(images: usize) -> Vec<Row> {
        let one = |image: usize, point: usize| {
            let k = (97 * image + 31 * point) as f64;
            let xy = [4000.0 * (0.618_034 * k).fract(), 3000.0 * (0.754_878 * k).fract()];
            Row { image, point, xy, sigma: 0.5 }
        };
        (0..images).flat_map(|image| (25 * image..25 * image + 50).map(move |point| one(image, point))).collect()
    }

    /// A good block of ten images and a camera.
    pub fn tables() -> Tables<'static> {
        with_rows(rows(10))
    }

    /// The same with other measurements of tie points.
    pub fn with_rows(rows: Vec<Row>) -> Tables<'static> {
        Tables {
            cameras: vec![camera()],
            images: images(10),
            ties: table(Measured::Ties, rows),
            marks: table(Measured::Marks, Vec::new()),
            surveyed: Vec::new(),
            origin: Vector3::zeros(),
            is_local: false,
            reach: None,
        }
    }

    /// The block of [`tables`] with GNSS positions near its poses, and control points that three images each mark.
    pub fn surveyed(places: &[[f64; 3]]) -> Tables<'static> {
        let mut tables = tables();
        for (k, image) in tables.images.iter_mut().enumerate() {
            image.gnss = Some(image.centre + Vector3::new(0.3, -0.2, 0.1 * k as f64));
        }
        let point = |(k, place): (usize, &[f64; 3])| Surveyed {
            name: format!("g{k}"),
            subject: Subject::Control,
            position: Vector3::from(*place),
            exchanged: None,
            met: None,
        };
        tables.surveyed = places.iter().enumerate().map(point).collect();
        let mark = |k: usize| Row { image: k % 3, point: k / 3, xy: [100.0 * (k / 3) as f64, 50.0], sigma: 0.5 };
        tables.marks = table(Measured::Marks, (0..3 * places.len()).map(mark).collect());
        tables.reach = Some(60.0);
        tables
    }

    /// The same with other images and no measurement.
    pub fn with_images(images: Vec<Image>) -> Tables<'static> {
        Tables { images, ties: table(Measured::Ties, Vec::new()), ..tables() }
    }
}
