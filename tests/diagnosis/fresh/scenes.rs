//! Blocks to put causes into: the presets of the simulator, of sizes that are diagnosed in seconds.

use misclosure::inject::Random;
use misclosure::scenario::preset_text;
use toml::{Table, Value};

/// Which preset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Four flights along a dike, one of them oblique.
    Dike,
    /// Nadir strips and cross strips over an area.
    Mapping,
    /// Convergent, rolled images of targets.
    CloseRange,
}

/// A scenario of one kind with a size of its own.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Which preset.
    pub kind: Kind,
    scenario: Table,
}

/// Check points: enough for an RMS that two models can be compared by.
const CHECK_POINTS: i64 = 200;

impl Scene {
    /// Any kind, any size.
    pub fn draw(random: &mut Random) -> Self {
        let kind = [Kind::Dike, Kind::Mapping, Kind::CloseRange][random.index(3)];
        let preset = match kind {
            Kind::Dike => "dike",
            Kind::Mapping => "mapping",
            Kind::CloseRange => "closerange",
        };
        let text = preset_text(preset).unwrap_or_else(|| panic!("no preset `{preset}`"));
        let mut scene = Self { kind, scenario: toml::from_str(text).expect("a preset is TOML") };
        // A tie point has some six images from the air and most of them on a test field.
        let points = match kind {
            Kind::Dike => random.uniform(1500.0, 4000.0),
            Kind::Mapping => random.uniform(1500.0, 3500.0),
            Kind::CloseRange => random.uniform(250.0, 400.0),
        };
        scene.set("ties.count", Value::Integer(points as i64));
        if kind == Kind::CloseRange {
            scene.set("ring.0.images", Value::Integer(12 + random.index(14) as i64));
            scene.set("ring.1.images", Value::Integer(8 + random.index(8) as i64));
        } else {
            scene.set("surveyed.check.count", Value::Integer(CHECK_POINTS));
        }
        scene
    }

    /// As a scenario's file.
    pub fn text(&self) -> String {
        toml::to_string(&self.scenario).expect("a table is TOML")
    }

    /// Number of flights, or of rings.
    pub fn flights(&self) -> usize {
        ["flight", "ring"].iter().filter_map(|list| self.scenario.get(*list)?.as_array()).map(Vec::len).sum()
    }

    /// Width and height of the sensor, px.
    pub fn sensor_px(&self) -> [f64; 2] {
        ["width_px", "height_px"].map(|key| self.scenario["camera"][0][key].as_integer().expect("a size") as f64)
    }

    /// Sets a value by its dotted path; numbers index arrays.
    fn set(&mut self, path: &str, value: Value) {
        let (first, rest) = path.split_once('.').expect("a dotted path");
        let mut node = &mut self.scenario[first];
        for name in rest.split('.') {
            node = match name.parse::<usize>() {
                Ok(index) => &mut node[index],
                Err(_) => &mut node[name],
            };
        }
        *node = value;
    }
}
