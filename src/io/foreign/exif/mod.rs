//! What the images themselves say, in EXIF and XMP: time, position, exposure, velocity, temperature.

mod contradictions;
mod tags;
mod time;

use super::super::error::Error;
use super::fill::{ImagesByName, Recorded, fill};
use super::{Addition, ImportOptions, Note, refuse};
use crate::block::{Block, FlightId, ImageId};
use contradictions::Said;
use std::path::{Path, PathBuf};
use tags::Tags;

/// A pause between two images that is longer (s) is a landing: batteries are changed in minutes, turns flown in
/// seconds.
const LANDING_S: f64 = 300.0;
/// Kinds of files that have EXIF.
const EXTENSIONS: [&str; 9] = ["jpg", "jpeg", "tif", "tiff", "dng", "heic", "heif", "png", "webp"];

/// Images that a note names.
const NAMED: usize = 3;

/// The addition.
pub struct ExifAddition;

impl Addition for ExifAddition {
    fn name(&self) -> &'static str {
        "exif"
    }

    fn about(&self) -> &'static str {
        "EXIF and XMP of the images: times, positions, exposure, velocity, temperature; flights by pauses"
    }

    fn changes(&self) -> &'static [&'static str] {
        &["images.csv", "block.toml"]
    }

    fn add(&self, block: &mut Block, paths: &[PathBuf], _: &ImportOptions) -> Result<Vec<Note>, Error> {
        let mut notes = Vec::new();
        let mut read: Vec<(ImageId, Tags)> = Vec::new();
        let (mut strange, mut silent) = (0, 0);
        let (mut damaged, mut unreadable): (Vec<String>, Vec<Error>) = (Vec::new(), Vec::new());
        let images = ImagesByName::of(block);
        for path in files(paths)? {
            let name = path.to_string_lossy().into_owned();
            match images.find(&name) {
                None => strange += 1,
                Some(id) => match tags::read(&path) {
                    Ok(Some(tags)) => {
                        damaged.extend(tags.damage.as_ref().map(|damage| format!("{name}: {damage}")));
                        read.push((id, tags));
                    }
                    Ok(None) => silent += 1,
                    Err(error) => unreadable.push(error),
                },
            }
        }
        if read.is_empty() {
            if let Some(first) = unreadable.into_iter().next() {
                return Err(first);
            }
            return Err(refuse(&paths[0], "no file with EXIF or XMP is an image of the block"));
        }
        for (count, what) in
            [(strange, "files are no images of the block"), (silent, "images have neither EXIF nor XMP")]
        {
            if count > 0 {
                notes.push(Note::loss(format!("{count} {what}: left out")));
            }
        }
        let unreadable: Vec<String> = unreadable.iter().map(ToString::to_string).collect();
        for (images, what) in [
            (unreadable, "cannot be read and are left out"),
            (damaged, "have damaged EXIF; the intact entries were read"),
        ] {
            if !images.is_empty() {
                notes.push(Note::loss(format!("{} images {what}: {}", images.len(), first_few(&images))));
            }
        }
        let said: Vec<Said> = read.iter().map(|(_, tags)| tags.said).collect();
        notes.extend(contradictions::notes(&said));
        let recorded = in_one_zone(read, &mut notes);
        if recorded.iter().any(|(_, recorded)| recorded.place.is_some()) {
            notes.push(Note::guess(
                "heights of the images are taken as they are; what they stand on (ellipsoid or geoid) their files do \
                 not say reliably",
            ));
        }
        let had_times = block.images.iter().any(|image| image.time_s.is_some());
        fill(block, &recorded, &mut notes).map_err(|problem| refuse(&paths[0], problem))?;
        if !had_times && block.flights.len() == 1 {
            split_flights(block, &mut notes);
        }
        Ok(notes)
    }
}

/// Some of a list, and how many more there are.
fn first_few(list: &[String]) -> String {
    let named = list[..list.len().min(NAMED)].join("; ");
    match list.len().saturating_sub(NAMED) {
        0 => named,
        more => format!("{named}; and {more} more"),
    }
}

/// Files that are named, and those of folders, by name.
fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let failed = |source| Error::Read { path: path.clone(), source };
        for entry in std::fs::read_dir(path).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if has_exif(&path) {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

fn has_exif(path: &Path) -> bool {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    extension.is_some_and(|extension| EXTENSIONS.contains(&extension.as_str()))
}

/// Times in UTC where every image says how far its clock is from it, else as the clock has them: never a mixture.
fn in_one_zone(read: Vec<(ImageId, Tags)>, notes: &mut Vec<Note>) -> Vec<(ImageId, Recorded)> {
    let is_known = read.iter().all(|(_, tags)| tags.offset_s.is_some());
    if !is_known && read.iter().any(|(_, tags)| tags.recorded.time_s.is_some()) {
        notes.push(Note::guess("not all images say how far their clock is from UTC: times are those of one clock"));
    }
    let shift = |(id, tags): (ImageId, Tags)| {
        let mut recorded = tags.recorded;
        if let (true, Some(time), Some(offset)) = (is_known, &mut recorded.time_s, tags.offset_s) {
            *time -= offset;
        }
        (id, recorded)
    };
    read.into_iter().map(shift).collect()
}

/// A flight ends where the camera pauses.
fn split_flights(block: &mut Block, notes: &mut Vec<Note>) {
    let mut timed: Vec<(f64, usize)> =
        block.images.iter().enumerate().filter_map(|(k, image)| Some((image.time_s?, k))).collect();
    if timed.len() < block.images.len() {
        return;
    }
    timed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut flight = 0;
    let mut before = timed.first().map_or(0.0, |(time, _)| *time);
    for (time, k) in timed {
        flight += u32::from(time - before > LANDING_S);
        before = time;
        block.images[k].flight = FlightId(flight);
    }
    if flight > 0 {
        let name = block.flights[0].clone();
        block.flights = (0..=flight).map(|k| format!("{name}-{}", k + 1)).collect();
        let text = format!("{} flights, between which the camera paused for more than {LANDING_S} s", flight + 1);
        notes.push(Note::guess(text));
    }
}
