//! A survey without errors: its positions are estimated to be far more precise than stated, and beside them a shift of
//! all looks like control that is less precise than stated.

use crate::common::{disagreement, preset};
use misclosure::adjust::{BUILT, Options};
use misclosure::block::Block;
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::settings::Settings;
use misclosure::diagnose::verdict::Verdict;
use misclosure::inject;
use misclosure::model::Model;
use misclosure::run;
use std::ops::ControlFlow;

/// Shift of all positions in height, m; the images take up most of it as a focal length.
const SHIFT_M: f64 = 0.1;
/// Noise of the image coordinates, px, stated as it is.
const NOISE_PX: f64 = 0.3;
/// Standard deviations by which the estimate may miss.
const SIGMAS: f64 = 4.0;
/// Family-wise level, that of the command line.
const SIGNIFICANCE: f64 = 1e-3;

#[test]
fn a_shift_is_not_an_imprecise_control() {
    for seed in [1, 2] {
        let block = shifted(seed);
        let model = Model { datum: run::default_diagnosis_datum(&block), ..Model::default() };
        let options = Options::default();
        let settings = Settings { plugins: &[], options, significance: SIGNIFICANCE, snoop: true, tell: &|_| {} };
        let diagnosed = diagnose(&block, &model, &settings).expect("a diagnosis");
        let fit = &diagnosed.improvement.fit;
        let both = run::adjust_from(
            &diagnosed.block,
            &fit.model,
            Some(fit.solved()),
            BUILT,
            &Options::default(),
            &mut |_, _| ControlFlow::Continue(()),
        );
        assert_eq!(disagreement(&both.expect("solved")), None, "seed {seed}");
        let diagnosis = &diagnosed.diagnosis;
        assert_eq!((diagnosis.verdict, &diagnosis.mistakes), (Verdict::Missing, &vec![]), "seed {seed}");
        assert_eq!(diagnosis.recommended, ["gnss-shift"], "seed {seed}");
        let tz = &diagnosis.found[0].estimate["tz"];
        assert!((tz.value - SHIFT_M).abs() < SIGMAS * tz.sigma, "seed {seed}: {} +- {} m", tz.value, tz.sigma);
    }
}

fn shifted(seed: u64) -> Block {
    let truth = preset("mapping", &[], seed).block;
    let errors = [format!("gnss-shift:z={SHIFT_M}"), format!("noise:px={NOISE_PX}")];
    let errors = errors.map(|error| inject::parse(&error).expect("an error"));
    let mut block = inject::apply(&truth, &truth, &errors, seed).expect("injected").block;
    (block.sigma.tie_px, block.sigma.mark_px) = (NOISE_PX, NOISE_PX);
    block
}
