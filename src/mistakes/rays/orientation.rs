//! Conventions of the approximate orientation: rotations and positions of other programs.

use super::scene::{Scene, Scope};
use crate::block::Pose;
use crate::block::edit::{Change, Edit};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// How poses are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// Rotations are camera to world.
    Inverse,
    /// `qw, qx, qy, qz` hold x, y, z, w.
    RealLast,
    /// `qx, qy, qz, qw` hold w, x, y, z.
    RealFirst,
    /// Other camera axes.
    Axes {
        /// y upwards and z backwards.
        backwards: bool,
        /// Quarter turns about the viewing axis.
        quarters: u8,
    },
    /// x and y of the positions are exchanged.
    Exchanged,
    /// An axis of the positions is reversed.
    Reversed(usize),
    /// Positions are the translations `t = -R C`.
    Translation,
}

/// Columns of the quaternion that are exchanged, one pair after the other.
const REAL_LAST: [[&str; 2]; 3] = [["qw", "qz"], ["qx", "qz"], ["qy", "qz"]];
const REAL_FIRST: [[&str; 2]; 3] = [["qw", "qx"], ["qx", "qy"], ["qy", "qz"]];
const AXES: [&str; 3] = ["x", "y", "z"];

impl Orientation {
    /// The turn of the camera axes, from the left.
    fn turn(self) -> Option<UnitQuaternion<f64>> {
        let Self::Axes { backwards, quarters } = self else { return None };
        let about = |axis: Vector3<f64>, quarters: u8| {
            UnitQuaternion::from_scaled_axis(axis * (f64::from(quarters) * std::f64::consts::FRAC_PI_2))
        };
        Some(about(Vector3::z(), quarters) * about(Vector3::x(), if backwards { 2 } else { 0 }))
    }

    fn pose(self, pose: &Pose, origin: &Vector3<f64>) -> Pose {
        let [x, y, z, w]: [f64; 4] = pose.rotation.coords.into();
        let quaternion = |w, x, y, z| UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let rotation = match self {
            Self::Inverse => pose.rotation.inverse(),
            // The recorded w holds x, and so on.
            Self::RealLast => quaternion(z, w, x, y),
            Self::RealFirst => quaternion(x, y, z, w),
            Self::Axes { .. } => self.turn().map_or(pose.rotation, |turn| turn * pose.rotation),
            _ => pose.rotation,
        };
        let mut centre = pose.centre;
        match self {
            Self::Exchanged => centre.swap_rows(0, 1),
            Self::Reversed(axis) => centre[axis] = -centre[axis],
            Self::Translation => centre = -(pose.rotation.inverse() * (pose.centre + origin)) - origin,
            _ => {}
        }
        Pose { rotation, centre }
    }

    /// The scene with poses in the convention of a block.
    pub fn undo(self, scene: &mut Scene) -> Option<()> {
        let origin = scene.origin;
        scene.views.iter_mut().for_each(|view| view.pose = self.pose(&view.pose, &origin));
        Some(())
    }

    /// Edits of `images.csv` that undo it.
    pub fn edits(self, scope: &Scope<'_>) -> Vec<Edit> {
        let restricted = |change: Change| match scope.is_everything() {
            true => Edit::all("images.csv", change),
            false => {
                let names: Vec<String> = scope.cameras().into_iter().flat_map(|camera| scope.images(camera)).collect();
                Edit::all("images.csv", change).of("image", &names)
            }
        };
        let unit = [1.0, 0.0, 0.0, 0.0];
        let exchange = |columns: [&str; 2]| restricted(Change::ExchangeColumns { columns: columns.map(String::from) });
        match self {
            Self::Inverse => vec![restricted(Change::Turn { inverse: true, after: unit, before: unit })],
            Self::RealLast => REAL_LAST.map(exchange).into(),
            Self::RealFirst => REAL_FIRST.map(exchange).into(),
            Self::Axes { .. } => {
                let turn = self.turn().unwrap_or_default();
                let after = [turn.w, turn.i, turn.j, turn.k];
                vec![restricted(Change::Turn { inverse: false, after, before: unit })]
            }
            Self::Exchanged => vec![exchange(["x", "y"])],
            Self::Reversed(axis) => {
                AXES.get(axis).map(|name| restricted(Change::times(name, -1.0))).into_iter().collect()
            }
            Self::Translation => self.positions(scope),
        }
    }

    /// The position of each image set anew.
    fn positions(self, scope: &Scope<'_>) -> Vec<Edit> {
        let cameras = scope.cameras();
        let mut edits = Vec::new();
        for view in scope.scene.views.iter().filter(|view| cameras.contains(&view.camera)) {
            let centre = self.pose(&view.pose, &scope.scene.origin).centre + scope.scene.origin;
            for (axis, column) in AXES.into_iter().enumerate() {
                let change = Change::Set { column: column.into(), value: format!("{:.6}", centre[axis]) };
                edits.push(Edit::all("images.csv", change).of("image", std::slice::from_ref(&view.name)));
            }
        }
        edits
    }

    /// Key.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Inverse => "inverse-rotation",
            Self::RealLast | Self::RealFirst => "quaternion-order",
            Self::Axes { .. } => "camera-axes",
            Self::Exchanged | Self::Reversed(_) => "position-axes",
            Self::Translation => "position-frame",
        }
    }

    /// For a person: how poses are recorded, and how to convert them.
    pub fn words(self) -> [String; 2] {
        match self {
            Self::Inverse => [
                "the rotations are inverted, camera to world".into(),
                "Invert the rotations (qw, qx, qy, qz of images.csv are world to camera)".into(),
            ],
            Self::RealLast => [
                "the quaternions have the order x, y, z, w".into(),
                "Move the last number of each quaternion to the front (qw, qx, qy, qz of images.csv)".into(),
            ],
            Self::RealFirst => [
                "the quaternions have the order w, x, y, z in columns for x, y, z, w".into(),
                "Move the numbers to the columns of their names (qw, qx, qy, qz of images.csv)".into(),
            ],
            Self::Axes { backwards, quarters } => {
                let turned = match quarters {
                    0 => String::new(),
                    quarters => format!("turned by {} degrees about the viewing axis", 90 * u32::from(quarters)),
                };
                let axes = match (backwards, quarters) {
                    (true, 0) => "y upwards and z backwards".to_string(),
                    (true, _) => format!("y upwards and z backwards, {turned}"),
                    (false, _) => turned,
                };
                [
                    format!("the rotations are those of other camera axes: {axes}"),
                    "Convert the rotations to x right, y down, z forward (qw, qx, qy, qz of images.csv)".into(),
                ]
            }
            Self::Exchanged => [
                "x and y of the approximate positions are exchanged".into(),
                "Exchange the two columns (x, y of images.csv)".into(),
            ],
            Self::Reversed(axis) => {
                let name = AXES.get(axis).copied().unwrap_or_default();
                [
                    format!("{name} of the approximate positions has the wrong sign"),
                    format!("Change the sign of this column ({name} of images.csv)"),
                ]
            }
            Self::Translation => [
                "x, y, z of the images are translations (t = -R C), not projection centres".into(),
                "Compute the projection centres C = -R' t (x, y, z of images.csv)".into(),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose() -> Pose {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(2.0, -0.4, 0.9));
        Pose { rotation, centre: Vector3::new(3.0, -7.0, 40.0) }
    }

    fn moved(pairs: [[&str; 2]; 3], recorded: [f64; 4]) -> [f64; 4] {
        let columns = ["qw", "qx", "qy", "qz"];
        let at = |name: &str| columns.iter().position(|column| *column == name).expect("a column");
        pairs.into_iter().fold(recorded, |mut row, [a, b]| {
            row.swap(at(a), at(b));
            row
        })
    }

    #[test]
    fn edits_of_columns_do_as_the_change_of_the_pose() {
        let recorded = pose();
        let q = recorded.rotation;
        for (orientation, pairs) in [(Orientation::RealLast, REAL_LAST), (Orientation::RealFirst, REAL_FIRST)] {
            let changed = orientation.pose(&recorded, &Vector3::zeros()).rotation;
            let [w, x, y, z] = moved(pairs, [q.w, q.i, q.j, q.k]);
            let expected = Quaternion::new(w, x, y, z);
            assert!((changed.into_inner() - expected).norm() < 1e-12, "{orientation:?}: {changed:?} {expected:?}");
        }
    }

    #[test]
    fn translations_become_centres_whatever_the_origin() {
        let truth = pose();
        let origin = Vector3::new(400.0, 0.0, -20.0);
        let absolute = truth.centre + origin;
        let recorded = Pose { centre: -(truth.rotation * absolute) - origin, ..truth };
        let found = Orientation::Translation.pose(&recorded, &origin);
        assert!((found.centre - truth.centre).norm() < 1e-9);
    }

    #[test]
    fn axes_that_look_backwards_look_forward() {
        let axes = Orientation::Axes { backwards: true, quarters: 0 };
        let turned =
            axes.pose(&Pose { rotation: UnitQuaternion::identity(), centre: Vector3::zeros() }, &Vector3::zeros());
        assert!((turned.rotation * Vector3::new(0.1, 0.2, -1.0) - Vector3::new(0.1, -0.2, 1.0)).norm() < 1e-12);
    }
}
