//! The test kit of the effects must notice what it is there for: an effect with one fault of each kind breaks the law
//! that forbids it.

use misclosure::effects::laws::{check, unique_ids};
use misclosure::effects::{Context, Descriptor, Effect, Need, OutsideDomain, find};
use std::sync::atomic::{AtomicU32, Ordering};

/// One fault, put into a sound effect's answers: arguments are the parameters, the output, and both derivatives.
type Fault = fn(&[f64], &mut [f64], Option<&mut [f64]>, Option<&mut [f64]>);

struct Faulty {
    sound: &'static dyn Effect,
    descriptor: Descriptor,
    fault: Fault,
}

impl Effect for Faulty {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn reads_place(&self) -> [bool; 2] {
        self.sound.reads_place()
    }

    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        mut d_input: Option<&mut [f64]>,
        mut d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        self.sound.eval(context, input, theta, out, d_input.as_deref_mut(), d_theta.as_deref_mut())?;
        (self.fault)(theta, out, d_input, d_theta);
        Ok(())
    }
}

fn faulty(id: &str, fault: Fault) -> Faulty {
    let sound = find(id).unwrap();
    Faulty { sound, descriptor: sound.descriptor().clone(), fault }
}

fn laws_broken(effect: &dyn Effect) -> Vec<&'static str> {
    check(effect, 1).iter().map(|violation| violation.law).collect()
}

#[test]
fn a_sound_effect_breaks_no_law() {
    assert!(laws_broken(&faulty("radial-high", |_, _, _, _| {})).is_empty());
}

#[test]
fn an_offset_breaks_the_null_law_alone() {
    let effect = faulty("radial-high", |_, out, _, _| out[0] += 1e-9);
    assert_eq!(laws_broken(&effect), ["null law"]);
}

#[test]
fn a_missing_derivative_by_the_centre_of_distortion_is_noticed() {
    let effect = faulty("radial-high", |_, _, d_input, _| {
        if let Some(matrix) = d_input {
            (matrix[5], matrix[14 + 6]) = (0.0, 0.0);
        }
    });
    assert_eq!(laws_broken(&effect), ["derivatives"]);
}

#[test]
fn a_wrong_hundredth_of_an_effect_that_is_a_millionth_of_the_identity_is_noticed() {
    let effect = faulty("refraction", |theta, _, d_input, _| {
        if let Some(matrix) = d_input {
            // kappa H is of the order of 1e-6 here.
            matrix[6] += 0.01 * theta[0] * 50.0;
        }
    });
    assert_eq!(laws_broken(&effect), ["derivatives"]);
}

#[test]
fn a_wrong_sign_of_the_turn_is_noticed() {
    let effect = faulty("rolling-shutter", |_, _, _, d_theta| {
        if let Some(matrix) = d_theta {
            matrix[..3].iter_mut().for_each(|value| *value = -*value);
        }
    });
    assert_eq!(laws_broken(&effect), ["derivatives"]);
}

#[test]
fn a_column_of_a_given_parameter_is_noticed() {
    let effect = faulty("focal-time", |_, _, _, d_theta| {
        if let Some(matrix) = d_theta {
            matrix[1] = 1.0;
        }
    });
    assert_eq!(laws_broken(&effect), ["derivatives"]);
}

#[test]
fn an_entry_that_is_not_finite_is_noticed() {
    let effect = faulty("focal-time", |_, _, _, d_theta| {
        if let Some(matrix) = d_theta {
            matrix[2 * 11] = f64::NAN;
        }
    });
    assert!(laws_broken(&effect).contains(&"finiteness"));
}

#[test]
fn state_is_noticed() {
    static CALLS: AtomicU32 = AtomicU32::new(0);
    let effect = faulty("focal-flight", |theta, out, _, _| {
        out[0] += theta[0] * 1e-12 * f64::from(CALLS.fetch_add(1, Ordering::Relaxed) % 2);
    });
    assert!(laws_broken(&effect).contains(&"purity"));
}

#[test]
fn needs_that_are_missing_or_idle_are_noticed() {
    let mut effect = faulty("focal-time", |_, _, _, _| {});
    effect.descriptor.needs.clear();
    assert_eq!(laws_broken(&effect), ["needs"]);
    effect.descriptor.needs = vec![Need::Time, Need::Velocity];
    assert_eq!(laws_broken(&effect), ["needs"]);
}

#[test]
fn a_descriptor_that_is_not_complete_is_noticed() {
    let spoilt: [fn(&mut Descriptor); 7] = [
        |d| d.source = "".into(),
        |d| d.id = "Focal Time".into(),
        |d| d.parameters[0].typical = 0.0,
        |d| d.parameters[0].name = "against".into(),
        |d| d.parameters[1].nominal = 2.0,
        |d| d.parameters[0].unit = "".into(),
        |d| d.parameters[0].plausible.as_mut().unwrap().max = 1.0,
    ];
    for spoil in spoilt {
        let mut effect = faulty("focal-time", |_, _, _, _| {});
        spoil(&mut effect.descriptor);
        assert!(laws_broken(&effect).contains(&"descriptor"), "{:?}", effect.descriptor);
    }
    let mut effect = faulty("gnss-shift", |_, _, _, _| {});
    effect.descriptor.needs.clear();
    assert_eq!(laws_broken(&effect), ["descriptor"]);
}

#[test]
fn one_id_for_two_effects_is_noticed() {
    let twice = [find("focal-time").unwrap(), find("pp-time").unwrap(), find("focal-time").unwrap()];
    assert_eq!(unique_ids(&twice).unwrap_err().effect, "focal-time");
}
