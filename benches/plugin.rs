//! What a plug-in costs beside the same effect built in: part of `make bench`, or `cargo bench --bench plugin`.
//! `MISCLOSURE_BENCH_THREADS` sets the number of threads (2).
//!
//! Headers of ours with only the id changed, one per stage that every measurement goes through, solved by turns with
//! what is built in.

use anyhow::{Context, Result, ensure};
use misclosure::adjust::{BUILT, CovarianceOf, Options};
use misclosure::block::Block;
use misclosure::effects::{find, plugin};
use misclosure::kit::build::build;
use misclosure::model::{Datum, EffectRef, EffectTerm, Model};
use misclosure::problem::Problem;
use misclosure::report::numbers::fixed;
use misclosure::report::tables::Table;
use misclosure::scenario::{Scenario, SurveyNoise, add_noise, add_survey_noise, simulate};
use std::ops::ControlFlow;
use std::path::Path;

/// An effect of the ray, exposure, interior and image stage each.
const EFFECTS: [&str; 4] = ["refraction", "rolling-shutter", "focal-time", "decentring-high"];
const SEED: u64 = 1;
/// px.
const NOISE_PX: f64 = 0.3;
/// Of each the fastest counts: what the machine does beside it only adds.
const TURNS: usize = 7;
/// What a plug-in may cost.
const LIMIT: f64 = 1.15;

fn main() -> Result<()> {
    let threads = match std::env::var("MISCLOSURE_BENCH_THREADS") {
        Ok(text) => text.parse().with_context(|| format!("MISCLOSURE_BENCH_THREADS = {text}: expected a number"))?,
        Err(_) => 2,
    };
    let block = block()?;
    let folder = tempfile::tempdir()?;
    let mut table = Table::new("").text("effect", "").text("stage", "").text("solver", "");
    table = table.number("built in", "ms").number("plug-in", "ms").number("ratio", "").number("per measurement", "ns");
    let options = Options { threads, covariance: CovarianceOf::Nothing, ..Options::default() };
    let mut worst = 0.0_f64;
    for id in EFFECTS {
        let own = find(id).with_context(|| format!("no effect {id}"))?;
        let stage = own.descriptor().stage.name();
        let problems = [EffectRef::Builtin(own), EffectRef::Plugin(plugged(folder.path(), id)?)].map(|effect| {
            let term = EffectTerm { effect, values: Default::default(), held: Vec::new() };
            let model = Model { datum: Datum::All, tie_dc_to_pp: true, effects: vec![term], ..Model::default() };
            Problem::new(&block, &model)
        });
        for solver in BUILT {
            let mut fastest = [f64::INFINITY; 2];
            for _ in 0..TURNS {
                for (time, problem) in fastest.iter_mut().zip(&problems) {
                    let problem = problem.as_ref().map_err(ToString::to_string).map_err(anyhow::Error::msg)?;
                    let solution = solver.solve(problem, &options, &mut |_| ControlFlow::Continue(()))?;
                    ensure!(solution.iterations > 0, "{id}: nothing was iterated");
                    *time = time.min(solution.seconds / solution.iterations as f64);
                }
            }
            let [built_in, plug_in] = fastest;
            worst = worst.max(plug_in / built_in);
            let more = 1e9 * (plug_in - built_in) / (block.ties.len() + block.marks.len()) as f64;
            table.row([
                id.to_string(),
                stage.into(),
                solver.name().into(),
                fixed(1e3 * built_in, 2),
                fixed(1e3 * plug_in, 2),
                fixed(plug_in / built_in, 3),
                fixed(more, 0),
            ]);
        }
    }
    println!(
        "{} measurements, {threads} threads, an iteration, fastest of {TURNS}\n",
        block.ties.len() + block.marks.len()
    );
    println!("{}", table.to_text());
    println!("at most {LIMIT} allowed: {}", if worst <= LIMIT { "kept" } else { "NOT KEPT" });
    Ok(())
}

fn block() -> Result<Block> {
    let mut block = simulate(&Scenario::preset("dike", &[("points".to_string(), 8000.0)].into())?, SEED)?.block;
    add_noise(&mut block, NOISE_PX, SEED)?;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, SEED);
    Ok(block)
}

/// The header `id` as a plug-in `my-id`.
fn plugged(folder: &Path, id: &str) -> Result<std::sync::Arc<dyn misclosure::effects::Effect>> {
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("cpp/effects/{id}.h"));
    let source = std::fs::read_to_string(header)?.replace(&format!("\"{id}\""), &format!("\"my-{id}\""));
    let (header, library) = (folder.join(format!("my-{id}.h")), folder.join(format!("my-{id}.so")));
    std::fs::write(&header, source)?;
    build(&header, &library)?;
    Ok(plugin::load(&library)?)
}
