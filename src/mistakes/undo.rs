//! Edits that undo mistakes of surveyed positions.

use super::shape::Change;
use super::survey::Subject;
use crate::block::edit::{self, Edit};
use nalgebra::Vector3;

/// What undoes a change of a whole group. Degrees have no edit: a projection belongs to a program for coordinates. Nor
/// has another instant: the receiver recorded the right one.
pub fn edits_of(subject: Subject, change: Change) -> Vec<Edit> {
    let column = |axis: usize| subject.columns()[axis].to_string();
    match change {
        Change::HeightUnit(metres) => vec![subject.edit(edit::Change::times(&column(2), metres))],
        Change::Exchanged(a, b) => {
            vec![subject.edit(edit::Change::ExchangeColumns { columns: [column(a), column(b)] })]
        }
        Change::Reversed(axis) => vec![subject.edit(edit::Change::times(&column(axis), -1.0))],
        Change::Shifted(by) => {
            let within = if subject == Subject::Gnss { "flight" } else { "" };
            let columns = subject.columns().map(String::from).to_vec();
            vec![subject.edit(edit::Change::Shift { columns, by: by as i64, within: within.into() })]
        }
        Change::None | Change::Degrees(_) | Change::Clock(_) => Vec::new(),
    }
}

/// A shift of a group, undone.
pub fn shifted_back(subject: Subject, shift: &Vector3<f64>) -> Vec<Edit> {
    let axes = (0..3).filter(|axis| shift[*axis] != 0.0);
    axes.map(|axis| subject.edit(edit::Change::plus(subject.columns()[axis], -shift[axis]))).collect()
}

/// Positions of images that are left out.
pub fn without_positions(names: &[String]) -> Vec<Edit> {
    let columns = Subject::Gnss.columns().map(String::from).to_vec();
    vec![Subject::Gnss.edit(edit::Change::Clear { columns }).of("image", names)]
}

/// A control point that is compared and takes no part.
pub fn as_check(subject: Subject, name: &str) -> Vec<Edit> {
    let change = edit::Change::Set { column: "role".into(), value: "check".into() };
    if subject == Subject::Control { vec![subject.edit(change).of("point", &[name.into()])] } else { Vec::new() }
}
