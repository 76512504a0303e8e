//! What is known of a group once it was held against the free network.

use super::Mistake;
use super::align::{Aligned, FEWEST};
use super::survey::{Group, Subject};
use nalgebra::Vector3;

/// A group that was judged.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Its members that the images give.
    pub group: Group,
    /// Their positions in the free network.
    pub computed: Vec<Vector3<f64>>,
    /// Recorded positions, the mistake of the whole group undone.
    pub targets: Vec<Vector3<f64>>,
    /// The similarity.
    pub aligned: Aligned,
    /// What a pixel is on the object, in the system of the targets.
    pub pixel: f64,
    /// Are the targets in the system of the block? Degrees become metres of some system.
    pub placed: bool,
    /// Members that do not fit.
    pub wrong: Vec<usize>,
    /// What was found.
    pub mistakes: Vec<Mistake>,
}

/// A group of too few members to be judged by itself.
#[derive(Debug, Clone)]
pub struct Few {
    /// Which.
    pub subject: Subject,
    /// Standard deviations as stated, m.
    pub sigma: [f64; 2],
    /// Positions in the free network.
    pub computed: Vec<Vector3<f64>>,
    /// As recorded.
    pub targets: Vec<Vector3<f64>>,
}

impl Few {
    /// `None` of a group that has enough members, or none.
    pub fn of(group: &Group) -> Option<Self> {
        let seen = group.members.iter().filter_map(|member| Some((member.computed?, member.recorded)));
        let (computed, targets): (Vec<_>, Vec<_>) = seen.unzip();
        let few = (1..FEWEST).contains(&targets.len());
        few.then_some(Self { subject: group.subject, sigma: group.sigma, computed, targets })
    }
}
