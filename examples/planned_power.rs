//! Does a diagnosis find what a plan says? `cargo run --release --example planned_power -- 60` plans a small dike and
//! puts an error of each planned size into 60 blocks. It prints the share of blocks in which a diagnosis names anything,
//! and the share in which it names the right effect. Further words are the only effects that it tries.

use misclosure::adjust::Options;
use misclosure::diagnose::{run::diagnose, settings::Settings};
use misclosure::inject;
use misclosure::model::{Datum, Model};
use misclosure::plan::plan;
use misclosure::scenario::{Scenario, simulate};
use rayon::prelude::*;
use std::error::Error;

/// Effect, its parameter, and the error that causes it, without its size.
const EFFECTS: [[&str; 3]; 8] = [
    ["rolling-shutter", "t", "rolling-shutter:readout="],
    ["gnss-shift", "tz", "gnss-shift:z="],
    ["gnss-lever-arm", "lx", "gnss-lever-arm:y=0,z=0,x="],
    ["gnss-delay", "dt", "gnss-delay:dt="],
    ["focal-temperature", "a", "temperature-focal:alpha="],
    ["pp-time", "ax", "pp-drift:x="],
    ["focal-image", "s", "focus-hunting:size="],
    ["local-flaw", "lambda", "local-flaw:CENTRE,lambda="],
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let blocks: u64 = words.next().unwrap_or("60".into()).parse()?;
    let only: Vec<String> = words.collect();
    let few = [("points".to_string(), 400.0), ("check".to_string(), 60.0)].into();
    let truth = simulate(&Scenario::preset("dike", &few)?, 1)?.block;
    let model = Model { datum: Datum::All, ..Model::default() };
    // One thread for a diagnosis: the blocks run in parallel.
    let options = Options { threads: 1, ..Options::default() };
    let settings = Settings { plugins: &[], options, significance: 1e-3, snoop: true, tell: &|_| {} };
    let planned = plan(&truth, &model, &settings)?;
    println!("| effect | seen from | anything named | named from | named |");
    println!("|---|---|---|---|---|");
    for [effect, parameter, error] in EFFECTS {
        if !only.is_empty() && !only.iter().any(|own| own == effect) {
            continue;
        }
        let own = planned.effects.iter().find(|own| own.effect == effect).ok_or(effect)?;
        let size = own.sizes.iter().find(|size| size.parameter == parameter).ok_or(parameter)?;
        let places = own.at.iter().map(|(name, value)| format!("{name}={value}"));
        let error = error.replace("CENTRE", &places.collect::<Vec<_>>().join(","));
        let share = |size: f64, counts: &(dyn Fn(&[String]) -> bool + Sync)| -> Result<f64, Box<dyn Error>> {
            let errors = [inject::parse(&format!("{error}{size}"))?, inject::parse("noise:gnss=1,control=1")?];
            let is_found = |seed: u64| -> Result<usize, String> {
                let block = inject::apply(&truth, &truth, &errors, seed).map_err(|error| format!("{error:#}"))?.block;
                let diagnosed = diagnose(&block, &model, &settings).map_err(|error| error.to_string())?;
                Ok(usize::from(counts(&diagnosed.diagnosis.recommended)))
            };
            let found: usize = (0..blocks).into_par_iter().map(is_found).sum::<Result<_, _>>()?;
            Ok(1e2 * found as f64 / blocks as f64)
        };
        let seen = share(size.size, &|named| !named.is_empty())?;
        let unit = &size.unit;
        print!("| `{effect}` | {parameter} = {:.2e} {unit} | {seen:.0} % |", size.size);
        match size.named_size {
            None => println!(" - | - |"),
            Some(size) => {
                let named = share(size, &|named| named.iter().any(|own| own == effect))?;
                println!(" {size:.2e} {unit} | {named:.0} % |");
            }
        }
    }
    Ok(())
}
