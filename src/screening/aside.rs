//! What takes no part, and what that says.

use super::lost::control_points;
use super::undone::with_conventions;
use crate::block::{Block, ByPoint, PointId, Role};
use crate::mistakes::set_aside::{self, Count, SetAside};
use crate::mistakes::{Mistake, Subject};
use crate::model::{Datum, Model};
use crate::problem::MeasurementKind;
use crate::run::fit::Fit;
use crate::snooping::Outliers;
use std::collections::HashSet;

/// The block and model to go on with: what is recorded wrongly takes no part. Control points become check points: they
/// are compared and nothing more. `None` where nothing is to be left out.
pub fn without(block: &Block, model: &Model, mistakes: &[Mistake]) -> Option<(Block, Model)> {
    let mut left = with_conventions(block, mistakes).into_owned();
    for mistake in mistakes {
        let names: HashSet<&str> = mistake.names.iter().map(String::as_str).collect();
        let concerned = |name: &str| names.is_empty() || names.contains(name);
        match subject_left_out(block, mistake) {
            "gnss" => {
                left.images.iter_mut().filter(|image| concerned(&image.name)).for_each(|image| image.gnss = None);
            }
            "control" => {
                let points = left.surveyed.iter_mut().filter(|point| concerned(&point.name));
                points.for_each(|point| point.role = Role::Check);
            }
            _ => {}
        }
    }
    if left == *block {
        return None;
    }
    let control = seen_control(&left) >= FIX;
    let gnss = left.images.iter().any(|image| image.gnss.is_some());
    let datum = match (model.datum, control, gnss) {
        (_, false, false) => Datum::Free,
        (Datum::Control, false, true) => Datum::Gnss,
        (Datum::Gnss, true, false) => Datum::Control,
        (datum, ..) => datum,
    };
    Some((left, Model { datum, ..model.clone() }))
}

/// Control points that fix a block by themselves, as many as a similarity needs.
const FIX: usize = 3;
/// Images in which a point is seen from two directions.
const SEEN: usize = 2;

/// Control points that hold the block: seen from two directions.
fn seen_control(block: &Block) -> usize {
    let marks = ByPoint::new(&block.marks, block.surveyed.len());
    let control = block.surveyed.iter().enumerate().filter(|(_, point)| point.role == Role::Control);
    control.filter(|(k, _)| marks.count(PointId::from(*k)) >= SEEN).count()
}

/// Where control and GNSS disagree and neither is known to be wrong, the diagnosis goes on with control, if there is
/// enough of it.
fn subject_left_out<'a>(block: &Block, mistake: &'a Mistake) -> &'a str {
    let between = ["height-offset", "plan-offset", "other-frame", "rotation", "tilt"].contains(&mistake.kind.as_str());
    let gnss = block.images.iter().any(|image| image.gnss.is_some());
    match mistake.subject.as_str() {
        "control" if between && gnss && block.count(Role::Control) >= FIX => "gnss",
        subject => subject,
    }
}

/// What was set aside of a block as a finding. `fit`: of the block without it.
pub fn of_outliers(
    block: &Block,
    outliers: &Outliers,
    fit: &Fit,
    named: &[Mistake],
    significance: f64,
) -> Vec<Mistake> {
    let mut control: Vec<Count> = block.surveyed.iter().map(|point| of_name(&point.name)).collect();
    let mut images: Vec<Count> = block.images.iter().map(|image| of_name(&image.name)).collect();
    block.marks.iter().for_each(|mark| control[mark.point.index()].all += 1);
    block.ties.iter().for_each(|tie| images[tie.image.index()].all += 1);
    for rejected in &outliers.rejected {
        match rejected.kind {
            MeasurementKind::Mark => control[rejected.point.index()].aside += 1,
            MeasurementKind::Tie => images[rejected.image.index()].aside += 1,
        }
    }
    let is_control = |k: usize| block.surveyed[k].role == Role::Control;
    let control = control.into_iter().enumerate().filter(|(k, _)| is_control(*k)).map(|(_, count)| count).collect();
    let all = block.ties.len() + block.marks.iter().filter(|mark| is_control(mark.point.index())).count();
    let all = Count { aside: outliers.rejected.len(), all, ..Count::default() };
    let counts = SetAside { control, images, all };
    let names = |named: &[Mistake]| named.iter().flat_map(|own| own.names.clone()).collect::<Vec<String>>();
    let aside = |named: &[Mistake]| set_aside::judge(&counts, &names(named), significance);
    let lost: Vec<Mistake> = aside(named).into_iter().filter(|own| own.subject == Subject::Control.key()).collect();
    let mut found = control_points(block, fit, &names(&lost), significance);
    // A point that has a name for its mistake needs no other one.
    let rest = aside(&[named, &found].concat());
    found.extend(rest);
    found
}

fn of_name(name: &str) -> Count {
    Count { name: name.into(), ..Count::default() }
}
