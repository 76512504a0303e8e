//! A project's files, read into one chunk: which file holds what.

use super::super::super::error::{Error, Place, shown};
use super::super::xml::{self, Element};
use super::super::{Note, refuse};
use super::archive::Archive;
use super::document::{self, Chunk, Location, PointCloud};
use super::ply;
use std::path::{Path, PathBuf};

/// What a project says, and what its messages call it.
pub(super) struct Project {
    /// File in messages.
    pub file: String,
    /// Name of the block.
    pub name: String,
    pub chunk: Chunk,
    pub locations: Vec<Location>,
    /// Per image id: column, row (px) and track number.
    pub projections: Vec<(String, Vec<[f64; 3]>)>,
    /// Chunk coordinates and track number.
    pub points: Vec<[f64; 4]>,
}

pub(super) fn read(paths: &[PathBuf], notes: &mut Vec<Note>) -> Result<Project, Error> {
    let path = &paths[0];
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase()).unwrap_or_default();
    let project = match extension.to_str() {
        Some("psz") => psz(path, notes)?,
        Some("psx") => psx(path, notes)?,
        Some("xml") => return xml_files(paths),
        _ => return Err(refuse(path, "expected a .psz, a .psx or an .xml of Metashape")),
    };
    match &paths[1..] {
        [] => Ok(project),
        [more, ..] => Err(refuse(more, "a project holds everything; expected no other file beside it")),
    }
}

/// Is the file an XML of Metashape's? By its first bytes.
pub(super) fn is_document(path: &Path) -> bool {
    let mut start = [0; 512];
    let read = super::super::super::open(path).and_then(|mut file| std::io::Read::read(&mut file, &mut start));
    let start = String::from_utf8_lossy(&start[..read.unwrap_or(0)]).into_owned();
    start.contains("<document version=") && (start.contains("<chunk") || start.contains(".files/project.zip"))
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "metashape".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// The chunk of a list that was worked on last, else the first.
fn active<'a>(file: &str, root: Element<'a>, notes: &mut Vec<Note>) -> Result<Element<'a>, Error> {
    let list = root.optional("chunks").unwrap_or(root);
    let chunks: Vec<Element<'_>> = list.children("chunk").collect();
    let id = list.optional_attribute("active_id");
    let active = chunks.iter().find(|chunk| id.is_some() && chunk.optional_attribute("id") == id);
    let chunk = active.or(chunks.first()).ok_or_else(|| root.refuse("the project has no <chunk>"))?;
    if chunks.len() > 1 {
        let place = chunks.iter().position(|other| other.optional_attribute("id") == chunk.optional_attribute("id"));
        let number = place.unwrap_or_default() + 1;
        notes.push(Note::loss(format!("{file}: has {} chunks; chunk {number} is read", chunks.len())));
    }
    Ok(*chunk)
}

/// The first frame of a chunk.
fn frame<'a>(chunk: Element<'a>, notes: &mut Vec<Note>) -> Option<Element<'a>> {
    let frames: Vec<Element<'_>> = chunk.optional("frames")?.children("frame").collect();
    if frames.len() > 1 {
        notes.push(Note::loss(format!("the chunk has {} frames; the first one is read", frames.len())));
    }
    frames.first().copied()
}

fn psz(path: &Path, notes: &mut Vec<Note>) -> Result<Project, Error> {
    const DOCUMENT: &str = "doc.xml";
    let mut archive = Archive::open(path)?;
    let file = archive.name_of(DOCUMENT);
    let text = archive.text(DOCUMENT)?;
    let document = xml::parse(&file, &text)?;
    let chunk = active(&file, Element::root(&file, &document), notes)?;
    let frame = frame(chunk, notes);
    let cloud = frame.and_then(|frame| frame.optional("point_cloud").or_else(|| frame.optional("tie_points")));
    let cloud = cloud.map(document::point_cloud).transpose()?.unwrap_or_default();
    let mut project = Project {
        file: file.clone(),
        name: stem(path),
        chunk: document::chunk(chunk)?,
        locations: frame.map(document::locations).transpose()?.unwrap_or_default(),
        projections: Vec::new(),
        points: Vec::new(),
    };
    read_points(&mut project, &cloud, &mut archive)?;
    Ok(project)
}

fn psx(path: &Path, notes: &mut Vec<Note>) -> Result<Project, Error> {
    let pointer =
        super::super::super::read_text(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
    let file = path.display().to_string();
    let document = xml::parse(&file, &pointer)?;
    let target = Element::root(&file, &document).attribute("path")?.replace("{projectname}", &stem(path));
    let project_zip = path.with_file_name("").join(target);
    let chunk_zip = {
        let (file, text) = document_of(&project_zip)?;
        let document = xml::parse(&file, &text)?;
        beside(&project_zip, active(&file, Element::root(&file, &document), notes)?.attribute("path")?)
    };
    let (file, text) = document_of(&chunk_zip)?;
    let document = xml::parse(&file, &text)?;
    let chunk = Element::root(&file, &document);
    let mut project = Project {
        file: file.clone(),
        name: stem(path),
        chunk: document::chunk(chunk)?,
        locations: Vec::new(),
        projections: Vec::new(),
        points: Vec::new(),
    };
    let Some(frame) = frame(chunk, notes) else { return Ok(project) };
    let frame_zip = beside(&chunk_zip, frame.attribute("path")?);
    let (file, text) = document_of(&frame_zip)?;
    let document = xml::parse(&file, &text)?;
    let frame = Element::root(&file, &document);
    project.locations = document::locations(frame)?;
    let Some(cloud) = frame.optional("point_cloud").or_else(|| frame.optional("tie_points")) else {
        return Ok(project);
    };
    let cloud_zip = beside(&frame_zip, cloud.attribute("path")?);
    let mut archive = Archive::open(&cloud_zip)?;
    let (file, text) = document_of(&cloud_zip)?;
    let document = xml::parse(&file, &text)?;
    read_points(&mut project, &document::point_cloud(Element::root(&file, &document))?, &mut archive)?;
    Ok(project)
}

/// The document of a zip file of a project, and its name in messages.
fn document_of(zip: &Path) -> Result<(String, String), Error> {
    let mut archive = Archive::open(zip)?;
    Ok((archive.name_of("doc.xml"), archive.text("doc.xml")?))
}

fn beside(zip: &Path, path: &str) -> PathBuf {
    zip.with_file_name("").join(path)
}

fn read_points(project: &mut Project, cloud: &PointCloud, archive: &mut Archive) -> Result<(), Error> {
    for (photo, member) in &cloud.projections {
        let bytes = archive.bytes(member)?;
        let seen = ply::vertices(&archive.name_of(member), &bytes, ["x", "y", "id"])?;
        project.projections.push((photo.clone(), seen));
    }
    if let Some(member) = &cloud.points {
        let bytes = archive.bytes(member)?;
        project.points = ply::vertices(&archive.name_of(member), &bytes, ["x", "y", "z", "id"])?;
    }
    Ok(())
}

/// Cameras and markers as XML, in any order. Markers name images by label: ids are those of their own file.
fn xml_files(paths: &[PathBuf]) -> Result<Project, Error> {
    let mut project: Option<Project> = None;
    let mut markers: Option<(Chunk, Vec<Location>)> = None;
    for path in paths {
        let file = path.display().to_string();
        let text =
            super::super::super::read_text(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        let document = xml::parse(&file, &text)?;
        let root = Element::root(&file, &document);
        let element = active(&file, root, &mut Vec::new())?;
        let chunk = document::chunk(element)?;
        let frame = frame(element, &mut Vec::new());
        let locations = frame.map(document::locations).transpose()?.unwrap_or_default();
        let is_cameras = !chunk.sensors.is_empty();
        let twice = |what: &str| Error::content(&file, Place::File, format!("{what} stand in a file before; give one"));
        match (is_cameras, &project, &markers) {
            (true, Some(_), _) => return Err(twice("cameras")),
            (false, _, Some(_)) => return Err(twice("markers")),
            (true, ..) => {
                let (projections, points) = (Vec::new(), Vec::new());
                project = Some(Project { file, name: stem(path), chunk, locations, projections, points });
            }
            (false, ..) => markers = Some((chunk, locations)),
        }
    }
    let no_cameras = || refuse(&paths[0], "has no <sensors>: expected an export of cameras (Agisoft XML)");
    let mut project = project.ok_or_else(no_cameras)?;
    if let Some((chunk, locations)) = markers {
        take_markers(&mut project, chunk, locations)?;
    }
    Ok(project)
}

fn take_markers(project: &mut Project, chunk: Chunk, locations: Vec<Location>) -> Result<(), Error> {
    for mut location in locations {
        let label = chunk.photos.iter().find(|photo| photo.id == location.photo).map(|photo| photo.label.as_str());
        let own = label.and_then(|label| project.chunk.photos.iter().find(|photo| photo.label == label));
        let own = own.ok_or_else(|| {
            let name = shown(label.unwrap_or(&location.photo).as_bytes());
            let problem = format!("a marker was seen in image {name}, which this file does not have");
            Error::content(&project.file, Place::File, problem)
        })?;
        location.photo = own.id.clone();
        project.locations.push(location);
    }
    project.chunk.markers.extend(chunk.markers);
    project.chunk.wkt = project.chunk.wkt.take().or(chunk.wkt);
    for (name, accuracy) in chunk.accuracies {
        project.chunk.accuracies.entry(name).or_insert(accuracy);
    }
    Ok(())
}
