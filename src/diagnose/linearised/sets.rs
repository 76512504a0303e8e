//! Columns of a null model, laid out by the sets that they belong to: what is in, then what is asked.

use super::super::added::Added;
use super::super::candidate::{Addition, Candidate, is_random};
use super::super::select::{Nature, Searched, Set, Taken};
use crate::effects::{Kind, Role};
use crate::model::{EffectTerm, Model};
use crate::null_model::is_column;
use crate::problem::{Problem, State};

/// The sets, and their columns in order.
#[derive(Default)]
pub struct Laid {
    pub sets: Vec<Set>,
    /// Candidate of each set; `None` for what is in.
    pub candidates: Vec<Option<Candidate>>,
    /// Unknown of each column.
    pub columns: Vec<usize>,
    /// Value of each column in the fit.
    pub values: Vec<f64>,
    /// Variances of the columns that are in; zero for laws.
    variances: Vec<f64>,
}

impl Laid {
    /// What was taken in.
    pub fn take_in(&mut self, problem: &Problem, state: &State, model: &Model, added: &Added) {
        let layout = problem.layout();
        for (effect, term) in model.effects.iter().enumerate().skip(added.own) {
            let first = self.columns.len();
            for t in thetas(problem, effect, false) {
                let entry = &problem.theta[t];
                let role = &term.effect.descriptor().parameters[entry.parameter as usize].role;
                let nominal = if matches!(role, Role::Searched(_)) { state.theta[t] } else { entry.prior_mean };
                self.values.push((state.theta[t] - nominal) / entry.scale);
                self.variances.push((entry.prior_sigma.unwrap_or(0.0) / entry.scale).powi(2));
                self.columns.push(layout.theta(t));
            }
            let id = term.effect.descriptor().id.to_string();
            let physical = term.effect.descriptor().kind == Kind::Physical;
            let search = added.placed.get(&id).map_or(Searched::None, |count| Searched::Placed { count: *count });
            self.set(Set { id, columns: self.since(first), nature: nature_of(term), physical, search }, None);
        }
        for (id, held) in &added.freed {
            let first = self.columns.len();
            for (k, at) in held {
                for (camera, at) in at.iter().enumerate() {
                    if problem.camera_free[camera][*k] {
                        self.columns.push(layout.camera(camera, *k));
                        self.values.push((state.interiors[camera][*k] - at) / problem.camera_scales[camera][*k]);
                        self.variances.push(0.0);
                    }
                }
            }
            let (id, columns) = (id.clone(), self.since(first));
            self.set(Set { id, columns, nature: Nature::Law, physical: true, search: Searched::None }, None);
        }
    }

    /// The sets so far, as what is in.
    pub fn taken(&self) -> Vec<Taken> {
        let variance = |set: &Set| set.columns.first().map_or(0.0, |column| self.variances[*column]);
        let sets = self.sets.iter().enumerate();
        sets.map(|(set, own)| Taken { set, variance: variance(own) }).collect()
    }

    /// What is asked; `effect`: that of the first candidate in the problem.
    pub fn ask(&mut self, problem: &Problem, tested: Vec<(Candidate, Searched)>, mut effect: usize) {
        let layout = problem.layout();
        for (candidate, search) in tested {
            let first = self.columns.len();
            let nature = match &candidate.addition {
                Addition::Effect(term) => {
                    self.columns.extend(thetas(problem, effect, true).into_iter().map(|t| layout.theta(t)));
                    effect += 1;
                    nature_of(term)
                }
                Addition::Free(indices) => {
                    let cameras = (0..problem.camera_free.len()).filter(|camera| is_used(problem, *camera));
                    self.columns.extend(cameras.flat_map(|c| indices.iter().map(move |k| layout.camera(c, *k))));
                    Nature::Law
                }
            };
            self.values.resize(self.columns.len(), 0.0);
            let (id, physical) = (candidate.id.clone(), candidate.physical);
            self.set(Set { id, columns: self.since(first), nature, physical, search }, Some(candidate));
        }
    }

    fn since(&self, first: usize) -> Vec<usize> {
        (first..self.columns.len()).collect()
    }

    fn set(&mut self, set: Set, candidate: Option<Candidate>) {
        self.sets.push(set);
        self.candidates.push(candidate);
    }
}

/// Free parameters that are the effect's own; those that are searched where they are not held, and of values per image
/// a sample.
fn thetas(problem: &Problem, effect: usize, held_searched: bool) -> Vec<usize> {
    let of = problem.theta.iter().enumerate().filter(|(_, entry)| entry.effect as usize == effect && entry.free);
    let parameters = &problem.effects[effect].effect.descriptor().parameters;
    let asked = |parameter: u32| match parameters[parameter as usize].role {
        Role::Searched(_) => !held_searched,
        Role::VelocityError => false,
        _ => true,
    };
    of.filter(|(_, entry)| asked(entry.parameter) && is_column(problem, entry)).map(|(t, _)| t).collect()
}

/// Has a camera an image that takes part?
fn is_used(problem: &Problem, camera: usize) -> bool {
    let of_camera = |image: usize| problem.image_contexts[image].camera as usize == camera;
    (0..problem.pose_free.len()).any(|image| of_camera(image) && problem.pose_free[image] != [false; 6])
}

fn nature_of(term: &EffectTerm) -> Nature {
    if is_random(&term.effect) { Nature::Chance } else { Nature::Law }
}
