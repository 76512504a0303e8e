//! Writing and reading a block gives the same block, to the last bit; the real blocks read.

use crate::beside;
use misclosure::block::*;
use misclosure::camera::Camera;
use misclosure::io::block::{read_block, write_block};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};

/// Number of random blocks.
const BLOCKS: u64 = 200;

/// What readers take for a coordinate, m, or a component of a velocity, m/s.
const LARGEST_COORDINATE: f64 = 1e12;

/// Draws what a block may hold, nasty texts and numbers of every size included.
struct Draw(ChaCha8Rng);

impl Draw {
    fn index(&mut self, n: usize) -> usize {
        self.0.random_range(0..n)
    }

    fn coin(&mut self) -> bool {
        self.0.random()
    }

    /// A text of characters that CSV and TOML treat specially; not empty.
    fn text(&mut self) -> String {
        const CHARACTERS: [char; 18] = [
            'a', 'Z', '7', ' ', ',', ';', '"', '\'', '\\', '\n', '\r', '\t', '#', '=', 'é', '点', '\u{feff}', '\u{7f}',
        ];
        let length = 1 + self.index(6);
        (0..length).map(|_| CHARACTERS[self.index(CHARACTERS.len())]).collect()
    }

    /// Different texts.
    fn names(&mut self, n: usize) -> Vec<String> {
        (0..n).map(|i| format!("{}{i}", self.text())).collect()
    }

    /// Any finite number.
    fn number(&mut self) -> f64 {
        loop {
            let number = f64::from_bits(self.0.random());
            if number.is_finite() {
                return number;
            }
        }
    }

    /// A number of every size that a coordinate may have.
    fn coordinate(&mut self) -> f64 {
        loop {
            let number = self.number();
            if number.abs() <= LARGEST_COORDINATE {
                return number;
            }
        }
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.coordinate(), self.coordinate(), self.coordinate())
    }

    fn positive(&mut self) -> f64 {
        self.number().abs().max(f64::MIN_POSITIVE)
    }

    fn maybe<T>(&mut self, draw: impl Fn(&mut Self) -> T) -> Option<T> {
        if self.coin() { Some(draw(self)) } else { None }
    }

    fn sigma(&mut self) -> Sigma {
        let mut sigma = || self.positive();
        Sigma {
            tie_px: sigma(),
            mark_px: sigma(),
            control_xy_m: sigma(),
            control_z_m: sigma(),
            gnss_xy_m: sigma(),
            gnss_z_m: sigma(),
        }
    }

    fn camera(&mut self, id: String) -> Camera {
        let mut interior = std::array::from_fn(|_| self.number());
        interior[0] = self.positive();
        Camera {
            id,
            width_px: self.0.random_range(1..=u32::MAX),
            height_px: self.0.random_range(1..=u32::MAX),
            pixel_um: self.maybe(Self::positive),
            interior,
        }
    }

    fn image(&mut self, name: String, camera: CameraId, flight: FlightId) -> Image {
        let q = Quaternion::from_vector(nalgebra::Vector4::from_fn(|_, _| self.0.random_range(-1.0..1.0)));
        Image {
            name,
            camera,
            flight,
            time_s: self.maybe(Self::number),
            temperature_c: self.maybe(Self::number),
            pose: Pose { rotation: UnitQuaternion::new_normalize(q), centre: self.vector() },
            gnss: self.maybe(|draw| Gnss {
                position: draw.vector(),
                sigma_xy: draw.maybe(Self::positive),
                sigma_z: draw.maybe(Self::positive),
            }),
            velocity: self.maybe(Self::vector),
            angular_velocity: self.maybe(Self::vector),
            exposure_s: self.maybe(Self::positive),
            focus_m: self.maybe(Self::positive),
        }
    }

    fn measurement(&mut self, block: &Block, image: usize, point: usize) -> Measurement {
        let camera = block.camera_of(ImageId::from(image));
        Measurement {
            image: ImageId::from(image),
            point: PointId::from(point),
            x: self.0.random_range(-0.05..1.0) * f64::from(camera.width_px),
            y: self.0.random_range(0.0..1.05) * f64::from(camera.height_px),
            sigma: self.maybe(Self::positive),
        }
    }

    /// A block in the order in which the reader numbers things.
    fn block(&mut self) -> Block {
        let cameras = 1 + self.index(3);
        let images = 3 + self.index(5);
        let flights = 1 + self.index(2);
        let (camera_names, image_names, flight_names) = (self.names(cameras), self.names(images), self.names(flights));
        let mut block = Block {
            name: self.text(),
            crs: self.text(),
            survey_crs: "EPSG:32633".into(),
            sigma: self.sigma(),
            cameras: camera_names.into_iter().map(|name| self.camera(name)).collect(),
            flights: flight_names,
            images: Vec::new(),
            tie_points: Vec::new(),
            ties: Vec::new(),
            surveyed: Vec::new(),
            marks: Vec::new(),
            origin: nalgebra::Vector3::zeros(),
            extra_image_columns: Vec::new(),
        };
        for (i, name) in image_names.into_iter().enumerate() {
            // The first images use every camera and every flight in order.
            let camera = if i < cameras { i } else { self.index(cameras) };
            let flight = if i < flights { i } else { self.index(flights) };
            block.images.push(self.image(name, CameraId::from(camera), FlightId::from(flight)));
        }
        let points = self.index(8);
        let with_position = self.index(points + 1);
        for (i, name) in self.names(points).into_iter().enumerate() {
            block.tie_points.push(TiePoint { name, position: (i < with_position).then(|| self.vector()) });
            let mut order: Vec<usize> = (0..images).collect();
            order.shuffle(&mut self.0);
            for image in &order[..2 + self.index(images - 1)] {
                let tie = self.measurement(&block, *image, i);
                block.ties.push(tie);
            }
        }
        // At least one mark, so that a block without tie points is one.
        let surveyed = 1 + self.index(4);
        for (i, name) in self.names(surveyed).into_iter().enumerate() {
            let role = if self.coin() { Role::Control } else { Role::Check };
            let (sigma_xy, sigma_z) = (self.maybe(Self::positive), self.maybe(Self::positive));
            block.surveyed.push(SurveyedPoint { name, position: self.vector(), role, sigma_xy, sigma_z });
            let image = self.index(images);
            let mark = self.measurement(&block, image, i);
            block.marks.push(mark);
        }
        for name in {
            let n = self.index(3);
            self.names(n)
        } {
            let cells = (0..images).map(|_| if self.coin() { self.text() } else { String::new() }).collect();
            block.extra_image_columns.push((name, cells));
        }
        block
    }
}

/// Contents of the files of a folder, in the order of their names.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|path| (PathBuf::from(path.file_name().unwrap()), std::fs::read(&path).unwrap())).collect()
}

#[test]
fn random_blocks_come_back_to_the_last_bit() {
    for seed in 0..BLOCKS {
        let block = Draw(ChaCha8Rng::seed_from_u64(seed)).block();
        let folder = tempfile::tempdir().unwrap();
        write_block(&block, folder.path()).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let loaded = read_block(folder.path()).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        assert!(loaded.set_aside.is_empty(), "seed {seed}: {}", loaded.set_aside);
        assert_eq!(loaded.block, block, "seed {seed}");
        // `==` takes -0 for 0; the text does not.
        assert_eq!(format!("{:?}", loaded.block), format!("{block:?}"), "seed {seed}");
        let again = tempfile::tempdir().unwrap();
        write_block(&loaded.block, again.path()).unwrap();
        assert!(contents(again.path()) == contents(folder.path()), "seed {seed}: the files differ");
    }
}

#[test]
fn no_table_of_an_older_block_stays() {
    let mut block = Draw(ChaCha8Rng::seed_from_u64(1)).block();
    let folder = tempfile::tempdir().unwrap();
    write_block(&block, folder.path()).unwrap();
    block.surveyed.clear();
    block.marks.clear();
    block.tie_points = vec![TiePoint { name: "p".to_owned(), position: None }];
    let tie = Measurement { image: ImageId(0), point: PointId(0), x: 0.5, y: 0.5, sigma: None };
    block.ties = vec![tie, Measurement { image: ImageId(1), ..tie }];
    write_block(&block, folder.path()).unwrap();
    let names: Vec<PathBuf> = contents(folder.path()).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["block.toml", "images.csv", "ties.csv"].map(PathBuf::from));
    assert_eq!(read_block(folder.path()).unwrap().block, block);
}

#[test]
fn what_could_not_be_read_again_is_not_written() {
    let mut block = Draw(ChaCha8Rng::seed_from_u64(1)).block();
    let folder = tempfile::tempdir().unwrap();
    let message = |block: &Block| write_block(block, folder.path()).unwrap_err().to_string();
    let place = |file: &str| folder.path().join(file).display().to_string();
    block.images[1].pose.centre.y = f64::NAN;
    let expected = format!("{}:3: column y: NaN cannot be written; it is not a number to read", place("images.csv"));
    assert_eq!(message(&block), expected);
    block.cameras[0].interior[5] = f64::INFINITY;
    assert_eq!(message(&block), format!("{}: inf cannot be written; it is not a number to read", place("block.toml")));
}

/// Blocks below a folder beside the project, or none with a word on it.
fn blocks_beside(folder: &str) -> Vec<PathBuf> {
    let Some(root) = beside::shared(folder) else { return Vec::new() };
    let entries = std::fs::read_dir(&root).expect("a folder");
    let mut blocks: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    blocks.retain(|path| path.join("block.toml").is_file());
    blocks.sort();
    assert!(!blocks.is_empty(), "no block in {}", root.display());
    blocks
}

#[test]
fn blocks_from_elsewhere_read_whole_and_come_back_exactly() {
    for path in [blocks_beside("data"), blocks_beside("vectors")].concat() {
        let loaded = read_block(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(loaded.set_aside.to_string(), "nothing", "{}", path.display());
        let rows = |file: &str| {
            std::fs::read_to_string(path.join(file)).map_or(0, |text| text.lines().count().saturating_sub(1))
        };
        let block = loaded.block;
        assert_eq!(
            [block.images.len(), block.ties.len(), block.tie_points.len(), block.surveyed.len(), block.marks.len()],
            ["images.csv", "ties.csv", "points.csv", "control.csv", "marks.csv"].map(rows),
            "{}",
            path.display()
        );
        let folder = tempfile::tempdir().unwrap();
        write_block(&block, folder.path()).unwrap();
        assert_eq!(read_block(folder.path()).unwrap().block, block, "{}", path.display());
    }
}
