//! ODM's `geo.txt`: the coordinate system, then of each image `name x y [z [yaw pitch roll [horizontal vertical
//! accuracy]]]`.

use super::super::error::Error;
use super::fill::{ImagesByName, Recorded, fill};
use super::text::Lines;
use super::{Addition, ImportOptions, Note, refuse};
use crate::block::Block;
use crate::geodesy::crs::Crs;
use crate::geodesy::geographic::stated_sigma;
use std::path::PathBuf;

/// The addition.
pub struct Geo;

impl Addition for Geo {
    fn name(&self) -> &'static str {
        "geo"
    }

    fn about(&self) -> &'static str {
        "ODM geo.txt: GNSS positions with standard deviations"
    }

    fn changes(&self) -> &'static [&'static str] {
        &["images.csv", "block.toml"]
    }

    fn add(&self, block: &mut Block, paths: &[PathBuf], _: &ImportOptions) -> Result<Vec<Note>, Error> {
        let mut notes = Vec::new();
        let mut recorded = Vec::new();
        let images = ImagesByName::of(block);
        let (mut strange, mut heightless) = (0, 0);
        for path in paths {
            let mut lines = Lines::open(path)?;
            let crs = {
                let line = lines.expect_words("the coordinate system")?;
                Crs::parse(line.text()).map_err(|problem| line.refuse(problem))?
            };
            while let Some(mut line) = lines.next_words()? {
                let name = line.word("the image")?.to_owned();
                let [x, y] = line.numbers("x and y")?;
                if line.is_empty() {
                    heightless += 1;
                    continue;
                }
                let height = line.number("z")?;
                let mut sigmas = [None; 2];
                if !line.is_empty() {
                    line.numbers::<3>("yaw, pitch, roll")?;
                    if !line.is_empty() {
                        let [horizontal, vertical] = line.numbers::<2>("horizontal and vertical accuracy")?;
                        let stated = |sigma: f64| stated_sigma(sigma).map_err(|problem| line.refuse(problem));
                        sigmas = [stated(horizontal)?, stated(vertical)?];
                    }
                }
                let nowhere = [x, y] == [0.0, 0.0];
                let place = crs.place([x, y, height]).map_err(|problem| line.refuse(problem));
                let place = if nowhere { None } else { Some(place?) };
                let [sigma_xy, sigma_z] = sigmas;
                match images.find(&name) {
                    Some(id) => {
                        recorded.push((id, Recorded { place, nowhere, sigma_xy, sigma_z, ..Recorded::default() }))
                    }
                    None => strange += 1,
                }
            }
        }
        for (count, what) in [(strange, "are no images of the block"), (heightless, "have no height")] {
            if count > 0 {
                notes.push(Note::loss(format!("{count} rows {what}: left out")));
            }
        }
        fill(block, &recorded, &mut notes).map_err(|problem| refuse(&paths[0], problem))?;
        Ok(notes)
    }
}
