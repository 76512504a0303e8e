//! Which files of a MicMac project hold what: by the element that each XML file begins with.

use super::super::super::error::{Error, shown};
use super::super::xml::{self, Element};
use super::super::{Note, refuse};
use super::calibration::{self, Calibration};
use super::orientation::{self, Orientation, stem};
use super::survey::{self, Mark};
use super::ties::{file_name, sorted};
use crate::block::SurveyedPoint;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const ORIENTATION: &str = "Orientation-";

/// Everything that the files say.
#[derive(Default)]
pub(super) struct Sources {
    /// By name of the file.
    pub calibrations: BTreeMap<String, Calibration>,
    /// By image, with the file.
    pub orientations: BTreeMap<String, (PathBuf, Orientation)>,
    pub points: Vec<SurveyedPoint>,
    pub marks: Vec<Mark>,
    /// Files of multiple tie points.
    pub multiple: Vec<PathBuf>,
    /// Folders of pairs.
    pub pairs: Vec<PathBuf>,
    /// Folder that the orientations came from.
    orientation_folder: Option<PathBuf>,
}

impl Sources {
    pub(super) fn read(paths: &[PathBuf], notes: &mut Vec<Note>) -> Result<Self, Error> {
        let mut sources = Self::default();
        for path in paths {
            match path.is_dir() {
                true => sources.take_folder(path, true, notes)?,
                false => sources.take_file(path, true, notes)?,
            }
        }
        Ok(sources)
    }

    /// A folder of orientations or ties, or a project that has some.
    fn take_folder(&mut self, folder: &Path, is_outer: bool, notes: &mut Vec<Note>) -> Result<(), Error> {
        let has_name = |path: &Path, start: &str| file_name(path).is_some_and(|name| name.starts_with(start));
        if has_name(folder, "Homol") {
            let inside = sorted(folder)?;
            let multiple: Vec<PathBuf> = inside.into_iter().filter(|path| is_multiple(path)).collect();
            match multiple.is_empty() {
                true => self.pairs.push(folder.to_owned()),
                false => self.multiple.extend(multiple),
            }
            return Ok(());
        }
        for path in sorted(folder)? {
            if path.is_dir() {
                if is_outer && (has_name(&path, "Ori-") || has_name(&path, "Homol")) {
                    self.take_folder(&path, false, notes)?;
                }
            } else if is_multiple(&path) || path.extension().is_some_and(|extension| extension == "xml") {
                self.take_file(&path, false, notes)?;
            }
        }
        Ok(())
    }

    fn take_file(&mut self, path: &Path, is_named: bool, notes: &mut Vec<Note>) -> Result<(), Error> {
        if is_multiple(path) {
            self.multiple.push(path.to_owned());
            return Ok(());
        }
        let file = path.display().to_string();
        let text =
            super::super::super::read_text(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        let document = xml::parse(&file, &text)?;
        let root = Element::root(&file, &document);
        let name = stem(file_name(path).unwrap_or_default());
        let mut is_known = false;
        for element in [root].into_iter().chain(root.elements()).chain(root.elements().flat_map(Element::elements)) {
            is_known |= self.take(element, path, name)?;
        }
        match is_known || !is_named {
            true if is_known => {}
            true => notes.push(Note::detail(format!("{file}: nothing of it is read"))),
            false => {
                let found = shown(root.name().as_bytes());
                return Err(
                    root.refuse(format!("expected an orientation, a calibration, points or marks, found {found}"))
                );
            }
        }
        Ok(())
    }

    /// Takes an element that says something by itself; false for any other.
    fn take(&mut self, element: Element<'_>, path: &Path, name: &str) -> Result<bool, Error> {
        match element.name() {
            "CalibrationInternConique" => {
                self.calibrations.insert(name.to_owned(), calibration::first_version(element)?);
            }
            "InternalCalibration" => {
                self.calibrations.insert(name.to_owned(), calibration::second_version(element)?);
            }
            "OrientationConique" => {
                let image = name.strip_prefix(ORIENTATION).ok_or_else(|| {
                    element.refuse(format!("expected a file {ORIENTATION}IMAGE.xml: its name is the image's"))
                })?;
                self.take_orientation(element, path, image.to_owned(), orientation::first_version(element)?)?;
            }
            "CameraPose" => {
                let (image, orientation) = orientation::second_version(element)?;
                self.take_orientation(element, path, image, orientation)?;
            }
            "DicoAppuisFlottant" => {
                for point in element.children("OneAppuisDAF") {
                    self.take_point(point, survey::point(point)?)?;
                }
            }
            "SetGCP" => {
                for point in element.child("Measures")?.children("el") {
                    self.take_point(point, survey::second_point(point)?)?;
                }
            }
            "SetOfMesureAppuisFlottants" => {
                for image in element.children("MesureAppuiFlottant1Im") {
                    self.marks.extend(survey::marks(image)?);
                }
            }
            "SetMesIm" => self.marks.extend(survey::second_marks(element)?),
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn take_orientation(
        &mut self,
        element: Element<'_>,
        path: &Path,
        image: String,
        orientation: Orientation,
    ) -> Result<(), Error> {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let first = self.orientation_folder.get_or_insert(folder.clone());
        if *first != folder || self.orientations.contains_key(&image) {
            let problem = format!("image {image} is oriented here, and others in {}: name one folder", first.display());
            return Err(element.refuse(problem));
        }
        self.orientations.insert(image, (path.to_owned(), orientation));
        Ok(())
    }

    fn take_point(&mut self, element: Element<'_>, point: SurveyedPoint) -> Result<(), Error> {
        if self.points.iter().any(|other| other.name == point.name) {
            let problem =
                format!("point {} has coordinates twice; name one file of points", shown(point.name.as_bytes()));
            return Err(element.refuse(problem));
        }
        self.points.push(point);
        Ok(())
    }
}

fn is_multiple(path: &Path) -> bool {
    let has_extension = path.extension().is_some_and(|extension| extension == "txt" || extension == "dat");
    has_extension && file_name(path).is_some_and(|name| name.starts_with("PMul"))
}

/// Is this a project of MicMac's, or a part of one? By names alone.
pub(super) fn recognises(path: &Path) -> bool {
    let is_oriented = |folder: &Path| {
        let names = sorted(folder).unwrap_or_default();
        let has = |start: &str| names.iter().any(|path| file_name(path).is_some_and(|name| name.starts_with(start)));
        has(ORIENTATION) || has("Ori-PerspCentral-")
    };
    let inner = sorted(path).unwrap_or_default();
    let is_orientation = |folder: &&PathBuf| file_name(folder).is_some_and(|name| name.starts_with("Ori-"));
    is_oriented(path) || inner.iter().filter(is_orientation).any(|folder| is_oriented(folder))
}

/// The camera of an orientation.
pub(super) fn calibration_of<'a>(
    sources: &'a Sources,
    path: &Path,
    orientation: &Orientation,
) -> Result<&'a Calibration, Error> {
    sources.calibrations.get(&orientation.calibration).ok_or_else(|| {
        let name = &orientation.calibration;
        refuse(path, format!("names the calibration {name}, which is not among the files; put {name}.xml beside it"))
    })
}
