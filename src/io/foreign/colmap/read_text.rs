//! The text form: lines of words; an image has two, of which the second may be empty.

use super::super::super::error::Error;
use super::super::text::{Line, Lines};
use super::cameras::ModelCamera;
use super::model::{Model, model};
use std::path::Path;

pub(super) fn read(folder: &Path) -> Result<Model, Error> {
    let mut gathered = Model::default();
    cameras(&mut Lines::open(&folder.join("cameras.txt"))?, &mut gathered)?;
    points(&mut Lines::open(&folder.join("points3D.txt"))?, &mut gathered)?;
    images(&mut Lines::open(&folder.join("images.txt"))?, &mut gathered)?;
    let rigs = folder.join("rigs.txt");
    if rigs.exists() {
        self::rigs(&mut Lines::open(&rigs)?, &mut gathered)?;
    }
    Ok(gathered)
}

fn cameras(lines: &mut Lines, gathered: &mut Model) -> Result<(), Error> {
    while let Some(mut line) = lines.next_words()? {
        let id = line.whole("the id of a camera")?;
        let name = line.word("a camera model")?;
        let model = model(|model| model.name == name, name).map_err(|problem| line.refuse(problem))?;
        let size = [line.whole("a width")?, line.whole("a height")?];
        let mut parameters = Vec::with_capacity(model.parameters);
        while !line.is_empty() {
            parameters.push(line.number("a parameter of the camera")?);
        }
        if parameters.len() != model.parameters {
            let problem = format!("{name} has {} parameters, found {}", model.parameters, parameters.len());
            return Err(line.refuse(problem));
        }
        gathered.add_camera(id, ModelCamera { model, parameters }, size).map_err(|problem| line.refuse(problem))?;
    }
    Ok(())
}

fn points(lines: &mut Lines, gathered: &mut Model) -> Result<(), Error> {
    while let Some(mut line) = lines.next_words()? {
        let id = line.whole("the id of a point")?;
        let position = line.numbers("a coordinate")?;
        // After the colour; an image and a place in it for each measurement follow, which the images have too.
        let mut rest = line.rest().split_whitespace().skip(3);
        let error = rest.next().and_then(|error| error.parse().ok());
        gathered.add_point(id, position, error, rest.count() / 2);
    }
    gathered.end_of_points().map_err(|problem| lines.refuse(problem))
}

fn images(lines: &mut Lines, gathered: &mut Model) -> Result<(), Error> {
    while let Some(mut line) = lines.next_words()? {
        let _: u32 = line.whole("the id of an image")?;
        let (q, t) = (line.numbers("a component of a quaternion")?, line.numbers("a component of a translation")?);
        let camera = line.whole("the id of a camera")?;
        // To the end of the line: a name may have blanks.
        let image = gathered.add_image(q, t, camera, line.rest()).map_err(|problem| line.refuse(problem))?;
        let Some(mut line) = lines.next_line()? else {
            return Err(lines.refuse("the file ends where the second line of an image should stand"));
        };
        while !line.is_empty() {
            let xy = line.numbers("an image coordinate")?;
            if let Some(point) = point_of(&mut line)? {
                gathered.add_measurement(image, point, xy);
            }
        }
    }
    Ok(())
}

/// The point of an image point; `None` where it has none.
fn point_of(line: &mut Line<'_>) -> Result<Option<u64>, Error> {
    let id: i64 = line.whole("the id of a point")?;
    match u64::try_from(id) {
        Ok(id) => Ok(Some(id)),
        Err(_) if id == -1 => Ok(None),
        Err(_) => Err(line.refuse(format!("expected the id of a point, or -1 for none, found {id}"))),
    }
}

fn rigs(lines: &mut Lines, gathered: &mut Model) -> Result<(), Error> {
    while let Some(mut line) = lines.next_words()? {
        let _: u32 = line.whole("the id of a rig")?;
        let sensors: u32 = line.whole("the number of sensors")?;
        gathered.rigs += usize::from(sensors > 1);
    }
    Ok(())
}
