//! `model.toml`: what is written comes back, and what is wrong is named.

use misclosure::effects::{Context, Descriptor, Effect, Kind, OutsideDomain, Parameter, Picture, Role, Scope, Stage};
use misclosure::io::model::{read_model, write_model};
use misclosure::model::{Datum, EffectRef, EffectTerm, FlightFactors, Loss, Model, Prior, SigmaFactors, TieWeights};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// An effect that only has a name and parameters: one of a kind of each scope and role that a key may speak of.
struct Named(Descriptor);

impl Effect for Named {
    fn descriptor(&self) -> &Descriptor {
        &self.0
    }

    fn eval(
        &self,
        _: &Context<'_>,
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
        _: Option<&mut [f64]>,
        _: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        Err(OutsideDomain)
    }
}

fn effect(id: &str) -> Option<EffectRef> {
    let parameter = |name: &'static str, scope, role| Parameter {
        name: name.into(),
        unit: "px".into(),
        scope,
        nominal: 0.0,
        typical: 1.0,
        role,
        plausible: None,
    };
    let parameters = match id {
        "drift" => {
            vec![parameter("shift", Scope::Flight, Role::Estimated), parameter("rate", Scope::Global, Role::Estimated)]
        }
        "jitter" => vec![parameter("offset", Scope::Image, Role::Random("spread"))],
        _ => return None,
    };
    Some(EffectRef::Plugin(Arc::new(Named(Descriptor {
        id: id.to_owned().into(),
        stage: Stage::Ray,
        kind: Kind::Physical,
        summary: "".into(),
        formula: "".into(),
        parameters,
        needs: Vec::new(),
        confused_with: "".into(),
        source: "".into(),
        picture: Picture::Sensor,
        words: None,
    }))))
}

fn read(text: impl AsRef<[u8]>) -> Result<Model, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    std::fs::write(&path, text).unwrap();
    read_model(&path, &effect).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

fn written(model: &Model) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    write_model(model, &path).unwrap();
    std::fs::read_to_string(path).unwrap()
}

fn full() -> Model {
    let numbers = |pairs: &[(&str, f64)]| pairs.iter().map(|(key, value)| ((*key).to_owned(), *value)).collect();
    Model {
        free: std::array::from_fn(|i| i % 3 != 1),
        tie_dc_to_pp: true,
        camera_values: BTreeMap::from([
            ("cam".to_owned(), numbers(&[("f", 5510.09), ("k3", 1.4e-24)])),
            ("left \"eye\".\n".to_owned(), numbers(&[("ppx", -0.1)])),
        ]),
        effects: vec![
            EffectTerm {
                effect: effect("jitter").unwrap(),
                values: numbers(&[("spread", 0.1 + 0.2)]),
                held: vec!["spread".to_owned()],
            },
            EffectTerm {
                effect: effect("drift").unwrap(),
                values: numbers(&[("shift[second flight]", 1e-300), ("shift[a]b]", 2.0), ("rate", 3.0)]),
                held: vec!["rate".to_owned(), "shift[first]".to_owned()],
            },
        ],
        priors: vec![Prior { camera: "cam".to_owned(), parameter: "b1".to_owned(), value: 0.0, sigma: 1e-9 }],
        datum: Datum::Gnss,
        loss: Loss::Cauchy,
        tie_weights: TieWeights::Pairs,
        sigma_factors: SigmaFactors { image: 0.75, mark: 1.75, control: 2.0, control_z: 1.5, gnss: 1.25, gnss_z: 2.5 },
        flight_factors: [("second flight".to_owned(), FlightFactors { image: 1.5, gnss: 0.5, gnss_z: 3.0 })].into(),
    }
}

/// Everything of a model that a comparison can see.
fn content(model: &Model) -> String {
    let terms: Vec<_> =
        model.effects.iter().map(|term| (format!("{:?}", term.effect), &term.values, &term.held)).collect();
    format!("{model:?} {terms:?}")
}

#[test]
fn every_part_comes_back() {
    for model in [Model::default(), full()] {
        let text = written(&model);
        let again = read(&text).unwrap();
        assert_eq!(content(&again), content(&model), "{text}");
        assert_eq!(written(&again), text);
    }
}

#[test]
fn the_text_is_plain() {
    let model = Model { effects: full().effects.split_off(1), priors: full().priors, ..Model::default() };
    let expected = r#"format = 1
free = ["f", "ppx", "ppy", "dcx", "dcy", "k1", "k2", "k3", "p1", "p2", "b1", "b2"]
datum = "free"
loss = "none"
tie_weights = "unit"

[sigma_factors]
image = 1.0
mark = 1.0
control = 1.0
control_z = 1.0
gnss = 1.0
gnss_z = 1.0

[[effect]]
id = "drift"
held = ["rate", "shift[first]"]
[effect.values]
"rate" = 3.0
"shift[a]b]" = 2.0
"shift[second flight]" = 1e-300

[[prior]]
camera = "cam"
parameter = "b1"
value = 0.0
sigma = 1e-9
"#;
    assert_eq!(written(&model), expected);
}

#[test]
fn what_is_absent_is_the_default_and_groups_are_known() {
    assert_eq!(content(&read("format = 1\n").unwrap()), content(&Model::default()));
    let model = read("format = 1\nfree = [\"pp\", \"k1\"]\n").unwrap();
    let mut free = [false; 12];
    [1, 2, 5].into_iter().for_each(|index| free[index] = true);
    assert_eq!(model.free, free);
    assert_eq!(read("format = 1\nfree = [\"none\"]\n").unwrap().free, [false; 12]);
}

#[test]
fn every_fault_is_named() {
    let cases = [
        ("", "model.toml:1:1: key format is missing in model.toml"),
        ("format = 3", "model.toml:1:10: key format: expected 1, the one this program reads, found 3"),
        ("format = 1\nfree = \"all\"", "model.toml:2:8: key free: expected a list of texts, found \"all\""),
        ("format = 1\nfree = [\"f\", 1]", "model.toml:2:14: key free: expected a text in quotes, found 1"),
        (
            "format = 1\nfree = [\"k1\", \"k4\"]",
            "model.toml:2:15: unknown parameter \"k4\"; did you mean \"k1\" or \"k2\" or \"k3\"?",
        ),
        ("format = 1\nfree = [\"radail\"]", "model.toml:2:9: unknown parameter \"radail\"; did you mean \"radial\"?"),
        ("format = 1\ntie = \"pp=dc\"", "model.toml:2:7: key tie: expected dc=pp, found \"pp=dc\""),
        (
            "format = 1\ndatum = \"gps\"",
            "model.toml:2:9: key datum: expected one of free, control, gnss, all, found \"gps\"",
        ),
        ("format = 1\nloss = \"l2\"", "model.toml:2:8: key loss: expected one of none, huber, cauchy, found \"l2\""),
        ("format = 1\ntie_weights = 1", "model.toml:2:15: key tie_weights: expected a text in quotes, found 1"),
        ("format = 1\nlos = \"none\"", "model.toml:2:1: unknown key \"los\" in model.toml; did you mean \"loss\"?"),
        (
            "format = 1\n[camera.cam]\nfocal = 1.0",
            "model.toml:3:1: unknown key \"focal\" in [camera.cam]; known: \"f\", \"ppx\", \"ppy\", \"dcx\", \"dcy\", \
             \"k1\", \"k2\", \"k3\", \"p1\", \"p2\", \"b1\", \"b2\"",
        ),
        ("format = 1\n[camera.cam]\nf = \"1.0\"", "model.toml:3:5: key f: expected a finite number, found \"1.0\""),
        ("format = 1\n[camera.cam]\nf = -5510.0", "model.toml:3:5: key f: expected a number above zero, found -5510.0"),
        (
            "format = 1\n[sigma_factors]\nimage = 2.0\ngnss = -1",
            "model.toml:4:8: key gnss: expected a number above zero, found -1",
        ),
        (
            "format = 1\n[sigma_factors.flight.first]\ncontrol = 2.0",
            "model.toml:3:1: unknown key \"control\" in [sigma_factors.flight.first]; known: \"image\", \"gnss\", \
             \"gnss_z\"",
        ),
        ("format = 1\n[camera]\nf = 1.0", "model.toml:3:5: key f: expected a table, found 1.0"),
        ("format = 1\n[[effect]]\nheld = []", "model.toml:2:1: key id is missing in [[effect]]"),
        (
            "format = 1\n[[effect]]\nid = \"drfit\"",
            "model.toml:3:6: unknown effect \"drfit\"; `misclosure effects` lists those built in, one of a plug-in \
             needs --plugin FILE.so",
        ),
        (
            "format = 1\n[[effect]]\nid = \"drift\"\nvalue = {}",
            "model.toml:4:1: unknown key \"value\" in [[effect]]; did you mean \"values\"?",
        ),
        (
            "format = 1\n[[effect]]\nid = \"drift\"\nvalues = { rat = 1.0 }",
            "model.toml:4:12: effect drift has no parameter \"rat\"; did you mean \"rate\"?",
        ),
        (
            "format = 1\n[[effect]]\nid = \"drift\"\nvalues = { rate = nan }",
            "model.toml:4:19: key rate: expected a finite number, found nan",
        ),
        (
            "format = 1\n[[effect]]\nid = \"drift\"\nvalues = { \"rate[f1]\" = 1 }",
            "model.toml:4:12: effect drift has no parameter \"rate[f1]\"; \"rate\" alone, or name[element] where there \
             is a value per element",
        ),
        (
            "format = 1\n[[effect]]\nid = \"drift\"\nheld = [\"shift[]\"]",
            "model.toml:4:9: effect drift has no parameter \"shift[]\"; \"shift\" alone, or name[element] where there \
             is a value per element",
        ),
        (
            "format = 1\n[[prior]]\ncamera = \"cam\"\nparameter = \"f\"\nvalue = 1.0",
            "model.toml:2:1: key sigma is missing in [[prior]]",
        ),
        (
            "format = 1\n[[prior]]\ncamera = \"cam\"\nparameter = \"g\"\nvalue = 1.0\nsigma = 1.0",
            "model.toml:4:13: key parameter: expected one of f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2, found \
             \"g\"",
        ),
        (
            "format = 1\n[[prior]]\ncamera = \"cam\"\nparameter = \"f\"\nvalue = 1.0\nsigma = 0",
            "model.toml:6:9: key sigma: expected a number above zero, found 0",
        ),
    ];
    let mut wrong = Vec::new();
    for (text, expected) in cases {
        let found = read(text).map_or_else(|message| message, |_| "read without an error".to_owned());
        if found != expected {
            wrong.push(format!("{text:?}\n  expected {expected}\n  found    {found}"));
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_missing_file_and_a_number_that_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    let missing = read_model(&path, &effect).unwrap_err().to_string();
    let expected =
        format!("{}: the file is missing; a run folder has the model of its run as model.toml", path.display());
    assert_eq!(missing, expected);
    let mut model = full();
    model.priors[0].value = f64::NAN;
    let refused = write_model(&model, &path).unwrap_err().to_string();
    assert_eq!(refused, format!("{}: NaN cannot be written; it is not a number to read", path.display()));
    assert!(!path.exists());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_models_do_not_panic(
        damages in prop::collection::vec(
            (any::<prop::sample::Index>(), 0..3u8, prop::sample::select(b"\",\n\r=[]{}#.-e09 \\\xff\x00nai".to_vec())),
            1..6,
        ),
    ) {
        let mut content = written(&full()).into_bytes();
        for (at, kind, byte) in damages {
            let at = at.index(content.len());
            match kind {
                0 => content[at] = byte,
                1 => drop(content.remove(at)),
                _ => content.insert(at, byte),
            }
        }
        if let Err(message) = read(content) {
            prop_assert!(message.starts_with("model.toml:"), "{}", message);
        }
    }
}
