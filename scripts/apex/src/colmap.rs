//! COLMAP's text model: what an adjustment needs of it, read and written back.

use anyhow::{Context, Result};
use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3};
use std::collections::HashMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::str::FromStr;

/// A camera; its parameters are those of COLMAP's model of that name.
pub struct Camera {
    id: u32,
    pub model: String,
    size: [u32; 2],
    pub params: Vec<f64>,
}

/// An image: its pose takes world to camera, z forward. A mark is a measurement, px, of a point: its place in
/// `Model::points`.
pub struct Image {
    id: u32,
    pub rotation: UnitQuaternion<f64>,
    pub translation: Vector3<f64>,
    pub camera: usize,
    pub marks: Vec<(Vector2<f64>, usize)>,
    name: String,
    mark_line: String,
}

/// A point; colour, error and track are handed on as they stand.
pub struct Point {
    id: u64,
    pub position: Vector3<f64>,
    rest: String,
}

pub struct Model {
    pub cameras: Vec<Camera>,
    pub images: Vec<Image>,
    pub points: Vec<Point>,
}

/// The fields of one line, and where they stand.
struct Fields<'a> {
    place: String,
    fields: std::str::SplitWhitespace<'a>,
}

impl<'a> Fields<'a> {
    fn text(&mut self, what: &str) -> Result<&'a str> {
        self.fields.next().with_context(|| format!("{}: expected {what}, found the end of the line", self.place))
    }

    fn next<T: FromStr>(&mut self, what: &str) -> Result<T> {
        let text = self.text(what)?;
        text.parse().ok().with_context(|| format!("{}: expected {what}, found `{text}`", self.place))
    }

    fn vector(&mut self, what: &str) -> Result<Vector3<f64>> {
        Ok(Vector3::new(self.next(what)?, self.next(what)?, self.next(what)?))
    }

    fn rest(self) -> Vec<&'a str> {
        self.fields.collect()
    }
}

fn text_of(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("{}: cannot read", path.display()))
}

/// The lines that are no comment. An empty one counts: an image without measurements has one.
fn lines<'a>(text: &'a str, path: &Path) -> impl Iterator<Item = (&'a str, Fields<'a>)> {
    let place = path.display().to_string();
    text.lines()
        .enumerate()
        .filter(|(_, line)| !line.starts_with('#'))
        .map(move |(k, line)| (line, Fields { place: format!("{place}:{}", k + 1), fields: line.split_whitespace() }))
}

/// Marks of one image: x, y and a point's number each.
fn marks_of(mut fields: Fields, point_of: &HashMap<u64, usize>) -> Result<Vec<(Vector2<f64>, usize)>> {
    let mut marks = Vec::new();
    while let Some(x) = fields.fields.next() {
        let x = x.parse().ok().with_context(|| format!("{}: expected x, found `{x}`", fields.place))?;
        let observed = Vector2::new(x, fields.next("y")?);
        let number = fields.next("a point's number")?;
        let point = *point_of.get(&number).with_context(|| format!("{}: no point {number}", fields.place))?;
        marks.push((observed, point));
    }
    Ok(marks)
}

impl Model {
    pub fn read(folder: &Path) -> Result<Model> {
        let path = folder.join("cameras.txt");
        let text = text_of(&path)?;
        let (mut cameras, mut camera_of) = (Vec::new(), HashMap::new());
        for (_, mut fields) in lines(&text, &path) {
            let id = fields.next("a camera's number")?;
            let model = fields.text("a camera model")?.to_owned();
            let size = [fields.next("a width")?, fields.next("a height")?];
            let place = fields.place.clone();
            let params = fields.rest().into_iter().map(|text| {
                text.parse()
                    .ok()
                    .with_context(|| format!("{place}: expected a parameter of the camera, found `{text}`"))
            });
            camera_of.insert(id, cameras.len());
            cameras.push(Camera { id, model, size, params: params.collect::<Result<_>>()? });
        }

        let path = folder.join("points3D.txt");
        let text = text_of(&path)?;
        let (mut points, mut point_of) = (Vec::new(), HashMap::new());
        for (_, mut fields) in lines(&text, &path) {
            let id: u64 = fields.next("a point's number")?;
            let position = fields.vector("a coordinate")?;
            point_of.insert(id, points.len());
            points.push(Point { id, position, rest: fields.rest().join(" ") });
        }

        let path = folder.join("images.txt");
        let text = text_of(&path)?;
        let mut images = Vec::new();
        let mut lines = lines(&text, &path);
        while let Some((_, mut fields)) = lines.next() {
            let id = fields.next("an image's number")?;
            let w = fields.next("a quaternion")?;
            let quaternion = Quaternion::from_parts(w, fields.vector("a quaternion")?);
            let translation = fields.vector("a translation")?;
            let number: u32 = fields.next("a camera's number")?;
            let camera = *camera_of.get(&number).with_context(|| format!("{}: no camera {number}", fields.place))?;
            let name = fields.text("a name")?.to_owned();
            let (mark_line, marks) = lines.next().with_context(|| format!("{}: no line of marks", fields.place))?;
            let marks = marks_of(marks, &point_of)?;
            let rotation = UnitQuaternion::from_quaternion(quaternion);
            images.push(Image { id, rotation, translation, camera, marks, name, mark_line: mark_line.to_owned() });
        }
        Ok(Model { cameras, images, points })
    }

    pub fn write(&self, folder: &Path) -> Result<()> {
        fs::create_dir_all(folder).with_context(|| format!("{}: cannot make the folder", folder.display()))?;
        let (mut cameras, mut images, mut points) = (String::new(), String::new(), String::new());
        for Camera { id, model, size: [width, height], params } in &self.cameras {
            let params: Vec<String> = params.iter().map(f64::to_string).collect();
            writeln!(cameras, "{id} {model} {width} {height} {}", params.join(" "))?;
        }
        for image in &self.images {
            let (q, t) = (image.rotation.quaternion(), image.translation);
            let camera = self.cameras[image.camera].id;
            write!(images, "{} {} {} {} {} {} {} {}", image.id, q.w, q.i, q.j, q.k, t.x, t.y, t.z)?;
            writeln!(images, " {camera} {}\n{}", image.name, image.mark_line)?;
        }
        for Point { id, position, rest } in &self.points {
            writeln!(points, "{id} {} {} {} {rest}", position.x, position.y, position.z)?;
        }
        for (name, text) in [("cameras.txt", cameras), ("images.txt", images), ("points3D.txt", points)] {
            let path = folder.join(name);
            fs::write(&path, text).with_context(|| format!("{}: cannot write", path.display()))?;
        }
        Ok(())
    }
}
