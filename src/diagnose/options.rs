//! Options of an effect in the model, exchanged where another one fits better. Two options may look alike until the
//! weights of the survey follow from the model; then the wrong one leaves what another effect would have to explain.

use super::catalogue::option;
use super::hypothesis::of_option;
use super::improvement::Improvement;
use super::models::at_solution;
use super::search::SAME;
use super::settings::Settings;
use crate::block::Block;
use crate::effects::Stage;
use crate::run::RunError;
use crate::run::fit::{Fit, fit};

/// An option of an effect in a model, at another value.
struct Other {
    /// Position of the effect in the model.
    term: usize,
    parameter: String,
    value: f64,
    /// How many parameters more it costs than the present one: 1, 0 or -1.
    dearer: f64,
    /// For a person.
    words: String,
}

impl Improvement {
    /// Takes another option of an effect that the diagnosis took in, where that lowers the objective.
    ///
    /// # Errors
    /// A wish to stop.
    pub fn exchange_options(&mut self, block: &Block, settings: &Settings<'_>) -> Result<(), RunError> {
        for other in others(&self.fit, self.parts.own) {
            let mut model = at_solution(&self.fit);
            model.effects[other.term].values.insert(other.parameter, other.value);
            (settings.tell)(&format!("adjusting: {}", other.words));
            let refitted = match fit(block, &model, Some(&self.fit), &settings.options) {
                Ok(refitted) => refitted,
                Err(error) if settings.options.stop.is_raised() => return Err(error),
                Err(_) => continue,
            };
            // Weights are those of the model as it stands: the weighted sum of squares decides, and the option's price.
            let variance = self.fit.chi_square() / self.fit.problem.redundancy().2 as f64;
            let price = other.dearer * of_option(settings.significance.ln());
            let gain = (refitted.chi_square() - self.fit.chi_square()) / variance + price;
            if gain < -SAME {
                self.replace(block, refitted, &other.words, gain, settings)?;
            }
        }
        Ok(())
    }
}

/// The other options of the effects beyond the user's own.
fn others(fit: &Fit, own: usize) -> Vec<Other> {
    let of = |(term, instance): (usize, &crate::problem::EffectInstance)| {
        let descriptor = instance.effect.descriptor();
        let (place, values) = option(&fit.problem, descriptor)?;
        let parameter = &descriptor.parameters[place];
        // Kinds of coordinates are equally likely.
        let costs = |value: f64| f64::from(u8::from(descriptor.stage != Stage::Frame && value != parameter.nominal));
        let now = fit.solution.state.theta[instance.slots[place].1 as usize];
        let other = move |(name, value): &(&str, f64)| Other {
            term,
            parameter: parameter.name.to_string(),
            value: *value,
            dearer: costs(*value) - costs(now),
            words: format!("{} with {}={name}", descriptor.id, parameter.name),
        };
        Some(values.iter().filter(|(_, value)| *value != now).map(other).collect::<Vec<_>>())
    };
    fit.problem.effects.iter().enumerate().skip(own).filter_map(of).flatten().collect()
}
