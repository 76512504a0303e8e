//! A blunder in the survey: one point with wrong coordinates, or two whose names were exchanged.

use super::*;
use crate::block::Role;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "control-blunder",
    summary: "one surveyed point wrong, or the names of two exchanged",
    parameters: &[
        parameter("size", "m", DefaultValue::Number(0.5), "how far the point is off"),
        parameter(
            "axis",
            "",
            DefaultValue::Choice("any", &["any", "x", "y", "z"]),
            "in which direction; any: drawn at random",
        ),
        parameter("point", "", DefaultValue::Name("a control point drawn at random"), "the point"),
        parameter("swap", "", DefaultValue::Flag(false), "1: exchange the point with another one instead"),
        parameter("with", "", DefaultValue::Name("a control point drawn at random"), "the other point"),
    ],
    prepare,
};

enum ControlBlunder {
    Move(usize, Vector3<f64>),
    Swap(usize, usize),
}

struct Blunder {
    what: ControlBlunder,
    notes: Vec<(String, String)>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (values, world) = (setting.values, setting.world);
    let size = values.size("size")?;
    let swap = values.flag("swap");
    ensure!(swap || values.word("with").is_empty(), "`with` needs swap=1");
    let mut pick = |name: &str, but: Option<usize>| -> Result<usize> {
        if !name.is_empty() {
            let found = world.surveyed.iter().position(|point| point.name == name);
            return found.ok_or_else(|| anyhow::anyhow!("the block has no surveyed point `{name}`"));
        }
        let control = |index: &usize| world.surveyed[*index].role == Role::Control && Some(*index) != but;
        let control: Vec<usize> = (0..world.surveyed.len()).filter(control).collect();
        ensure!(!control.is_empty(), "the block has too few control points");
        Ok(control[setting.random.index(control.len())])
    };
    let first = pick(values.word("point"), None)?;
    if swap {
        let second = pick(values.word("with"), Some(first))?;
        ensure!(first != second, "a point cannot be exchanged with itself");
        let names = format!("{}, {}", world.surveyed[first].name, world.surveyed[second].name);
        let blunder = Blunder { what: ControlBlunder::Swap(first, second), notes: vec![("exchanged".into(), names)] };
        return unless(false, blunder);
    }
    let direction = match values.word("axis") {
        "x" => Vector3::x(),
        "y" => Vector3::y(),
        "z" => Vector3::z(),
        _ => setting.random.direction(),
    };
    let shift = direction * size;
    let notes = vec![(world.surveyed[first].name.clone(), format!("moved by {} {} {} m", shift.x, shift.y, shift.z))];
    unless(size == 0.0, Blunder { what: ControlBlunder::Move(first, shift), notes })
}

impl Action for Blunder {
    fn measured(&mut self, _world: &World, observations: &mut Observations) {
        match self.what {
            ControlBlunder::Move(point, shift) => observations.surveyed[point] += shift,
            ControlBlunder::Swap(first, second) => observations.surveyed.swap(first, second),
        }
    }

    fn notes(&self) -> Vec<(String, String)> {
        self.notes.clone()
    }
}
