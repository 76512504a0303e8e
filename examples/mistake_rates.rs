//! How many mistakes of people are named: `cargo run --release --example mistake_rates -- 1..3` makes each kind of
//! mistake in blocks of all presets, seed by seed, and examines them as `check` does. Where that does not name the
//! mistake, the block is diagnosed: one wrong mark, a precision or a second camera shows in an adjustment alone.
//!
//! `-- 1..3 FOLDER...` makes them in these blocks instead, where the seed is the size alone.
//!
//! The mistakes are made by rewriting files (`inject --mistake`), for each subject of each kind. Every seed has another
//! size: lengths, angles, pixels and seconds are multiples of the kind's default. The clean blocks are examined, too.

use misclosure::adjust::Options;
use misclosure::diagnose::{run::diagnose, settings::Settings};
use misclosure::inject::{self, DefaultValue, mistakes};
use misclosure::io::block::{read_block, write_block};
use misclosure::mistakes::Mistake;
use misclosure::model::{Datum, Model};
use misclosure::scenario::{Scenario, SurveyNoise, add_survey_noise, simulate};
use misclosure::screening;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

const PRESETS: [&str; 4] = ["mapping", "dike", "corridor", "closerange"];
/// Tie points of a block: an examination takes a second.
const POINTS: f64 = 1000.0;
/// As in `check`.
const SIGNIFICANCE: f64 = 1e-3;
/// Sizes of a mistake in those of its default, seed by seed.
const SIZES: [f64; 5] = [1.0, 0.5, 2.0, 0.7, 1.4];
/// An image is off by the rows and columns that a crop took, px. The default is half a pixel, as of all marks.
const CROP: f64 = 40.0;
/// Units of a size.
const SIZED: [&str; 4] = ["m", "deg", "px", "s"];
/// Kinds of control that does not fix a block.
const DATUM: [&str; 2] = ["too-few", "in-line"];
/// Groups between which an offset or a unit shows: which of them is wrong, nobody knows.
const SURVEYED: [&str; 3] = ["control", "check", "gnss"];
/// Kinds that change the measurements as another statement says: kind, subject, and what is said.
///
/// - Marks of two points exchanged are two points exchanged.
/// - An offset of all tie points, against marks without it, is one of all marks.
/// - Positions a few metres off are those of a base station with other coordinates, an effect of the catalogue; those
///   of one flight are off by wrong ambiguities, another one.
const ALIKE: [[&str; 3]; 4] = [
    ["exchanged", "marks", "exchanged of control"],
    ["offset", "ties", "offset of marks"],
    ["plan-offset", "gnss", "missing gnss-shift"],
    ["flight-offset", "gnss", "missing gnss-drift"],
];

/// What became of the blocks with one mistake.
#[derive(Default)]
struct Tally {
    named: usize,
    /// Named as what changes the measurements in the same way.
    alike: usize,
    /// One wrong measurement: set aside, and its point named.
    aside: usize,
    /// Refused by the reader, with file and line.
    refused: usize,
    otherwise: BTreeMap<String, usize>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut tallies: BTreeMap<(usize, String), Tally> = BTreeMap::new();
    let mut clean = Tally::default();
    let folders: Vec<String> = std::env::args().skip(2).collect();
    let names: Vec<&str> = folders.iter().map(String::as_str).collect();
    for seed in seeds()? {
        for name in if names.is_empty() { &PRESETS[..] } else { &names } {
            let place = tempfile::tempdir()?;
            let right = match names.is_empty() {
                true => place.path().join("right"),
                false => Path::new(name).to_path_buf(),
            };
            if names.is_empty() {
                write_block(&block(name, seed)?, &right)?;
            }
            match screened(&right)?.first() {
                None => clean.named += 1,
                Some(found) => *clean.otherwise.entry(found.kind.clone()).or_default() += 1,
            }
            for (number, kind) in mistakes::registry().enumerate() {
                for subject in kind.subjects() {
                    let wrong = place.path().join("wrong");
                    let made = made(kind, subject, SIZES[(seed as usize - 1) % SIZES.len()], &right, &wrong);
                    let Some(made) = made else { continue };
                    let tally = tallies.entry((number, subject.to_string())).or_default();
                    match made {
                        Some(points) => {
                            let missed = tally.add(kind.id(), subject, &points, &wrong)?;
                            if let Some(said) = missed {
                                eprintln!("{name}, seed {seed}: {} of {subject}: {said}", kind.id());
                            }
                        }
                        None => tally.refused += 1,
                    }
                }
            }
            eprintln!("{name}, seed {seed}");
        }
    }
    print(&tallies, &clean);
    Ok(())
}

/// `1..3` or `7`; without an argument 1.
fn seeds() -> Result<Vec<u64>, Box<dyn Error>> {
    let text = std::env::args().nth(1).unwrap_or("1".into());
    let (first, last) = text.split_once("..").unwrap_or((&text, &text));
    Ok((first.parse()?..=last.parse()?).collect())
}

fn block(preset: &str, seed: u64) -> Result<misclosure::block::Block, Box<dyn Error>> {
    let truth = simulate(&Scenario::preset(preset, &[("points".to_string(), POINTS)].into())?, seed)?.block;
    let mut block = inject::apply(&truth, &truth, &[inject::parse("noise:px=0.3")?], seed)?.block;
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, seed);
    Ok(block)
}

/// Makes a mistake in a copy; `None` where the block has nothing that it concerns, `Some(None)` where no reader takes
/// it. Else the point whose measurement it changed, or the two points that it merged; of other kinds nothing.
/// Control that fixes no block concerns a block without GNSS positions, which fix it alone.
fn made(kind: &mistakes::Kind, subject: &str, size: f64, right: &Path, wrong: &Path) -> Option<Option<Vec<String>>> {
    let has_gnss = || read_block(right).is_ok_and(|read| read.block.images.iter().any(|image| image.gnss.is_some()));
    if DATUM.contains(&kind.id()) && has_gnss() {
        return None;
    }
    let _ = std::fs::remove_dir_all(wrong);
    std::fs::create_dir(wrong).ok()?;
    for file in mistakes::FILES.iter().filter(|file| right.join(file).exists()) {
        std::fs::copy(right.join(file), wrong.join(file)).ok()?;
    }
    let mut values: Vec<String> = Vec::new();
    for parameter in kind.parameters() {
        match parameter.default {
            _ if parameter.name == "of" => values.push(format!("of={subject}")),
            DefaultValue::Number(default) if SIZED.contains(&parameter.unit) && default != 0.0 => {
                let default = if (kind.id(), subject) == ("offset", "images") { CROP } else { default };
                values.push(format!("{}={}", parameter.name, size * default));
            }
            _ => {}
        }
    }
    let text = format!("{}:{}", kind.id(), values.join(","));
    let made = mistakes::make(wrong, &[mistakes::parse(text.trim_end_matches(':')).ok()?]).ok()?;
    let notes = made.into_iter().flat_map(|made| made.notes);
    let points = notes.filter(|(what, _)| ["point", "a", "b"].contains(&what.as_str())).map(|(_, name)| name);
    Some(read_block(wrong).is_ok().then(|| points.collect()))
}

fn screened(folder: &Path) -> Result<Vec<Mistake>, Box<dyn Error>> {
    let block = read_block(folder)?.block.about_its_centre();
    Ok(screening::mistakes(&block, &Model::default(), SIGNIFICANCE, &Options::default()))
}

/// What a diagnosis says.
struct Said {
    mistakes: Vec<Mistake>,
    /// Points of the measurements that it set aside.
    aside: Vec<String>,
    /// The first mistake, else verdict and effects.
    words: String,
}

fn diagnosed(folder: &Path) -> Result<Said, Box<dyn Error>> {
    let block = read_block(folder)?.block.about_its_centre();
    let model = Model { datum: Datum::All, ..Model::default() };
    let options = Options::default();
    let settings = Settings { plugins: &[], options, significance: SIGNIFICANCE, snoop: true, tell: &|_| {} };
    let found = match diagnose(&block, &model, &settings) {
        Ok(diagnosed) => diagnosed.diagnosis,
        Err(error) => {
            return Ok(Said { mistakes: Vec::new(), aside: Vec::new(), words: format!("error: {error}") });
        }
    };
    let effects: Vec<&str> = found.found.iter().map(|own| own.effect.as_str()).collect();
    let verdict = format!("{:?} {}", found.verdict, effects.join(" ")).to_lowercase().trim().to_owned();
    let words = found.mistakes.first().map_or(verdict, |own| format!("{} of {}", own.kind, own.subject));
    Ok(Said { mistakes: found.mistakes, aside: found.outlier_points, words })
}

impl Tally {
    /// Counts a block; gives what was said of a mistake that was not named.
    fn add(
        &mut self,
        kind: &str,
        subject: &str,
        points: &[String],
        folder: &Path,
    ) -> Result<Option<String>, Box<dyn Error>> {
        let same = |own: &str| own == subject || (SURVEYED.contains(&own) && SURVEYED.contains(&subject));
        let is_named = |found: &[Mistake]| found.iter().any(|own| own.kind == kind && same(&own.subject));
        if is_named(&screened(folder)?) {
            self.named += 1;
            return Ok(None);
        }
        let said = diagnosed(folder)?;
        if is_named(&said.mistakes) {
            self.named += 1;
        } else if ALIKE.contains(&[kind, subject, &said.words]) {
            self.alike += 1;
        } else if said.mistakes.is_empty() && points.iter().any(|point| said.aside.contains(point)) {
            self.aside += 1;
        } else {
            *self.otherwise.entry(said.words.clone()).or_default() += 1;
            return Ok(Some(said.words));
        }
        Ok(None)
    }

    fn all(&self) -> usize {
        self.named + self.alike + self.aside + self.refused + self.otherwise.values().sum::<usize>()
    }

    fn words(&self) -> String {
        self.otherwise.iter().map(|(said, count)| format!("{count} {said}")).collect::<Vec<_>>().join(", ")
    }
}

fn print(tallies: &BTreeMap<(usize, String), Tally>, clean: &Tally) {
    println!("| mistake | of | blocks | named | alike | set aside | refused | otherwise |");
    println!("|---|---|---|---|---|---|---|---|");
    for ((number, subject), tally) in tallies {
        let id = mistakes::registry().nth(*number).map_or("", mistakes::Kind::id);
        let Tally { named, alike, aside, refused, .. } = tally;
        let (all, words) = (tally.all(), tally.words());
        println!("| `{id}` | {subject} | {all} | {named} | {alike} | {aside} | {refused} | {words} |");
    }
    let sum = |of: fn(&Tally) -> usize| tallies.values().map(of).sum::<usize>();
    let columns: [fn(&Tally) -> usize; 5] =
        [|own| own.named, |own| own.alike, |own| own.aside, |own| own.refused, Tally::all];
    let [named, alike, aside, refused, all] = columns.map(sum);
    println!(
        "\n{named} of {all} are named with their kind and subject, {alike} as what looks the same; of {aside} the \
         wrong measurement is set aside and its point named; a reader refuses {refused}, with file and line."
    );
    println!("Of {} blocks without a mistake {} have none named. {}", clean.all(), clean.named, clean.words());
}
