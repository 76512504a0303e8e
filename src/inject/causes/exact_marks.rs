//! Marks free of every error of the images: shows what the block's deformation alone does to a point, because in a
//! disturbed image part of the error cancels or adds up in the mark itself.

use super::*;
use crate::block::Role;
use crate::inject::Loss;

pub(super) static CAUSE: Cause = Cause {
    id: "exact-marks",
    summary: "marks as they would be without any of the other errors but noise",
    parameters: &[parameter(
        "role",
        "",
        DefaultValue::Choice("check", &["check", "control", "both"]),
        "of which points",
    )],
    prepare,
};

struct ExactMarks {
    check: bool,
    control: bool,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let of = |role: &str| ["both", role].contains(&setting.values.word("role"));
    unless(false, ExactMarks { check: of("check"), control: of("control") })
}

impl Action for ExactMarks {
    fn measured(&mut self, world: &World, observations: &mut Observations) {
        for (seen, mark) in observations.marks.iter_mut().zip(&world.marks) {
            let point = &world.surveyed[mark.point.index()];
            let exact = match point.role {
                Role::Check => self.check,
                Role::Control => self.control,
            };
            if exact {
                *seen = world.exact(mark.image.index(), &point.position).ok_or(Loss::Behind);
            }
        }
    }
}
