//! The effects that a plan would show, as a table and in notes.

use super::super::text::{listed, paragraph};
use super::precision::short_mm;
use crate::plan::{Hidden, Plan, Size, Typical, Visible};
use crate::report::numbers::{or_dash, significant, unit_of};
use crate::report::tables::Table;

/// Parameters of an effect, and names of others, that the table shows one by one.
const SHOWN: usize = 3;

/// A move of points that no survey notices, m.
const NOTHING_M: f64 = 1e-5;

/// What was planned.
pub fn heading(planned: &Plan) -> String {
    let Plan { block, images, tie_points, tie_measurements, control, check, gnss, .. } = planned;
    format!(
        "Plan `{block}`: {images} images ({gnss} with GNSS), {tie_points} tie points with {tie_measurements} \
         measurements, {control} control and {check} check points"
    )
}

/// Heading, table and notes.
pub fn text(planned: &Plan) -> String {
    let mut text = format!(
        "{}\n\nSMALLEST EFFECTS THAT IT WOULD SHOW (found with {:.0} %, at a significance of {})\n\n{}",
        heading(planned),
        1e2 * planned.power,
        planned.significance,
        table(planned).to_text()
    );
    for note in notes(planned) {
        text += &paragraph("", 2, &note);
    }
    text
}

/// The smallest size of each effect.
pub fn table(planned: &Plan) -> Table {
    let mut table = Table::new("")
        .text("effect", "")
        .text("parameter", "")
        .number("seen from", "")
        .number("named from", "")
        .text("unit", "")
        .number("unseen it moves points by", "mm")
        .text("till then it may be called", "");
    for own in &planned.effects {
        rows(own, &mut table);
    }
    table
}

/// What cannot be seen, what would tell effects that look alike, and what takes no part.
pub fn notes(planned: &Plan) -> Vec<String> {
    let mut notes = Vec::new();
    for (needs, effects) in by_needs(planned) {
        notes.push(format!("Not to be seen: {}; needed: {needs}.", effects.join(", ")));
    }
    let sizes = planned.effects.iter().flat_map(|own| own.sizes.iter().map(move |size| (own, size)));
    let beyond: Vec<String> =
        sizes.filter(|(_, size)| size.is_beyond_plausible()).map(|(own, size)| beyond(own, size)).collect();
    if !beyond.is_empty() {
        notes.push(format!("Seen from a size on that is not plausible: {}.", beyond.join(", ")));
    }
    for own in planned.effects.iter().filter(|own| !own.absorbed.is_empty()) {
        let names: Vec<&str> = own.absorbed.iter().map(String::as_str).collect();
        let (names, moves) = (listed(&names, SHOWN), moves(&own.absorbed_typical));
        notes.push(format!("Of {} not to be seen: {names}{moves}.", own.effect));
    }
    let told = planned.effects.iter().filter_map(|own| Some((own, own.tell.as_ref()?)));
    for (own, tell) in told {
        let others = listed(&others(&own.sizes), SHOWN);
        notes.push(format!("To tell {} from {others}: {tell}.", own.effect));
    }
    if !planned.blind.is_empty() {
        let names: Vec<&str> = planned.blind.iter().map(String::as_str).collect();
        let named = listed(&names, SHOWN);
        notes.push(format!("Too few measurements to take part: {} images ({named}).", names.len()));
    }
    if planned.tied_centre {
        notes.push("The block does not determine the centre of distortion: it is tied to the principal point.".into());
    }
    notes
}

/// Effects that cannot be shown, by what they need.
fn by_needs(planned: &Plan) -> Vec<(String, Vec<String>)> {
    let mut all: Vec<(String, Vec<String>)> = Vec::new();
    for hidden in &planned.hidden {
        let (needs, effect) = (hidden.needs.join("; "), with_moves(hidden));
        match all.iter_mut().find(|(own, _)| *own == needs) {
            Some((_, effects)) => effects.push(effect),
            None => all.push((needs, vec![effect])),
        }
    }
    all
}

/// The effect, and what it does to the points at its typical size.
fn with_moves(hidden: &Hidden) -> String {
    format!("{}{}", hidden.effect, moves(&hidden.typical))
}

/// A parameter of which no plausible size is seen.
fn beyond(own: &Visible, size: &Size) -> String {
    let most = size.plausible.map_or(String::new(), |plausible| significant(plausible, 2));
    format!("{} {} (up to {most} {}", own.effect, size.parameter, unit_of(&size.unit)).trim_end().to_owned() + ")"
}

fn moves(all: &[Typical]) -> String {
    let Some(Typical { parameter, size, unit, moves_m, .. }) = Typical::worst(all) else { return String::new() };
    let moves = match *moves_m < NOTHING_M {
        true => format!("less than {}", short_mm(NOTHING_M)),
        false => short_mm(*moves_m),
    };
    let size = significant(*size, 2);
    let sized = [size.as_str(), unit_of(unit)].join(" ");
    format!(" (a typical {parameter} of {} moves points by {moves} mm)", sized.trim_end())
}

/// A row for each parameter; of many parameters one with their range.
fn rows(own: &Visible, table: &mut Table) {
    let alike = |sizes: &[Size]| match others(sizes) {
        none if none.is_empty() => "-".into(),
        others => listed(&others, SHOWN),
    };
    let named = |size: &Size| or_dash(size.named_size, |own| significant(own, 3));
    let unit = |size: &Size| unit_of(&size.unit).to_owned();
    if own.sizes.len() <= SHOWN {
        for size in &own.sizes {
            let alike = alike(std::slice::from_ref(size));
            let numbers = [significant(size.size, 3), named(size), unit(size), or_dash(size.moves_m, short_mm), alike];
            table.row([own.effect.clone(), size.parameter.clone()].into_iter().chain(numbers));
        }
        return;
    }
    let by_size = |a: &&Size, b: &&Size| a.size.total_cmp(&b.size);
    let (Some(least), Some(most)) = (own.sizes.iter().min_by(by_size), own.sizes.iter().max_by(by_size)) else {
        return;
    };
    let range = match own.sizes.iter().all(|size| size.unit == least.unit) {
        true => format!("{} to {}", significant(least.size, 3), significant(most.size, 3)),
        false => format!("from {}", significant(least.size, 3)),
    };
    let count = format!("{} parameters", own.sizes.len());
    let alike = alike(&own.sizes);
    table.row([own.effect.clone(), count, range, "-".into(), unit(least), or_dash(own.worst_m(), short_mm), alike]);
}

/// Effects that may be named in the place of some sizes.
fn others(sizes: &[Size]) -> Vec<&str> {
    let mut all: Vec<&str> = Vec::new();
    for other in sizes.iter().flat_map(|size| &size.looks_like) {
        if !all.contains(&other.as_str()) {
            all.push(other);
        }
    }
    all
}
