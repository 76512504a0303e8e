//! The figures of a node: those of the report, with what is brushed standing out, and at a scale that can be held.

mod gnss;
mod ledger;
mod points;
mod residuals;
mod sensor;

use super::asked::Asked;
use super::columns::Columns;
use super::longest::fitting;
use super::state::Lab;
use super::view::View;
use crate::run::folder::{CheckRow, GnssRow};
use anyhow::{Result, bail};
pub use ledger::difference;

/// Every figure, by name.
pub const NAMES: [&str; 11] =
    ["sensor", "image", "images", "plan", "height", "flights", "gnss", "profile", "histogram", "checks", "ledger"];

/// What a figure is drawn from.
struct Scene<'a> {
    view: &'a View,
    columns: &'a Columns,
    checks: &'a [CheckRow],
    gnss: &'a [GnssRow],
    predicted: bool,
    chosen: Option<Vec<bool>>,
    asked: &'a Asked,
}

/// Draws a figure of a node; with `effect`, as it is predicted to be with that effect.
///
/// # Errors
/// A name that no figure has; an index that the block does not have; a node that cannot be read.
pub fn draw(lab: &Lab, id: u32, name: &str, effect: Option<&str>, asked: &Asked) -> Result<String> {
    if name == "ledger" {
        return ledger::draw_ledger(lab, id, asked.width);
    }
    let view = lab.view(id)?;
    let prediction = effect.map(|effect| super::predict::predicted(lab, id, effect)).transpose()?;
    let (columns, checks, gnss) = match &prediction {
        Some(predicted) => (&predicted.columns, &predicted.checks, &predicted.gnss),
        None => (&view.columns, &view.run.checks, &view.run.gnss),
    };
    let chosen = asked.brush.as_ref().map(|brush| brush.members(columns));
    let scene = Scene { view: &view, columns, checks, gnss, predicted: prediction.is_some(), chosen, asked };
    match name {
        "sensor" => scene.sensor(lab, id),
        "image" => scene.image(lab, id),
        "images" => Ok(scene.images()),
        "plan" => scene.plan(lab, id),
        "height" => scene.height(lab, id),
        "flights" => Ok(scene.flights()),
        "gnss" => scene.gnss(lab, id),
        "profile" => scene.profile(),
        "histogram" => Ok(scene.histogram()),
        "checks" => scene.checks(lab, id),
        other => bail!("there is no figure {other:?}; there are {}", NAMES.join(", ")),
    }
}

/// Says of the plotting areas which brush they make.
fn brushed(svg: String, attributes: &str, keys: &[(&str, &str, &str)]) -> String {
    let mut svg = svg.replace("class=\"plot\"", &format!("class=\"plot\" {attributes}"));
    for (axis, label, key) in keys {
        let name = format!("data-{axis}name=\"{label}\"");
        svg = svg.replace(&name, &format!("{name} data-{axis}key=\"{key}\""));
    }
    svg
}

impl Scene<'_> {
    fn is_chosen(&self, k: usize) -> bool {
        self.chosen.as_ref().is_none_or(|chosen| chosen[k])
    }

    /// Which images have a measurement that is chosen; `None` where nobody chose.
    fn chosen_images(&self) -> Option<Vec<bool>> {
        let chosen = self.chosen.as_ref()?;
        let mut held = vec![false; self.columns.images.len()];
        (0..chosen.len()).filter(|k| chosen[*k]).for_each(|k| held[self.columns.image[k] as usize] = true);
        Some(held)
    }

    /// The scale of a figure: the one asked for, else the one that fits its longest arrow `own` and the one asked for.
    fn scale(&self, natural: Option<f64>, own: f64) -> Option<f64> {
        self.asked.scale.or_else(|| fitting(natural, own, self.asked.longest))
    }

    fn title(&self, title: &str) -> String {
        if self.predicted { format!("Predicted: {title}") } else { title.to_string() }
    }
}
