//! Mistakes of people that a plan would notice.

use super::super::Usage;
use crate::inject::mistakes::{self, Kind};
use crate::plan::notice::{Drawn, Noticed};
use crate::report::numbers::{or_dash, significant};
use crate::report::tables::Table;

/// Every kind.
const ALL: &str = "all";

/// Which mistakes are tried.
#[derive(Debug, clap::Args)]
pub struct MistakeOptions {
    /// From which size a kind of mistake would be noticed (repeatable; `inject --list` has the kinds), or `all`. A
    /// kind with a size takes up to ten diagnoses
    #[arg(long, value_name = "KIND|all")]
    mistake: Vec<String>,
}

impl MistakeOptions {
    /// Is a mistake asked for?
    pub fn any(&self) -> bool {
        !self.mistake.is_empty()
    }

    /// Refuses kinds that there are not.
    ///
    /// # Errors
    /// [`Usage`].
    pub fn judge(&self) -> Result<(), Usage> {
        match self.mistake.iter().find(|own| *own != ALL && mistakes::find(own).is_none()) {
            Some(unknown) => Err(Usage(format!("--mistake {unknown}: no such mistake (misclosure inject --list)"))),
            None => Ok(()),
        }
    }

    /// What is noticed of the mistakes that were asked for, by kind and subject.
    ///
    /// # Errors
    /// A mistake that none of the block's groups can have; what an examination says.
    pub fn noticed(&self, drawn: &Drawn<'_>) -> anyhow::Result<Vec<Noticed>> {
        let wanted = |kind: &Kind| self.mistake.iter().any(|own| own == ALL || own == kind.id());
        let possible: Vec<_> = drawn.possible().into_iter().filter(|(kind, _)| wanted(kind)).collect();
        let has = |id: &String| id == ALL || possible.iter().any(|(kind, _)| kind.id() == id);
        if let Some(without) = self.mistake.iter().find(|id| !has(id)) {
            return Err(Usage(format!("--mistake {without}: this block has nothing that it could concern")).into());
        }
        Ok(possible.into_iter().map(|(kind, subject)| drawn.smallest(kind, subject)).collect::<Result<_, _>>()?)
    }
}

/// Heading of the table.
pub const MISTAKES: &str = "Mistakes that it would notice";

/// As text.
pub fn text(noticed: &[Noticed]) -> String {
    format!("\n{} (in one drawn block)\n\n{}", MISTAKES.to_uppercase(), table(noticed).to_text())
}

/// The mistakes with the sizes from which they are noticed and named.
pub fn table(noticed: &[Noticed]) -> Table {
    let mut table = Table::new("")
        .text("mistake", "")
        .text("of", "")
        .number("noticed from", "")
        .number("named from", "")
        .text("unit", "")
        .text("what is said", "");
    for own in noticed {
        let size = |size: Option<f64>| or_dash(size, |size| significant(size, 2));
        let (least, named) = (size(own.size), size(own.named_size));
        table.row([own.kind.clone(), own.subject.clone(), least, named, own.unit.clone(), own.said.in_words()]);
    }
    table
}
