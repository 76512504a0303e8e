//! A block is simulated, something goes wrong with it, it is adjusted, and the diagnosis says what: `cargo run
//! --release --example diagnose`.

use misclosure::adjust::{Options, ceres::Ceres, native::Native};
use misclosure::diagnose::{run::diagnose, settings::Settings};
use misclosure::model::{Datum, Model};
use misclosure::scenario::{Scenario, SurveyNoise, add_survey_noise, simulate};
use misclosure::{inject, run};
use std::ops::ControlFlow;

/// The whole loop, in the order in which it happens.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Error-free measurements of a dike, 113 images, and the truth behind them.
    let scenario = Scenario::preset("dike", &[("points".to_string(), 600.0)].into())?;
    let truth = simulate(&scenario, 1)?.block;
    // A rolling shutter that takes 30 ms, and what every measurement has.
    let errors = [inject::parse("rolling-shutter:readout=0.03")?, inject::parse("noise:px=0.3")?];
    let mut block = inject::apply(&truth, &truth, &errors, 1)?.block;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, 1);
    // All twelve camera parameters, control points and GNSS; both solvers, which must agree.
    let model = Model { datum: Datum::All, ..Model::default() };
    let options = Options::default();
    let adjusted = run::adjust(&block, &model, &[&Ceres, &Native], &options, &mut |_, _| ControlFlow::Continue(()))?;
    let agree = adjusted.agreement.as_ref().is_some_and(|agreement| agreement.agree);
    let check = |run: &run::Run| run.comparison.as_ref().and_then(|c| c.check.map(|check| 1e3 * check.rms_m.xyz));
    println!("The solvers agree: {agree}. sigma0 {:.3}, check points {:.2?} mm", adjusted.sigma0(), check(&adjusted));
    // What is missing?
    let settings = Settings { plugins: &[], options, significance: 1e-3, snoop: true, tell: &|_| {} };
    let diagnosed = diagnose(&block, &model, &settings)?;
    println!("Missing: {}", diagnosed.diagnosis.recommended.join(", "));
    assert!(agree && diagnosed.diagnosis.recommended == ["rolling-shutter"]);
    Ok(())
}
