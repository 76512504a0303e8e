//! What the screening is given: recorded positions beside those that the images give.

use crate::block::edit::{Change, Edit};
use nalgebra::{Matrix3, Vector3};

/// Which group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// Control points.
    Control,
    /// Check points.
    Check,
    /// GNSS positions.
    Gnss,
}

impl Subject {
    /// Key.
    pub fn key(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::Check => "check",
            Self::Gnss => "gnss",
        }
    }

    /// For a person, at the begin of a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::Control => "Control points",
            Self::Check => "Check points",
            Self::Gnss => "GNSS positions",
        }
    }

    /// Columns that hold it.
    pub fn columns(self) -> [&'static str; 3] {
        match self {
            Self::Control | Self::Check => ["x", "y", "z"],
            Self::Gnss => ["gnss_x", "gnss_y", "gnss_z"],
        }
    }

    /// An edit of all rows that hold it.
    pub fn edit(self, change: Change) -> Edit {
        match self {
            Self::Control | Self::Check => Edit::all("control.csv", change).of("role", &[self.key().into()]),
            Self::Gnss => Edit::all("images.csv", change),
        }
    }

    /// The file, and columns, that hold it.
    pub fn place(self) -> &'static str {
        match self {
            Self::Control | Self::Check => "x, y, z of control.csv",
            Self::Gnss => "gnss_x, gnss_y, gnss_z of images.csv",
        }
    }
}

/// One position.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// Name of the point or image.
    pub name: String,
    /// As recorded, in the coordinate system of the block's files, m.
    pub recorded: Vector3<f64>,
    /// In the free network; `None` where the images do not give it.
    pub computed: Option<Vector3<f64>>,
    /// Of `computed`, where it was asked for: an image that few tie points hold is where nobody knows.
    pub covariance: Matrix3<f64>,
    /// Flight of an image; 0 for points.
    pub flight: usize,
    /// When the image was taken, s; `None` for points and where it is not known.
    pub time: Option<f64>,
}

/// Positions that were recorded together.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Which.
    pub subject: Subject,
    /// Standard deviations, horizontal and height: as stated, and of the marks of a point, m.
    pub sigma: [f64; 2],
    /// In the order of the file.
    pub members: Vec<Member>,
    /// Names of the flights; none for points.
    pub flights: Vec<String>,
}

/// What is known of the focal length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Focal {
    /// The tie points tell it: its standard deviation as a share of it.
    Determined(f64),
    /// The tie points do not, and it is taken as stated.
    Stated,
}

/// The groups of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Those that have members.
    pub groups: Vec<Group>,
    /// Upwards in the free network, as far as the approximate orientation knows it.
    pub up: Vector3<f64>,
    /// Mean way from the points to the images that see them, in the free network.
    pub cameras: Vector3<f64>,
    /// Mean distance from the images to the points that they see, in the free network.
    pub distance: f64,
    /// What a pixel is on the object, in the free network.
    pub pixel: f64,
    /// How well the focal length is known, which moves all images up or down against the points.
    pub focal: Focal,
}

/// Measurements that were set aside of something, and all of it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Count {
    /// Name of the point or image.
    pub name: String,
    /// Set aside.
    pub aside: usize,
    /// All.
    pub all: usize,
}
