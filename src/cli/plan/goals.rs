//! Goals of a plan, and the cheapest additions that reach them.

use super::super::Usage;
use super::super::text::path_text;
use crate::files::read_text;
use crate::plan::Plan;
use crate::plan::choose::{Choice, choose};
use crate::plan::goal::{Goal, Standing};
use crate::plan::notice::Asked;
use crate::plan::said::Said;
use crate::report::figures::{Axis, LineChart, Panel, Series};
use crate::report::numbers::significant;
use crate::report::tables::Table;
use crate::scenario::extras::Extras;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What the plan has to reach.
#[derive(Debug, clap::Args)]
pub struct GoalOptions {
    /// A goal (repeatable): "height 10 mm", "plan 5 mm", "focal-temperature 0.1 px/K", "separate EFFECT EFFECT",
    /// "notice height-offset 0.05 m". A length is what 95 % of the tie points keep. An effect has to be seen from its
    /// size on. Of a mistake, a diagnosis of a drawn block has to say something
    #[arg(long, value_name = "GOAL")]
    goal: Vec<String>,
    /// Additions to the scenario with their costs, of which the cheapest are chosen that reach the goals
    #[arg(long, value_name = "EXTRA.toml", requires = "goal")]
    extra: Option<PathBuf>,
}

/// A plan, and what is said of the mistakes that have to be noticed, in the order of the goals.
pub struct Examined {
    /// The plan.
    pub plan: Plan,
    /// What is said of each mistake.
    pub said: Vec<Said>,
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

    /// The mistakes that have to be noticed.
    ///
    /// # Errors
    /// [`Usage`]: a goal that is none.
    pub fn mistakes(&self) -> Result<Vec<Asked>, Usage> {
        Ok(self.goals()?.iter().filter_map(Goal::mistake).cloned().collect())
    }

    /// Where the plan `base` stands with its goals, and the additions that reach them; `None` without a goal.
    /// `examined` gives the plan with some additions.
    ///
    /// # Errors
    /// A file of additions that cannot be used; what `examined` says.
    pub fn reach(
        &self,
        base: &Examined,
        examined: impl Fn(&Extras, &[usize]) -> anyhow::Result<Examined>,
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
                let Examined { plan, said } = match chosen {
                    [] => base,
                    chosen => {
                        with = examined(&extras, chosen)?;
                        &with
                    }
                };
                let mut said = said.iter();
                let standing = |goal: &Goal| goal.standing(plan, goal.mistake().and_then(|_| said.next()));
                let own: Vec<Standing> = goals.iter().map(standing).collect();
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
        format!("\nGOALS\n\n{}\n{}", self.table().to_text(), self.outcome())
    }

    /// The goals at each step.
    pub fn table(&self) -> Table {
        let mut table = Table::new("").text("with", "").number("cost", &self.unit);
        for goal in self.steps.last().iter().flat_map(|last| &last.goals) {
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
        table
    }

    /// With what they are reached, or why they are not: a line each.
    pub fn outcome(&self) -> String {
        let Some(last) = self.steps.last() else { return String::new() };
        if self.reached {
            return match last.with.as_slice() {
                [] => "All goals are reached.\n".to_string(),
                with => format!("All goals are reached with {}.\n", with.join(", ")),
            };
        }
        let mut text = String::new();
        for goal in last.goals.iter().filter(|goal| !goal.reached) {
            let why = goal.why.as_ref().map_or(String::new(), |why| format!(": {why}"));
            text += &format!("Not reached: {}{why}.\n", goal.goal);
        }
        text
    }

    /// The trade-off: how many times too large the values of each goal are (one: reached) over the cost. Goals without
    /// a value have no curve.
    pub fn trade_off(&self) -> LineChart {
        let mut steps: Vec<&Step> = self.steps.iter().collect();
        steps.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let curve = |goal: usize| {
            let points = steps.iter().filter(|step| step.goals[goal].value.is_some());
            let points = points.map(|step| [step.cost, step.goals[goal].shortfall.exp()]).collect();
            Series::new(steps[0].goals[goal].goal.clone(), points)
        };
        let goals = steps.first().map_or(0, |step| step.goals.len());
        let series: Vec<Series> = (0..goals).map(curve).filter(|own| own.points.len() > 1).collect();
        let (x, y) = (Axis::new("cost", &self.unit), Axis::new("value / goal (1: reached)", ""));
        LineChart { panels: vec![Panel { title: String::new(), x, y, series }], ..LineChart::default() }
    }
}
