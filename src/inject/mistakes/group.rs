//! Positions of a surveyed group: rows of `control.csv` by role, or the antennas of `images.csv`.

use super::files::Files;
use super::table::Table;
use super::{DefaultValue, ParameterSpec, Values, parameter};
use anyhow::{Result, ensure};

/// The subjects of mistakes of a survey.
pub(super) const SUBJECTS: &[&str] = &["control", "check", "gnss"];

/// The parameter `of` of a survey.
pub(super) const OF: ParameterSpec = of("control");

/// The same with another default.
pub(super) const fn of(default: &'static str) -> ParameterSpec {
    let choices = &["control", "check", "surveyed", "gnss"];
    parameter("of", "", DefaultValue::Choice(default, choices), "whose positions; surveyed: control and check points")
}

/// The parameter `axis`.
pub(super) const fn axis(default: &'static str) -> ParameterSpec {
    parameter("axis", "", DefaultValue::Choice(default, &["x", "y", "z"]), "the coordinate")
}

/// Number of the axis that a word names.
pub(super) fn axis_of(values: &Values) -> usize {
    match values.word("axis") {
        "x" => 0,
        "y" => 1,
        _ => 2,
    }
}

/// Rows of a table with a position each.
pub(super) struct Group<'a> {
    /// The table.
    pub(super) table: &'a mut Table,
    /// Column of the names.
    pub(super) names: usize,
    /// Columns of the coordinates.
    pub(super) columns: [usize; 3],
    /// The rows.
    pub(super) rows: Vec<usize>,
}

impl<'a> Group<'a> {
    /// The group that `of` names.
    pub(super) fn of(files: &'a mut Files, of: &str) -> Result<Self> {
        let is_gnss = of == "gnss";
        let table = files.table(if is_gnss { "images.csv" } else { "control.csv" })?;
        let names = table.column(if is_gnss { "image" } else { "point" })?;
        let columns = table.columns(if is_gnss { ["gnss_x", "gnss_y", "gnss_z"] } else { ["x", "y", "z"] })?;
        let role = if is_gnss { None } else { Some(table.column("role")?) };
        let mut rows = Vec::new();
        for row in 0..table.len() {
            let belongs = role.is_none_or(|role| of == "surveyed" || table.cell(row, role) == of);
            if belongs && table.numbers(row, columns)?.is_some() {
                rows.push(row);
            }
        }
        ensure!(!rows.is_empty(), "the block has no positions of `{of}`");
        Ok(Self { table, names, columns, rows })
    }

    /// The group of the parameter `of`.
    pub(super) fn given(files: &'a mut Files, values: &Values) -> Result<Self> {
        Self::of(files, values.word("of"))
    }

    /// Name of a member.
    pub(super) fn name(&self, member: usize) -> &str {
        self.table.cell(self.rows[member], self.names)
    }

    /// Number of the member of a name; without a name the one in the middle of the list.
    pub(super) fn member(&self, name: &str) -> Result<usize> {
        if name.is_empty() {
            return Ok(self.rows.len() / 2);
        }
        let row = self.table.row_with(self.names, name)?;
        let member = self.rows.iter().position(|own| *own == row);
        member.ok_or_else(|| anyhow::anyhow!("`{name}` is no member of this group, or has no position"))
    }

    /// Position of a member.
    pub(super) fn position(&self, member: usize) -> Result<[f64; 3]> {
        // The rows of a group have a position each.
        Ok(self.table.numbers(self.rows[member], self.columns)?.unwrap_or([f64::NAN; 3]))
    }

    /// Positions of all members.
    pub(super) fn positions(&self) -> Result<Vec<[f64; 3]>> {
        (0..self.rows.len()).map(|member| self.position(member)).collect()
    }

    /// Sets the position of a member.
    pub(super) fn put(&mut self, member: usize, position: [f64; 3]) -> Result<()> {
        self.table.put(self.rows[member], self.columns, position)
    }

    /// Rewrites the position of every member; the function also gets its number.
    pub(super) fn rewrite(&mut self, new: impl Fn(usize, [f64; 3]) -> [f64; 3]) -> Result<()> {
        for member in 0..self.rows.len() {
            let position = self.position(member)?;
            self.put(member, new(member, position))?;
        }
        Ok(())
    }

    /// Mean of the positions.
    pub(super) fn mean(&self) -> Result<[f64; 3]> {
        let positions = self.positions()?;
        let mean = |axis: usize| positions.iter().map(|own| own[axis]).sum::<f64>() / positions.len() as f64;
        Ok([mean(0), mean(1), mean(2)])
    }
}
