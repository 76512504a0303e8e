//! A brush: which measurements were chosen in a figure. The figures of a node mark the same ones.

use super::columns::Columns;
use super::quantity::{Component, Quantity};
use serde::{Deserialize, Serialize};

/// One choice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "view", rename_all = "snake_case", deny_unknown_fields)]
pub enum Choice {
    /// A part of a sensor, in all images of the camera.
    Sensor {
        /// Position of the camera.
        camera: u32,
        /// From and to, px.
        x: [f64; 2],
        /// See `x`.
        y: [f64; 2],
    },
    /// A part of one image.
    Image {
        /// Position of the image.
        image: u32,
        /// From and to, px.
        x: [f64; 2],
        /// See `x`.
        y: [f64; 2],
    },
    /// Whole images: by name of their positions, or from one to another.
    Images {
        /// Positions.
        #[serde(default)]
        ids: Vec<u32>,
        /// First and last, counted from one as the axis of the figure does.
        #[serde(default)]
        range: Option<[f64; 2]>,
    },
    /// A range of a recorded quantity.
    Profile {
        /// The quantity.
        against: Quantity,
        /// From and to.
        range: [f64; 2],
    },
    /// Measurements of the points in a rectangle, coordinates of the survey.
    Plan {
        /// East, from and to, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        e: Option<[f64; 2]>,
        /// North, from and to, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        n: Option<[f64; 2]>,
    },
    /// Measurements in images taken in a rectangle, coordinates of the survey.
    Flights {
        /// East, from and to, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        e: Option<[f64; 2]>,
        /// North, from and to, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        n: Option<[f64; 2]>,
    },
    /// Measurements of the points in a rectangle of the picture in space.
    Space {
        /// From metres about the block's origin to the picture, column by column: clip coordinates, as graphics
        /// libraries have them.
        matrix: [f64; 16],
        /// From and to, from -1 at the left edge of the picture to 1 at the right.
        x: [f64; 2],
        /// From and to, from -1 at the lower edge of the picture to 1 at the upper.
        y: [f64; 2],
    },
    /// A range of a component of the residual.
    Histogram {
        /// The component.
        #[serde(default = "either")]
        component: Component,
        /// From and to, px.
        range: [f64; 2],
    },
}

fn either() -> Component {
    Component::X
}

/// One choice, or the intersection of several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Brush {
    /// One.
    One(Choice),
    /// All of them.
    All(Vec<Choice>),
}

impl Brush {
    /// Reads the text of a query.
    ///
    /// # Errors
    /// Says what a brush is.
    pub fn parse(text: &str) -> Result<Self, String> {
        // The choice alone says what is wrong of it.
        let read = match text.trim_start().starts_with('[') {
            true => serde_json::from_str(text).map(Brush::All),
            false => serde_json::from_str(text).map(Brush::One),
        };
        read.map_err(|error| {
            format!(
                "brush {text:?}: {error}; expected an object such as {{\"view\":\"images\",\"ids\":[0]}}, or a list"
            )
        })
    }

    /// Which of the measurements are chosen.
    pub fn members(&self, columns: &Columns) -> Vec<bool> {
        let choices = match self {
            Brush::One(choice) => std::slice::from_ref(choice),
            Brush::All(choices) => choices,
        };
        let mut chosen = vec![true; columns.len()];
        for choice in choices {
            choice.keep(columns, &mut chosen);
        }
        chosen
    }
}

fn within(value: f64, range: [f64; 2]) -> bool {
    let [low, high] = [range[0].min(range[1]), range[0].max(range[1])];
    (low..=high).contains(&value)
}

/// [`within`], where there is a range.
fn beside(value: f64, range: Option<[f64; 2]>) -> bool {
    range.is_none_or(|range| within(value, range))
}

/// Where a place (m about the block's origin) lies in the picture of a camera; `None` behind the camera.
fn in_picture(matrix: &[f64; 16], [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    let row = |i: usize| matrix[i] * x + matrix[4 + i] * y + matrix[8 + i] * z + matrix[12 + i];
    let depth = row(3);
    (depth > 0.0).then(|| [row(0) / depth, row(1) / depth])
}

impl Choice {
    /// Leaves those that are in this choice, too.
    fn keep(&self, columns: &Columns, chosen: &mut [bool]) {
        let mut keep = |test: &dyn Fn(usize) -> bool| {
            for (k, chosen) in chosen.iter_mut().enumerate().filter(|(_, chosen)| **chosen) {
                *chosen = test(k);
            }
        };
        let image = |k: usize| columns.image[k] as usize;
        let at = |k: usize, x: [f64; 2], y: [f64; 2]| {
            within(f64::from(columns.x[k]), x) && within(f64::from(columns.y[k]), y)
        };
        // A choice of images is one of a table: what holds for an image holds for all its measurements.
        let of_images = |test: &dyn Fn(usize) -> bool| -> Vec<bool> { (0..columns.images.len()).map(test).collect() };
        match self {
            Choice::Sensor { camera, x, y } => {
                keep(&|k| columns.images[image(k)].camera == *camera && at(k, *x, *y));
            }
            Choice::Image { image: own, x, y } => keep(&|k| columns.image[k] == *own && at(k, *x, *y)),
            Choice::Images { ids, range } => {
                let number = |i: usize| i as f64 + 1.0;
                let inside = |i: usize| range.is_some_and(|[a, b]| within(number(i), [a.min(b) - 0.4, a.max(b) + 0.4]));
                let table = of_images(&|i| ids.contains(&(i as u32)) || inside(i));
                keep(&|k| table[image(k)]);
            }
            Choice::Profile { against, range } => keep(&|k| within(columns.value(*against, k), *range)),
            Choice::Plan { e, n } => {
                let [east, north] = [0, 1].map(|axis| columns.origin[axis]);
                keep(&|k| {
                    let [x, y, _] = columns.place(k);
                    beside(x + east, *e) && beside(y + north, *n)
                });
            }
            Choice::Space { matrix, x, y } => {
                keep(&|k| {
                    let at = in_picture(matrix, columns.place(k));
                    at.is_some_and(|[right, up]| within(right, *x) && within(up, *y))
                });
            }
            Choice::Flights { e, n } => {
                let table = of_images(&|i| {
                    let centre = columns.images[i].centre;
                    beside(centre[0] + columns.origin[0], *e) && beside(centre[1] + columns.origin[1], *n)
                });
                keep(&|k| table[image(k)]);
            }
            Choice::Histogram { component, range } => keep(&|k| within(columns.component(*component, k), *range)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_in_the_picture_where_it_lies_before_the_camera() {
        // A camera at (0, 0, 10) that looks down, with half a field of view of 45 degrees: right is x, up is y, depth
        // 10 - z.
        let mut matrix = [0.0; 16];
        (matrix[0], matrix[5], matrix[11], matrix[15]) = (1.0, 1.0, -1.0, 10.0);
        assert_eq!(in_picture(&matrix, [5.0, -10.0, 0.0]), Some([0.5, -1.0]));
        assert_eq!(in_picture(&matrix, [5.0, -10.0, 20.0]), None);
    }

    #[test]
    fn a_brush_is_an_object_or_a_list_and_anything_else_is_named() {
        let one = Brush::parse(r#"{"view":"images","ids":[0,5]}"#).expect("a brush");
        assert_eq!(one, Brush::One(Choice::Images { ids: vec![0, 5], range: None }));
        let two = r#"[{"view":"profile","against":"time","range":[1,2]},{"view":"plan","e":[0,1],"n":[0,1]}]"#;
        assert!(matches!(Brush::parse(two), Ok(Brush::All(list)) if list.len() == 2));
        let error = Brush::parse(r#"{"view":"sensor","camera":0}"#).expect_err("no range");
        assert!(error.contains("missing field `x`"), "{error}");
        let error = Brush::parse(r#"{"view":"moon"}"#).expect_err("no view");
        assert!(error.contains("unknown variant `moon`"), "{error}");
    }
}
