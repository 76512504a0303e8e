//! From a seed to a block: what is in it, and how it was measured.

use crate::fresh::causes::{Cause, cause_of, effects_of, is_random, outsider};
use crate::fresh::scenes::{Kind, Scene};
use misclosure::inject::Random;
use misclosure::inject::recipe::Recipe;
use std::path::Path;

/// A block that nobody chose.
#[derive(Debug, Clone)]
pub struct Fresh {
    /// What it was drawn from.
    pub seed: u64,
    /// Where.
    pub scene: Scene,
    /// What goes wrong.
    pub causes: Vec<Drawn>,
    noise_px: f64,
    stated_px: f64,
    gross: f64,
    start: Option<Start>,
}

/// A cause and the noncentrality that it shall have.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The cause.
    pub cause: Cause,
    /// Drop of `v'Pv` that it is scaled to.
    pub noncentrality: f64,
}

#[derive(Debug, Clone, Copy)]
struct Start {
    position_m: f64,
    angle_deg: f64,
    focal_px: f64,
    points: bool,
}

/// Part of the blocks in which nothing is wrong.
const CLEAN: f64 = 0.15;
/// Part of the blocks with a cause that no catalogue knows.
const UNKNOWN: f64 = 0.1;
/// Part of the blocks with an outsider that have an effect of the catalogue besides; of the others, those with two
/// effects.
const SECOND: f64 = 0.4;
/// Noncentralities are drawn between these, evenly in the logarithm: from just above what is asked for to what nobody
/// overlooks.
const NONCENTRALITY: [f64; 2] = [100.0, 1000.0];
/// Times that for what has a value for every image or place: its test has as many degrees of freedom, and sees less of
/// each.
const OF_MANY_VALUES: f64 = 2.5;

impl Fresh {
    /// The same block for the same seed, on every machine.
    pub fn draw(seed: u64) -> Self {
        let random = &mut Random::new(seed, "fresh", 0);
        let scene = Scene::draw(random);
        let causes = causes(&scene, random);
        let noise_px = random.uniform(0.2, 0.5);
        let stated_px = noise_px * 2f64.powf(random.uniform(-1.0, 1.0));
        let gross = if random.index(3) == 0 { 0.0 } else { random.uniform(0.0, 0.04) };
        let start = (random.index(2) == 0).then(|| start(scene.kind, random));
        Self { seed, scene, causes, noise_px, stated_px, gross, start }
    }

    /// A recipe with these causes, for a scenario that stands at `scenario`.
    pub fn recipe(&self, causes: &[String], scenario: &Path) -> Recipe {
        let Self { seed, noise_px, stated_px, gross, .. } = self;
        // A scenario's path is relative to the recipe's folder, and an absolute one stays what it is.
        let mut text = format!(
            "about = 'fresh'\nseed = {seed}\ncauses = {causes:?}\n[scenario]\nfile = '{}'\n[noise]\npx = {noise_px}\n\
             stated_px = {stated_px}\n",
            scenario.display()
        );
        if *gross > 0.0 {
            // From 10 to 100 times the noise, as in the recipes of the repository.
            let (min, max) = (10.0 * noise_px, 100.0 * noise_px);
            text += &format!("[outliers]\nfraction = {gross}\nmin_px = {min}\nmax_px = {max}\n");
        }
        if let Some(Start { position_m, angle_deg, focal_px, points }) = self.start {
            text += &format!(
                "[start]\nposition_m = {position_m}\nangle_deg = {angle_deg}\nfocal_px = {focal_px}\n\
                 points = {points}\n"
            );
        }
        // A recipe has to state a truth; the judge here computes it.
        text += "[truth]\nverdict = 'adequate'\nnoncentrality = 0.0\ncheck_mm = { base = 0.0, model = 0.0 }\n";
        toml::from_str(&text).unwrap_or_else(|error| panic!("{error}\n{text}"))
    }
}

fn causes(scene: &Scene, random: &mut Random) -> Vec<Drawn> {
    let chance = random.uniform(0.0, 1.0);
    let unknown = chance >= 1.0 - UNKNOWN;
    let second = random.uniform(0.0, 1.0) < SECOND;
    let effects = match (chance < CLEAN, unknown) {
        (true, _) => 0,
        (false, true) => usize::from(second),
        (false, false) => 1 + usize::from(second),
    };
    let catalogue = effects_of(scene.kind);
    let chosen = random.choose((0..catalogue.len()).collect(), effects);
    let mut causes: Vec<Cause> = chosen.into_iter().map(|k| cause_of(catalogue[k], scene, random)).collect();
    if unknown {
        let outsider = outsider(scene, random);
        // Two readouts of the same rows would be one.
        causes.retain(|cause| outsider.companion.is_none() || cause.name() != "rolling-shutter");
        causes.push(outsider);
    }
    let mut sized = |cause: Cause| {
        let many = cause.effect.as_ref().is_none_or(|term| is_random(term.id));
        let factor = if many { OF_MANY_VALUES } else { 1.0 };
        let [low, high] = NONCENTRALITY.map(f64::ln);
        Drawn { cause, noncentrality: factor * random.uniform(low, high).exp() }
    };
    causes.into_iter().map(&mut sized).collect()
}

/// Start values as far off as in the recipes of the repository.
fn start(kind: Kind, random: &mut Random) -> Start {
    let position_m = if kind == Kind::CloseRange { 0.02 } else { random.uniform(0.2, 0.5) };
    Start {
        position_m,
        angle_deg: random.uniform(0.2, 0.5),
        focal_px: random.uniform(-20.0, 20.0),
        points: random.index(2) == 0,
    }
}
