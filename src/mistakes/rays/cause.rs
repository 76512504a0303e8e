//! One convention that may be wrong, whatever it concerns.

use super::coordinates::Coordinates;
use super::lens::Lens;
use super::orientation::Orientation;
use super::scene::{Scene, Scope};
use crate::block::edit::Edit;

/// Image measurements that are examined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// Tie points.
    Ties,
    /// Marks of surveyed points.
    Marks,
}

impl Table {
    /// Key of a subject.
    pub fn key(self) -> &'static str {
        match self {
            Self::Ties => "ties",
            Self::Marks => "marks",
        }
    }

    /// The file.
    pub fn file(self) -> &'static str {
        match self {
            Self::Ties => "ties.csv",
            Self::Marks => "marks.csv",
        }
    }
}

/// One convention.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// Of the measured coordinates.
    Coordinates(Coordinates),
    /// Of the approximate poses.
    Orientation(Orientation),
    /// Of the camera.
    Lens(Lens),
}

impl Cause {
    /// The scene without the mistake; `None` where it cannot be undone.
    pub fn undo(self, scene: &mut Scene) -> Option<()> {
        match self {
            Self::Coordinates(coordinates) => coordinates.undo(scene),
            Self::Orientation(orientation) => orientation.undo(scene),
            Self::Lens(lens) => lens.undo(scene),
        }
    }

    /// Edits of the block's files; `tables`: measurements that share the convention.
    pub fn edits(self, scope: &Scope<'_>, tables: &[&str]) -> Vec<Edit> {
        match self {
            Self::Coordinates(coordinates) => coordinates.edits(scope, tables),
            Self::Orientation(orientation) => orientation.edits(scope),
            Self::Lens(lens) => lens.edits(scope),
        }
    }

    /// Subject and key.
    pub fn kind(self, table: Table) -> [&'static str; 2] {
        match self {
            Self::Coordinates(coordinates) => [table.key(), coordinates.kind()],
            Self::Orientation(orientation) => ["images", orientation.kind()],
            Self::Lens(lens) => lens.kind(),
        }
    }

    /// Size and unit, where there is one.
    pub fn value(self, scope: &Scope<'_>) -> Option<(f64, &'static str)> {
        let of_first = |change: Lens| -> Option<f64> {
            let first = scope.cameras().into_iter().next()?;
            Some(change.camera(&scope.scene.cameras[first])?.interior[crate::camera::F])
        };
        match self {
            Self::Coordinates(Coordinates::Scaled(times)) | Self::Lens(Lens::OtherSize(times)) => {
                Some((1.0 / times, "1"))
            }
            Self::Lens(lens @ (Lens::Focal(_) | Lens::FocalMillimetres)) => Some((of_first(lens)?, "px")),
            _ => None,
        }
    }

    /// For a person: how things are recorded, and how to convert them.
    pub fn words(self) -> [String; 2] {
        match self {
            Self::Coordinates(coordinates) => coordinates.words(),
            Self::Orientation(orientation) => orientation.words(),
            Self::Lens(lens) => lens.words(),
        }
    }
}
