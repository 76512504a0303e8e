//! Mistakes in sentences, with what to do about them and the edits that undo them.

mod common;
mod group;
mod members;
mod pair;
mod set_aside;
#[cfg(test)]
mod tests;

pub use common::list;
pub use group::{changed, collapsed, contradicting, in_short};
pub use members::{exchanged, exchanged_images, flight_offset, wrong_coordinate, wrong_position, wrong_positions};
pub use pair::{
    height_offset, is_of_one_point, of_one_point, other_frame, plan_offset, recorded_otherwise, rotation, scale, tilt,
};
pub use set_aside::{images_set_aside, points_set_aside, share_set_aside};
