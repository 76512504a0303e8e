//! `model.toml`: the model as it was used, complete, so that it repeats a run.
//!
//! ```toml
//! format = 1
//! free = ["f", "pp", "dc", "radial", "decentring", "affinity"]   # or "all", "none", single parameters; absent: all
//! tie = "dc=pp"                # absent: the centre of distortion is of its own
//! datum = "free"               # free, control, gnss, all; absent: free
//! loss = "none"                # none, huber, cauchy; absent: none
//! tie_weights = "unit"         # unit, multi, pairs; absent: unit
//!
//! [sigma_factors]              # factors on the a-priori standard deviations; absent: 1
//! image = 1.0
//! control = 1.0                # horizontal
//! control_z = 1.0              # heights; absent: as horizontal
//! gnss = 1.0
//! gnss_z = 1.0
//!
//! [sigma_factors.flight.first] # the same of one flight, on top of those: image, gnss, gnss_z
//! gnss = 2.0
//!
//! [camera.cam]                 # start values that replace the block's
//! f = 5510.0
//!
//! [[effect]]                   # in the order in which they act
//! id = "local-flaw"
//! held = ["width"]             # parameters that stay at their value
//! values = { x0 = 1200.0 }     # start values; "name[flight]" for one value of a parameter with a scope
//!
//! [[prior]]                    # weak observation of a camera parameter
//! camera = "cam"
//! parameter = "k3"
//! value = 0.0
//! sigma = 1e-24
//! ```
//!
//! What is absent is as in [`Model::default`]; [`write_model`] writes every key. An effect of a plug-in is known by its
//! id: the library is given again when the model is read.

use super::error::{Error, advice, shown};
use super::toml_table::{Source, Table, quoted};
use crate::camera::{F, GROUPS, PARAMETER_COUNT, PARAMETERS, parameter_indices};
use crate::model::{
    Datum, EffectRef, EffectTerm, FlightFactors, Loss, Model, PRIOR_KEY, Prior, SigmaFactors, TieWeights,
};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;
use toml::de::DeTable;

/// The format that this program reads and writes.
const FORMAT: u32 = 1;
/// The one tie there is.
const DC_TO_PP: &str = "dc=pp";

const KEYS: [&str; 10] =
    ["format", "free", "tie", "datum", "loss", "tie_weights", "sigma_factors", "camera", "effect", "prior"];
const SIGMA_FACTORS: [&str; 6] = ["image", "mark", "control", "control_z", "gnss", "gnss_z"];
const FLIGHT_FACTORS: [&str; 3] = ["image", "gnss", "gnss_z"];
/// Key of `[sigma_factors]` that holds those of single flights.
const OF_FLIGHT: &str = "flight";
const DATUMS: [(&str, Datum); 4] =
    [("free", Datum::Free), ("control", Datum::Control), ("gnss", Datum::Gnss), ("all", Datum::All)];
const LOSSES: [(&str, Loss); 3] = [("none", Loss::None), ("huber", Loss::Huber), ("cauchy", Loss::Cauchy)];
const TIE_WEIGHTS: [(&str, TieWeights); 3] =
    [("unit", TieWeights::Unit), ("multi", TieWeights::Multi), ("pairs", TieWeights::Pairs)];

/// Reads a model; `resolve` finds the effect of an id.
///
/// Names of cameras, flights and images are not checked here: they belong to a block.
///
/// # Errors
/// [`Error`] with line and column: not TOML, unknown keys and names, values of a wrong type.
pub fn read_model(path: &Path, resolve: &dyn Fn(&str) -> Option<EffectRef>) -> Result<Model, Error> {
    let source = Source::read(path, path.display().to_string(), "a run folder has the model of its run as model.toml")?;
    let root = source.parse()?;
    let table = Table::new(&source, "model.toml", root.get_ref(), &KEYS)?;
    table.expect_format(FORMAT, &(0..0))?;
    let default = Model::default();
    let mut model = Model {
        free: free(&source, &table)?.unwrap_or(default.free),
        tie_dc_to_pp: choice(&table, "tie", &[(DC_TO_PP, true)])?.unwrap_or(default.tie_dc_to_pp),
        datum: choice(&table, "datum", &DATUMS)?.unwrap_or(default.datum),
        loss: choice(&table, "loss", &LOSSES)?.unwrap_or(default.loss),
        tie_weights: choice(&table, "tie_weights", &TIE_WEIGHTS)?.unwrap_or(default.tie_weights),
        ..default
    };
    if let Some((factors, _)) = table.table("sigma_factors")? {
        let known: Vec<&str> = SIGMA_FACTORS.into_iter().chain([OF_FLIGHT]).collect();
        let factors = Table::new(&source, "[sigma_factors]", factors, &known)?;
        model.sigma_factors = sigma_factors(&factors)?;
        if let Some((flights, _)) = factors.table(OF_FLIGHT)? {
            model.flight_factors = flight_factors(&source, flights)?;
        }
    }
    if let Some((cameras, _)) = table.table("camera")? {
        let cameras = Table::of_names(&source, "[camera]", cameras);
        for (id, _) in cameras.keys() {
            if let Some((values, _)) = cameras.table(id)? {
                let name = format!("[camera.{id}]");
                let values = Table::new(&source, &name, values, &PARAMETERS)?;
                values.positive(PARAMETERS[F])?;
                let values = numbers(&values)?;
                model.camera_values.insert(id.to_owned(), values);
            }
        }
    }
    for (entries, span) in table.tables("effect")? {
        model.effects.push(effect(&source, entries, &span, resolve)?);
    }
    for (entries, span) in table.tables("prior")? {
        model.priors.push(prior(&source, entries, &span)?);
    }
    Ok(model)
}

/// A factor and, for heights, the one that counts where it is absent.
fn factor(factors: &Table<'_>, name: &str, horizontal: Option<f64>) -> Result<f64, Error> {
    Ok(factors.positive(name)?.or(horizontal).unwrap_or(1.0))
}

fn sigma_factors(factors: &Table<'_>) -> Result<SigmaFactors, Error> {
    let (control, gnss) = (factor(factors, "control", None)?, factor(factors, "gnss", None)?);
    Ok(SigmaFactors {
        image: factor(factors, "image", None)?,
        mark: factor(factors, "mark", None)?,
        control,
        control_z: factor(factors, "control_z", Some(control))?,
        gnss,
        gnss_z: factor(factors, "gnss_z", Some(gnss))?,
    })
}

fn flight_factors(source: &Source, flights: &DeTable<'_>) -> Result<BTreeMap<String, FlightFactors>, Error> {
    let flights = Table::of_names(source, "[sigma_factors.flight]", flights);
    let mut all = BTreeMap::new();
    for (id, _) in flights.keys() {
        if let Some((factors, _)) = flights.table(id)? {
            let name = format!("[sigma_factors.flight.{id}]");
            let factors = Table::new(source, &name, factors, &FLIGHT_FACTORS)?;
            let gnss = factor(&factors, "gnss", None)?;
            let (image, gnss_z) = (factor(&factors, "image", None)?, factor(&factors, "gnss_z", Some(gnss))?);
            all.insert(id.to_owned(), FlightFactors { image, gnss, gnss_z });
        }
    }
    Ok(all)
}

fn free(source: &Source, table: &Table<'_>) -> Result<Option<[bool; PARAMETER_COUNT]>, Error> {
    let Some(names) = table.texts("free")? else { return Ok(None) };
    let mut free = [false; PARAMETER_COUNT];
    for (name, span) in names {
        let indices = parameter_indices(name).ok_or_else(|| {
            let groups = GROUPS.iter().map(|(group, _)| *group);
            let known: Vec<&str> = groups.chain(["all", "none"]).chain(PARAMETERS).collect();
            let problem = format!("unknown parameter {}; {}", shown(name.as_bytes()), advice(name, &known));
            source.refuse(&span, problem)
        })?;
        indices.into_iter().for_each(|index| free[index] = true);
    }
    Ok(Some(free))
}

/// One of several words.
fn choice<T: Copy>(table: &Table<'_>, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, Error> {
    let (Some(text), Some(value)) = (table.text(key)?, table.value(key)) else { return Ok(None) };
    match choices.iter().find(|(word, _)| *word == text) {
        Some((_, choice)) => Ok(Some(*choice)),
        None => {
            let words: Vec<&str> = choices.iter().map(|(word, _)| *word).collect();
            let expected =
                if let [word] = words[..] { word.to_owned() } else { format!("one of {}", words.join(", ")) };
            Err(table.refuse(key, value, &expected))
        }
    }
}

/// All numbers of a table.
fn numbers(table: &Table<'_>) -> Result<BTreeMap<String, f64>, Error> {
    let mut numbers = BTreeMap::new();
    for (key, _) in table.keys() {
        if let Some(number) = table.number(key)? {
            numbers.insert(key.to_owned(), number);
        }
    }
    Ok(numbers)
}

fn effect(
    source: &Source,
    entries: &DeTable<'_>,
    span: &Range<usize>,
    resolve: &dyn Fn(&str) -> Option<EffectRef>,
) -> Result<EffectTerm, Error> {
    let table = Table::new(source, "[[effect]]", entries, &["id", "held", "values"])?;
    let id = table.required("id", span, table.text("id")?)?;
    let id_span = table.value("id").map_or(span.clone(), |value| value.span());
    let effect = resolve(id).ok_or_else(|| {
        let problem = format!(
            "unknown effect {}; `misclosure effects` lists those built in, one of a plug-in needs --plugin FILE.so",
            shown(id.as_bytes())
        );
        source.refuse(&id_span, problem)
    })?;
    let refuse_unknown = |key: &str, span: &Range<usize>| match effect.parameter_of(key) {
        Some(_) => Ok(()),
        None => {
            let known: Vec<&str> = effect.descriptor().parameters.iter().map(|p| p.name.as_ref()).collect();
            let name = key.split('[').next().unwrap_or_default();
            let advice = match effect.parameter_of(name) {
                Some(_) => {
                    format!("{} alone, or name[element] where there is a value per element", shown(name.as_bytes()))
                }
                None => advice(name, &known),
            };
            let problem = format!("effect {id} has no parameter {}; {advice}", shown(key.as_bytes()));
            Err(source.refuse(span, problem))
        }
    };
    let mut held = Vec::new();
    for (name, span) in table.texts("held")?.unwrap_or_default() {
        refuse_unknown(name, &span)?;
        held.push(name.to_owned());
    }
    let values = match table.table("values")? {
        None => BTreeMap::new(),
        Some((values, _)) => {
            let values = Table::of_names(source, "values", values);
            let mut named = values.keys().into_iter().filter(|(key, _)| *key != PRIOR_KEY);
            named.try_for_each(|(key, span)| refuse_unknown(key, &span))?;
            let numbers = numbers(&values)?;
            for (key, number) in &numbers {
                let expected = effect.parameter_of(key).and_then(|parameter| parameter.expected_instead_of(*number));
                if let (Some(expected), Some(value)) = (expected, values.value(key)) {
                    return Err(values.refuse(key, value, &expected));
                }
            }
            numbers
        }
    };
    Ok(EffectTerm { effect, values, held })
}

fn prior(source: &Source, entries: &DeTable<'_>, span: &Range<usize>) -> Result<Prior, Error> {
    let table = Table::new(source, "[[prior]]", entries, &["camera", "parameter", "value", "sigma"])?;
    let words = PARAMETERS.map(|parameter| (parameter, parameter));
    Ok(Prior {
        camera: table.required("camera", span, table.text("camera")?)?.to_owned(),
        parameter: table.required("parameter", span, choice(&table, "parameter", &words)?)?.to_owned(),
        value: table.required("value", span, table.number("value")?)?,
        sigma: table.required("sigma", span, table.positive("sigma")?)?,
    })
}

/// Writes a model, complete.
///
/// # Errors
/// [`Error::Write`]; [`Error::Content`] for NaN or infinity, which could not be read again.
pub fn write_model(model: &Model, path: &Path) -> Result<(), Error> {
    let camera_values = model.camera_values.values().flat_map(|values| values.values());
    let effect_values = model.effects.iter().flat_map(|term| term.values.values());
    let priors = model.priors.iter().flat_map(|prior| [&prior.value, &prior.sigma]);
    let factors = &model.sigma_factors;
    let factors = [&factors.image, &factors.mark, &factors.control, &factors.control_z, &factors.gnss, &factors.gnss_z];
    let of_flights = model.flight_factors.values().flat_map(|of| [&of.image, &of.gnss, &of.gnss_z]);
    let factors = factors.into_iter().chain(of_flights);
    if let Some(number) =
        camera_values.chain(effect_values).chain(priors).chain(factors).find(|number| !number.is_finite())
    {
        let problem = format!("{number} cannot be written; it is not a number to read");
        return Err(Error::content(path.display().to_string(), super::Place::File, problem));
    }
    super::write_atomically(path, text(model).as_bytes())
}

fn text(model: &Model) -> String {
    let word = |choice: Option<&str>| quoted(choice.unwrap_or_default());
    let free: Vec<&str> =
        PARAMETERS.into_iter().zip(model.free).filter(|(_, free)| *free).map(|(name, _)| name).collect();
    let datum = DATUMS.iter().find(|(_, datum)| *datum == model.datum).map(|(word, _)| *word);
    let loss = LOSSES.iter().find(|(_, loss)| *loss == model.loss).map(|(word, _)| *word);
    let weights = TIE_WEIGHTS.iter().find(|(_, weights)| *weights == model.tie_weights).map(|(word, _)| *word);
    let mut text = format!("format = {FORMAT}\nfree = {}\n", list(&free));
    // Writing into a String does not fail.
    if model.tie_dc_to_pp {
        let _ = writeln!(text, "tie = {}", quoted(DC_TO_PP));
    }
    let _ = writeln!(text, "datum = {}\nloss = {}\ntie_weights = {}", word(datum), word(loss), word(weights));
    let SigmaFactors { image, mark, control, control_z, gnss, gnss_z } = model.sigma_factors;
    let _ = writeln!(
        text,
        "\n[sigma_factors]\nimage = {image:?}\nmark = {mark:?}\ncontrol = {control:?}\ncontrol_z = {control_z:?}\n\
         gnss = {gnss:?}\ngnss_z = {gnss_z:?}"
    );
    for (id, FlightFactors { image, gnss, gnss_z }) in &model.flight_factors {
        let _ = writeln!(
            text,
            "\n[sigma_factors.flight.{}]\nimage = {image:?}\ngnss = {gnss:?}\ngnss_z = {gnss_z:?}",
            quoted(id)
        );
    }
    for (id, values) in &model.camera_values {
        let _ = writeln!(text, "\n[camera.{}]", quoted(id));
        write_values(&mut text, values);
    }
    for term in &model.effects {
        let held: Vec<&str> = term.held.iter().map(String::as_str).collect();
        let _ = writeln!(text, "\n[[effect]]\nid = {}\nheld = {}", quoted(&term.effect.descriptor().id), list(&held));
        text.push_str("[effect.values]\n");
        write_values(&mut text, &term.values);
    }
    for Prior { camera, parameter, value, sigma } in &model.priors {
        let _ = writeln!(text, "\n[[prior]]\ncamera = {}\nparameter = {}", quoted(camera), quoted(parameter));
        let _ = writeln!(text, "value = {value:?}\nsigma = {sigma:?}");
    }
    text
}

fn write_values(text: &mut String, values: &BTreeMap<String, f64>) {
    for (name, value) in values {
        let _ = writeln!(text, "{} = {value:?}", quoted(name));
    }
}

fn list(words: &[&str]) -> String {
    let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    format!("[{}]", words.join(", "))
}
