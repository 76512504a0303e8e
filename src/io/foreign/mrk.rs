//! DJI's `_Timestamp.MRK`: where and when each exposure was.
//!
//! ```text
//! number  s of the GPS week  [week]  dN,N  dE,E  dV,V  lat,Lat  lon,Lon  h,Ellh  sN, sE, sV  quality,Q
//! ```
//!
//! Separated by tabs. dN, dE, dV (mm; V is down) lead from the antenna to the sensor. Latitude, longitude and height
//! are those of the sensor: the receiver's position with that lever arm applied. Quality 50 is a fixed solution, 34 a
//! float one, 16 a single point, 0 none. Source: DJI, *PPK file description*.

use super::super::error::{Error, shown};
use super::fill::{Recorded, fill};
use super::text::{Line, Lines};
use super::{Addition, ImportOptions, Note, refuse};
use crate::block::{Block, ImageId};
use crate::geodesy::geographic::{Geographic, stated_sigma};
use std::path::{Path, PathBuf};

const SECONDS_OF_WEEK: f64 = 604_800.0;
/// Of a fixed solution.
const FIXED: &str = "50";
/// The receiver knew nothing.
const NO_SOLUTION: &str = "0";

/// The addition.
pub struct Mrk;

impl Addition for Mrk {
    fn name(&self) -> &'static str {
        "mrk"
    }

    fn about(&self) -> &'static str {
        "DJI _Timestamp.MRK: times, GNSS positions with standard deviations, lever arms"
    }

    fn changes(&self) -> &'static [&'static str] {
        &["images.csv", "block.toml"]
    }

    fn add(&self, block: &mut Block, paths: &[PathBuf], _: &ImportOptions) -> Result<Vec<Note>, Error> {
        let mut notes = Vec::new();
        let mut recorded = Vec::new();
        let (mut strange, mut loose) = (0, 0);
        for path in paths {
            let mut lines = Lines::open(path)?;
            while let Some(line) = lines.next_words()? {
                let (number, exposure) = exposure(line)?;
                loose +=
                    usize::from(exposure.extra.iter().any(|(name, cell)| *name == "gnss_quality" && cell != FIXED));
                match image(block, path, number).map_err(|problem| line.refuse(problem))? {
                    Some(id) => recorded.push((id, exposure)),
                    None => strange += 1,
                }
            }
        }
        if recorded.is_empty() {
            return Err(refuse(&paths[0], "none of its exposures is an image of the block"));
        }
        if strange > 0 {
            notes.push(Note::loss(format!("{strange} exposures are no images of the block: left out")));
        }
        if loose > 0 {
            notes.push(Note::fact(format!("{loose} exposures have no fixed solution; see the column gnss_quality")));
        }
        notes.push(Note::fact(
            "positions are those of the sensor, as DJI writes them: the lever arm is taken off already, and kept in \
             the columns lever_*_m",
        ));
        fill(block, &recorded, &mut notes).map_err(|problem| refuse(&paths[0], problem))?;
        Ok(notes)
    }
}

fn exposure(line: Line<'_>) -> Result<(u32, Recorded), Error> {
    let cells: Vec<&str> = line.text().split('\t').map(str::trim).filter(|cell| !cell.is_empty()).collect();
    let expected = || {
        line.refuse(
            "expected number, seconds, [week], dN,N dE,E dV,V lat,Lat lon,Lon h,Ellh, three sigmas, quality,Q, by tabs",
        )
    };
    let number = cells.first().and_then(|cell| cell.parse().ok()).ok_or_else(expected)?;
    let finite = |text: &str| text.trim().parse().ok().filter(|value: &f64| value.is_finite());
    let seconds = cells.get(1).and_then(|cell| finite(cell)).ok_or_else(expected)?;
    let week = cells.iter().find_map(|cell| finite(cell.strip_prefix('[')?.strip_suffix(']')?)).ok_or_else(expected)?;
    let marked = |mark: &str| {
        let value = cells.iter().find_map(|cell| cell.rsplit_once(',').filter(|(_, end)| end.trim() == mark));
        value.map(|(value, _)| value.trim()).ok_or_else(|| line.refuse(format!("has no value that ends with ,{mark}")))
    };
    let value = |mark: &str| {
        let text = marked(mark)?;
        finite(text).ok_or_else(|| line.refuse(format!("{mark}: expected a number, found {}", shown(text.as_bytes()))))
    };
    let sigmas = cells.iter().find_map(|cell| {
        let [n, e, v] = cell.split(',').map(finite).collect::<Option<Vec<f64>>>()?[..] else { return None };
        Some([n, e, v])
    });
    let [north, east, up] = sigmas.ok_or_else(expected)?;
    let lever = [("lever_e_m", value("E")?), ("lever_n_m", value("N")?), ("lever_u_m", -value("V")?)];
    let mut extra: Vec<(&'static str, String)> =
        lever.into_iter().map(|(name, mm)| (name, format!("{:?}", mm / 1000.0))).collect();
    extra.push(("gnss_quality", marked("Q")?.to_owned()));
    let stated = |sigma: f64| stated_sigma(sigma).map_err(|problem| line.refuse(problem));
    let horizontal = stated(north)?.zip(stated(east)?).map(|(n, e)| ((n * n + e * e) / 2.0).sqrt());
    let place = Geographic::checked(value("Lat")?, value("Lon")?, value("Ellh")?).map_err(|p| line.refuse(p))?;
    let place = place.filter(|_| marked("Q").is_ok_and(|quality| quality != NO_SOLUTION));
    let recorded = Recorded {
        time_s: Some(week * SECONDS_OF_WEEK + seconds),
        place,
        nowhere: place.is_none(),
        sigma_xy: horizontal,
        sigma_z: stated(up)?,
        extra,
        ..Recorded::default()
    };
    Ok((number, recorded))
}

/// The image of an exposure: the one with its number as a word of four digits. Of several, the one whose name begins as
/// that of the MRK file.
fn image(block: &Block, path: &Path, number: u32) -> Result<Option<ImageId>, String> {
    let word = format!("{number:04}");
    let file = |name: &str| name.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
    let numbered = |name: &str| {
        let name = file(name);
        let mut words =
            name.split(['_', '.', '-']).filter(|word| word.len() == 4 && word.bytes().all(|b| b.is_ascii_digit()));
        words.next_back() == Some(&word)
    };
    let found: Vec<usize> = (0..block.images.len()).filter(|k| numbered(&block.images[*k].name)).collect();
    let start = path.file_name().map(|name| name.to_string_lossy().replace("_Timestamp.MRK", "_")).unwrap_or_default();
    let own: Vec<usize> = found.iter().copied().filter(|k| file(&block.images[*k].name).starts_with(&start)).collect();
    match (&own[..], &found[..]) {
        ([one], _) | ([], [one]) => Ok(Some((*one).into())),
        ([], []) => Ok(None),
        _ => Err(format!("several images of the block have the number {word}; name the MRK file as their names begin")),
    }
}
