//! An effect of one's own through the public trait: written, held against the laws, and found in a block that has it.

use misclosure::diagnose::{run::diagnose, settings::Settings};
use misclosure::effects::*;
use misclosure::model::{Datum, EffectRef, Model};
use misclosure::{adjust::Options, inject, scenario};
use std::{f64::consts::TAU, sync::Arc};

struct Wave(Descriptor);

#[rustfmt::skip] // one line per derivative
impl Effect for Wave {
    fn descriptor(&self) -> &Descriptor { &self.0 }
    fn eval(&self, _: &Context<'_>, input: &[f64], theta: &[f64], out: &mut [f64],
            d_input: Option<&mut [f64]>, d_theta: Option<&mut [f64]>) -> Result<(), OutsideDomain> {
        let (sin, cos) = (TAU * input[0] / 250.0).sin_cos();
        out.copy_from_slice(&[input[0] + theta[0] * sin, input[1]]);
        if let Some(matrix) = d_input {
            fill_identity(Stage::Image, matrix);
            matrix[0] += theta[0] * TAU / 250.0 * cos;
        }
        if let Some(matrix) = d_theta { matrix.copy_from_slice(&[sin, 0.0]) }
        Ok(())
    }
}

pub(crate) fn main() -> anyhow::Result<()> {
    let (name, unit, scope, role) = ("a".into(), "px".into(), Scope::Global, Role::Estimated);
    let parameters = vec![Parameter { name, unit, scope, nominal: 0.0, typical: 0.2, role, plausible: None }];
    let [id, summary, formula, confused_with, source] = ["wave", "a wave", "x += a sin", "", "me"].map(Into::into);
    let (stage, kind, needs) = (Stage::Image, Kind::Physical, Vec::new());
    let (picture, words) = (Picture::Sensor, None);
    let wave = Wave(Descriptor {
        id,
        stage,
        kind,
        summary,
        formula,
        parameters,
        needs,
        confused_with,
        source,
        picture,
        words,
    });
    assert_eq!(laws::check(&wave, 1), []);
    let truth = scenario::simulate(&scenario::Scenario::preset("closerange", &Default::default())?, 1)?.block;
    let errors = ["sensor-stitch:amplitude=0.15,wavelength=250,axis=x", "noise:px=0.2"].map(inject::parse);
    let block = inject::apply(&truth, &truth, &errors.into_iter().collect::<Result<Vec<_>, _>>()?, 1)?.block;
    let (plugins, options) = ([EffectRef::Plugin(Arc::new(wave))], Options::default());
    let settings = Settings { plugins: &plugins, options, significance: 1e-3, snoop: false, tell: &|_| {} };
    let found = diagnose(&block, &Model { datum: Datum::All, ..Model::default() }, &settings)?.diagnosis;
    assert_eq!(found.recommended, ["wave"]);
    println!("{:#?}", found.candidates[0].estimate);
    Ok(())
}
