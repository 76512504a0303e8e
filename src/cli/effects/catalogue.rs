//! The catalogue and one effect's page, all of it generated from the descriptors.

use super::super::text::paragraph;
use super::super::{Answer, Usage};
use crate::effects::literature;
use crate::effects::{self, Descriptor, Domain, Kind, Need, Parameter, Role, Scope};
use crate::report::tables::Table;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Column at which the text of a page begins.
const INDENT: usize = 16;

/// The catalogue, or the page of `id`.
pub(super) fn run(id: Option<&str>) -> anyhow::Result<Answer> {
    let descriptors: Vec<&Descriptor> = effects::catalogue().iter().map(|effect| effect.descriptor()).collect();
    let Some(id) = id else {
        let json = json!({ "format": 1, "effects": descriptors.iter().map(|d| as_json(d)).collect::<Vec<_>>() });
        return Ok(Answer { text: catalogue(&descriptors), json, failure: None });
    };
    let descriptor = descriptors.iter().find(|d| d.id == id).ok_or_else(|| Usage(super::unknown(id)))?;
    Ok(Answer { text: page(descriptor), json: as_json(descriptor), failure: None })
}

fn catalogue(descriptors: &[&Descriptor]) -> String {
    let mut table =
        Table::new("").text("id", "").text("stage", "").text("kind", "").text("parameters", "").text("needs", "");
    for d in descriptors {
        let parameters: Vec<String> = d.parameters.iter().map(parameter).collect();
        let shown = match parameters.len() {
            0..=4 => parameters.join(", "),
            n => format!("{}, ... {n} in all", parameters[..2].join(", ")),
        };
        table.row([d.id.to_string(), d.stage.name().into(), kind(d.kind).into(), shown, needs(d)]);
    }
    table.to_text() + "\n`misclosure effects ID` describes one of them.\n"
}

fn page(d: &Descriptor) -> String {
    let mut text = format!("{}: acts on the {} stage, {}\n\n", d.id, d.stage.name(), kind(d.kind));
    text += &paragraph("What happens", INDENT, &d.summary);
    text += &paragraph("Formula", INDENT, &d.formula);
    text += &paragraph("Needs", INDENT, &needs(d));
    text += &paragraph("Confused with", INDENT, &d.confused_with);
    text += &paragraph("Source", INDENT, &d.source);
    for reference in literature::of(&d.id) {
        text += &paragraph("Literature", INDENT, &reference.to_string());
    }
    text += "\n";
    text += &parameters(d);
    text += &format!("\nIn a model: misclosure adjust BLOCK -o RUN --add {}\n", d.id);
    text
}

/// The parameters of an effect in a table, and behind it where their ranges come from.
pub(super) fn parameters(d: &Descriptor) -> String {
    let mut table = (Table::new("").text("parameter", "").text("unit", "").text("values", ""))
        .number("nominal", "")
        .number("typical", "")
        .text("possible", "")
        .text("how it gets its value", "");
    for p in &d.parameters {
        let (nominal, typical) = (p.nominal.to_string(), p.typical.to_string());
        table.row([
            p.name.to_string(),
            p.unit.to_string(),
            scope(p).into(),
            nominal,
            typical,
            possible(p),
            role(&p.role),
        ]);
    }
    let mut text = table.to_text();
    // Several parameters often share a range and its source.
    let ranges = d.parameters.iter().filter_map(|p| p.plausible.as_ref());
    let sources: BTreeSet<&str> = ranges.map(|range| range.source.as_ref()).collect();
    for source in sources {
        text += "\n";
        text += &paragraph("Possible", INDENT, source);
    }
    text
}

/// What an effect is to a person, and in which picture it is seen.
pub(super) fn told(d: &Descriptor) -> String {
    let mut text = String::new();
    if let Some(words) = &d.words {
        text += &paragraph("What it is", INDENT, &words.what);
        text += &paragraph("What to do", INDENT, &words.remedy);
        text += &paragraph("To tell", INDENT, &words.tell);
    }
    text + &paragraph("Picture", INDENT, &d.picture.to_string())
}

/// Name and unit, or name and named values.
fn parameter(p: &Parameter) -> String {
    match &p.role {
        Role::Given(names) if !names.is_empty() => {
            format!("{}={}", p.name, names.iter().map(|(name, _)| *name).collect::<Vec<_>>().join("|"))
        }
        // What is reported is the standard deviation.
        Role::Random(deviation) => format!("{deviation} ({})", p.unit),
        _ => format!("{} ({})", p.name, p.unit),
    }
}

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Physical => "physical",
        Kind::Empirical => "empirical",
    }
}

fn needs(d: &Descriptor) -> String {
    let words: Vec<&str> = d.needs.iter().map(need).collect();
    if words.is_empty() { "-".into() } else { words.join(", ") }
}

fn need(need: &Need) -> &'static str {
    match need {
        Need::Time => "time_s",
        Need::Temperature => "temperature_c",
        Need::Flights => "two flights or more",
        Need::Velocity => "velocity (or time_s)",
        Need::Gnss => "GNSS in the datum",
        Need::Control => "control in the datum",
        Need::Vertical => "control or GNSS in the datum",
    }
}

fn scope(parameter: &Parameter) -> &'static str {
    match (&parameter.role, parameter.scope) {
        (Role::Random(_), _) => "one per image, random",
        (_, Scope::Global) => "one",
        (_, Scope::Camera) => "one per camera",
        (_, Scope::Flight) => "one per flight",
        (_, Scope::FlightButFirst) => "one per flight, first nominal",
        (_, Scope::Image) => "one per image",
    }
}

/// Range of possible values.
fn possible(p: &Parameter) -> String {
    p.plausible.as_ref().map_or("-".into(), |range| format!("{} to {}", range.min, range.max))
}

fn role(role: &Role) -> String {
    match role {
        Role::Estimated => "estimated".into(),
        Role::Searched(domain) => format!("estimated; searched {}", range(domain)),
        Role::Given(names) if names.is_empty() => "given".into(),
        Role::Given(names) => {
            format!("given: {}", names.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" or "))
        }
        Role::Random(deviation) => format!("standard deviation `{deviation}` estimated"),
        Role::VelocityError => "error of a derived velocity, observed as zero".into(),
    }
}

fn range(domain: &Domain) -> String {
    match domain {
        Domain::SensorX => "over the sensor's width".into(),
        Domain::SensorY => "over the sensor's height".into(),
        Domain::SensorFraction(a, b) => format!("from {a} to {b} of the sensor's half diagonal"),
        Domain::Range(a, b) => format!("from {a} to {b}"),
    }
}

/// The parameters of an effect for a program.
pub(super) fn parameters_json(d: &Descriptor) -> Vec<Value> {
    let parameter = |p: &Parameter| {
        json!({ "name": p.name, "unit": p.unit, "values": scope(p), "nominal": p.nominal, "typical": p.typical,
                "role": role(&p.role),
                "plausible": p.plausible.as_ref().map(|r| json!({ "min": r.min, "max": r.max, "source": r.source })) })
    };
    d.parameters.iter().map(parameter).collect()
}

fn as_json(d: &Descriptor) -> Value {
    json!({ "id": d.id, "stage": d.stage.name(), "kind": kind(d.kind), "summary": d.summary, "formula": d.formula,
            "parameters": parameters_json(d),
            "needs": d.needs.iter().map(need).collect::<Vec<_>>(),
            "confused_with": d.confused_with, "source": d.source,
            "literature": literature::of(&d.id).iter().map(ToString::to_string).collect::<Vec<_>>(),
            "words": d.words, "picture": d.picture.to_string() })
}
