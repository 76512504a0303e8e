//! Goals of a plan, and the cheapest additions that reach them.

use super::Usage;
use super::text::path_text;
use crate::files::read_text;
use crate::plan::Plan;
use crate::plan::choose::{Choice, choose};
use crate::plan::goal::{Goal, Standing};
use crate::report::numbers::significant;
use crate::report::tables::Table;
use crate::scenario::extras::Extras;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What the plan has to reach.
#[derive(Debug, clap::Args)]
pub struct GoalOptions {
    /// A goal (repeatable): "height 10 mm", "plan 5 mm", "focal-temperature 0.1 px/K", "separate EFFECT EFFECT". Height
    /// and plan are those that 95 % of the tie points keep, an effect has to be seen from its size on
    #[arg(long, value_name = "GOAL")]
    goal: Vec<String>,
    /// Additions to the scenario with their costs, of which the cheapest are chosen that reach the goals
    #[arg(long, value_name = "EXTRA.toml", requires = "goal")]
    extra: Option<PathBuf>,
}

/// Goals, and the additions that reach them.
#[derive(Debug, Serialize)]
pub struct Reached {
    /// Are all goals reached by the last step?
    reached: bool,
    /// Unit of the costs.
    unit: String,
    /// From the plan as it is to the additions that were chosen.
    steps: Vec<Step>,
}

#[derive(Debug, Serialize)]
struct Step {
    /// Names of the additions.
    with: Vec<String>,
    cost: f64,
    goals: Vec<Standing>,
}

impl GoalOptions {
    /// Refuses what does not go together; `block`: the folder of a block in the place of a scenario.
    ///
    /// # Errors
    /// [`Usage`].
    pub fn judge(&self, block: Option<&Path>) -> Result<(), Usage> {
        self.goals()?;
        match (block, &self.extra) {
            (Some(block), Some(_)) => {
                Err(Usage(format!("--extra: {} is a block; additions belong to a scenario", path_text(block))))
            }
            _ => Ok(()),
        }
    }

    fn goals(&self) -> Result<Vec<Goal>, Usage> {
        self.goal.iter().map(|text| text.parse().map_err(|error| Usage(format!("--goal {error}")))).collect()
    }

    /// Where the plan `base` stands with its goals, and the additions that reach them; `None` without a goal. `planned`
    /// gives the plan with some additions.
    ///
    /// # Errors
    /// A file of additions that cannot be used; what `planned` says.
    pub fn reach(
        &self,
        base: &Plan,
        planned: impl Fn(&Extras, &[usize]) -> anyhow::Result<Plan>,
    ) -> anyhow::Result<Option<Reached>> {
        let goals = self.goals()?;
        if goals.is_empty() {
            return Ok(None);
        }
        let extras = match &self.extra {
            None => Extras { unit: String::new(), list: Vec::new() },
            Some(file) => {
                let name = path_text(file);
                let text =
                    read_text(file).map_err(|error| Usage(format!("cannot read the additions {name}: {error}")))?;
                Extras::from_toml(&text, &name)?
            }
        };
        let costs: Vec<f64> = extras.list.iter().map(|extra| extra.cost).collect();
        let mut standings: BTreeMap<Vec<usize>, Vec<Standing>> = BTreeMap::new();
        let choices = choose(
            &costs,
            |a, b| extras.exclude(a, b),
            |chosen| {
                let with;
                let plan = match chosen {
                    [] => base,
                    chosen => {
                        with = planned(&extras, chosen)?;
                        &with
                    }
                };
                let own: Vec<Standing> = goals.iter().map(|goal| goal.standing(plan)).collect();
                let shortfall = own.iter().map(|own| own.shortfall).sum();
                standings.insert(chosen.to_vec(), own);
                Ok::<f64, anyhow::Error>(shortfall)
            },
        )?;
        let reached = choices.last().is_some_and(|last| last.shortfall <= 0.0);
        let step = |Choice { chosen, cost, .. }: Choice| Step {
            with: extras.names(&chosen).into_iter().map(String::from).collect(),
            goals: standings.remove(&chosen).unwrap_or_default(),
            cost,
        };
        Ok(Some(Reached { reached, unit: extras.unit.clone(), steps: choices.into_iter().map(step).collect() }))
    }
}

impl Reached {
    /// The goals at each step, and what they come to.
    pub fn text(&self) -> String {
        let Some(last) = self.steps.last() else { return String::new() };
        let mut table = Table::new("").text("with", "").number("cost", &self.unit);
        for goal in &last.goals {
            table = table.number(&goal.goal, &goal.unit);
        }
        for Step { with, cost, goals } in &self.steps {
            let name = if with.is_empty() { "the plan as it is".to_string() } else { with.join(", ") };
            let cells = goals.iter().map(|goal| match (goal.value, goal.reached) {
                (Some(value), reached) => significant(value, 3) + if reached { " reached" } else { "" },
                (None, true) => "reached".into(),
                (None, false) => "-".into(),
            });
            table.row([name, format!("{cost}")].into_iter().chain(cells));
        }
        let mut text = format!("\nGOALS\n\n{}\n", table.to_text());
        if self.reached {
            text += &match last.with.as_slice() {
                [] => "All goals are reached.\n".to_string(),
                with => format!("All goals are reached with {}.\n", with.join(", ")),
            };
            return text;
        }
        for goal in last.goals.iter().filter(|goal| !goal.reached) {
            let why = goal.why.as_ref().map_or(String::new(), |why| format!(": {why}"));
            text += &format!("Not reached: {}{why}.\n", goal.goal);
        }
        text
    }
}
