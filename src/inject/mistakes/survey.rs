//! A whole list of positions in another unit, another order, another height system, another place.

use super::group::{Group, OF, SUBJECTS, axis, axis_of, of};
use super::*;

/// m.
const FOOT: f64 = 0.3048;
/// m: 39.37 inches are a metre.
const US_SURVEY_FOOT: f64 = 1200.0 / 3937.0;
/// Length of a degree of latitude on a sphere of 6371 km, m.
const DEGREE_M: f64 = 111_195.0;
/// Degrees: near the poles the meridians meet.
const LARGEST_LATITUDE: f64 = 85.0;

const UNITS: &[&str] = &["feet", "us-feet", "mm", "cm", "km"];
const UNIT: ParameterSpec = parameter("unit", "", DefaultValue::Choice("feet", UNITS), "given instead of metres");
const FACTOR: ParameterSpec =
    parameter("factor", "", DefaultValue::Optional("that of the unit"), "factor on the numbers");

pub(super) static KINDS: [Kind; 11] = [
    Kind {
        id: "scale",
        subjects: SUBJECTS,
        summary: "coordinates in another unit",
        parameters: &[OF, UNIT, FACTOR],
        act: |files, values| {
            let factor = factor(values)?;
            Group::given(files, values)?.rewrite(|_, [x, y, z]| [factor * x, factor * y, factor * z])?;
            Ok(vec![note("factor", factor)])
        },
    },
    Kind {
        id: "height-scale",
        subjects: SUBJECTS,
        summary: "heights alone in another unit",
        parameters: &[OF, UNIT, FACTOR],
        act: |files, values| {
            let factor = factor(values)?;
            Group::given(files, values)?.rewrite(|_, [x, y, z]| [x, y, factor * z])?;
            Ok(vec![note("factor", factor)])
        },
    },
    Kind {
        id: "height-offset",
        subjects: SUBJECTS,
        summary: "heights of another system, as above the ellipsoid and above the geoid",
        parameters: &[of("gnss"), parameter("by", "m", DefaultValue::Number(47.3), "added to the heights")],
        act: |files, values| {
            let by = values.number("by");
            Group::given(files, values)?.rewrite(|_, [x, y, z]| [x, y, z + by])?;
            Ok(Vec::new())
        },
    },
    Kind {
        id: "plan-offset",
        subjects: SUBJECTS,
        summary: "coordinates shifted in plan",
        parameters: &[
            of("check"),
            parameter("x", "m", DefaultValue::Number(3.0), "shift"),
            parameter("y", "m", DefaultValue::Number(-2.0), "shift"),
        ],
        act: |files, values| shift(files, values, [values.number("x"), values.number("y"), 0.0]),
    },
    Kind {
        id: "rotation",
        subjects: SUBJECTS,
        summary: "a group turned about the vertical through its middle",
        parameters: &[OF, parameter("degrees", "deg", DefaultValue::Number(1.5), "anticlockwise, seen from above")],
        act: |files, values| turn(files, values, [0, 1]),
    },
    Kind {
        id: "tilt",
        subjects: SUBJECTS,
        summary: "a group tilted about the x axis through its middle",
        parameters: &[OF, parameter("degrees", "deg", DefaultValue::Number(0.5), "from y towards z")],
        act: |files, values| turn(files, values, [1, 2]),
    },
    Kind {
        id: "axes-exchanged",
        subjects: SUBJECTS,
        summary: "two columns of coordinates exchanged",
        parameters: &[OF, parameter("axes", "", DefaultValue::Choice("xy", &["xy", "xz", "yz"]), "the columns")],
        act: |files, values| {
            let (a, b) = match values.word("axes") {
                "xy" => (0, 1),
                "xz" => (0, 2),
                _ => (1, 2),
            };
            Group::given(files, values)?.rewrite(|_, mut position| {
                position.swap(a, b);
                position
            })?;
            Ok(Vec::new())
        },
    },
    Kind {
        id: "axis-reversed",
        subjects: SUBJECTS,
        summary: "one coordinate with the wrong sign",
        parameters: &[OF, axis("z")],
        act: |files, values| {
            let axis = axis_of(values);
            Group::given(files, values)?.rewrite(|_, mut position| {
                position[axis] = -position[axis];
                position
            })?;
            Ok(Vec::new())
        },
    },
    Kind {
        id: "geographic",
        subjects: SUBJECTS,
        summary: "degrees of latitude and longitude in place of metres",
        parameters: &[
            of("gnss"),
            parameter("latitude", "deg", DefaultValue::Number(48.0), "of the middle of the group"),
            parameter("longitude", "deg", DefaultValue::Number(11.0), "of the middle of the group"),
            parameter("first", "", DefaultValue::Choice("latitude", &["latitude", "longitude"]), "in the column x"),
        ],
        act: geographic,
    },
    Kind {
        id: "other-frame",
        subjects: SUBJECTS,
        summary: "coordinates of another system, far away",
        parameters: &[
            of("gnss"),
            parameter("x", "m", DefaultValue::Number(691_000.0), "shift"),
            parameter("y", "m", DefaultValue::Number(5_334_000.0), "shift"),
            parameter("z", "m", DefaultValue::Number(510.0), "shift"),
        ],
        act: |files, values| shift(files, values, ["x", "y", "z"].map(|name| values.number(name))),
    },
    Kind {
        id: "collapsed",
        subjects: SUBJECTS,
        summary: "many positions at one place, such as zeros for missing values",
        parameters: &[
            of("gnss"),
            parameter("every", "", DefaultValue::Number(9.0), "rows from one to the next; 1: all"),
            parameter("x", "m", DefaultValue::Number(0.0), "the place"),
            parameter("y", "m", DefaultValue::Number(0.0), "the place"),
            parameter("z", "m", DefaultValue::Number(0.0), "the place"),
        ],
        act: |files, values| {
            let every = whole(values, "every")?;
            let place = ["x", "y", "z"].map(|name| values.number(name));
            Group::given(files, values)?
                .rewrite(|member, position| if member % every == 0 { place } else { position })?;
            Ok(Vec::new())
        },
    },
];

/// A whole number of at least one.
pub(super) fn whole(values: &Values, name: &str) -> Result<usize> {
    let number = values.number(name);
    ensure!(number >= 1.0 && number.fract() == 0.0, "parameter `{name}` must be 1, 2, 3, ..., it is {number}");
    Ok(number as usize)
}

/// Factor on coordinates: as given, or of the unit.
fn factor(values: &Values) -> Result<f64> {
    if let Some(factor) = values.optional("factor") {
        ensure!(factor != 0.0, "parameter `factor` must not be 0");
        return Ok(factor);
    }
    let metres = match values.word("unit") {
        "feet" => FOOT,
        "us-feet" => US_SURVEY_FOOT,
        "mm" => 0.001,
        "cm" => 0.01,
        _ => 1000.0,
    };
    Ok(1.0 / metres)
}

fn shift(files: &mut Files, values: &Values, by: [f64; 3]) -> Result<Notes> {
    Group::given(files, values)?.rewrite(|_, [x, y, z]| [x + by[0], y + by[1], z + by[2]])?;
    Ok(Vec::new())
}

/// Turns a group from the first of two axes towards the second one, about its middle.
fn turn(files: &mut Files, values: &Values, [a, b]: [usize; 2]) -> Result<Notes> {
    let (sin, cos) = values.number("degrees").to_radians().sin_cos();
    let mut group = Group::given(files, values)?;
    let middle = group.mean()?;
    group.rewrite(|_, position| {
        let (da, db) = (position[a] - middle[a], position[b] - middle[b]);
        let mut turned = position;
        turned[a] = middle[a] + cos * da - sin * db;
        turned[b] = middle[b] + sin * da + cos * db;
        turned
    })?;
    Ok(Vec::new())
}

fn geographic(files: &mut Files, values: &Values) -> Result<Notes> {
    let (latitude, longitude) = (values.number("latitude"), values.number("longitude"));
    ensure!(
        latitude.abs() <= LARGEST_LATITUDE,
        "parameter `latitude` must lie within {LARGEST_LATITUDE} degrees of the equator, it is {latitude}"
    );
    let of_longitude = DEGREE_M * latitude.to_radians().cos();
    let mut group = Group::given(files, values)?;
    let [east, north, _] = group.mean()?;
    let latitude_first = values.word("first") == "latitude";
    group.rewrite(|_, [x, y, z]| {
        let (phi, lambda) = (latitude + (y - north) / DEGREE_M, longitude + (x - east) / of_longitude);
        if latitude_first { [phi, lambda, z] } else { [lambda, phi, z] }
    })?;
    Ok(Vec::new())
}
