//! What a query asks of a figure.

use super::brush::Brush;
use super::quantity::{Component, Quantity};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::json;
use std::collections::HashMap;

/// What is shown of the GNSS positions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GnssShown {
    /// Residuals in plan.
    #[default]
    Plan,
    /// Residuals in height.
    Height,
    /// Residuals against time.
    Time,
    /// Residuals against the heading.
    Heading,
}

/// What is asked of a figure.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// What stands out.
    pub brush: Option<Brush>,
    /// Figure pixels per unit of the arrows.
    pub scale: Option<f64>,
    /// Length of the longest arrow, in the unit of the figure; it sets the scale if `scale` is not given.
    pub longest: Option<f64>,
    /// Range of the vertical axis at least.
    pub y: Option<[f64; 2]>,
    /// Position of the camera.
    pub camera: usize,
    /// Position of the image.
    pub image: usize,
    /// Quantity of the profile.
    pub against: Option<Quantity>,
    /// Components of the profile.
    pub components: Vec<Component>,
    /// `check` or `control`; check points where there are any.
    pub role: Option<String>,
    /// What is shown of the GNSS positions.
    pub show: GnssShown,
    /// Width of the drawing, px.
    pub width: Option<f64>,
}

impl Asked {
    /// Reads the parameters of a query.
    ///
    /// # Errors
    /// Names the parameter, what it is, and what was expected.
    pub fn read(query: &HashMap<String, String>) -> Result<Self, String> {
        let query = Parameters(query);
        let y = match query.get("y").map(|text| (text, text.split_once(','))) {
            Some((_, Some((low, high)))) => Some([real("y", low)?, real("y", high)?]),
            Some((text, None)) => return Err(format!("y={text}: expected two numbers, as -1,1")),
            None => None,
        };
        let components = query.get("component").map_or(Vec::new(), |text| text.split(',').collect());
        let role = query.get("role").map(String::from);
        if let Some(role) = role.as_ref().filter(|role| !["check", "control"].contains(&role.as_str())) {
            return Err(format!("role={role}: expected check or control"));
        }
        Ok(Self {
            brush: query.get("brush").map(Brush::parse).transpose()?,
            scale: query.above_zero("scale")?,
            longest: query.above_zero("longest")?,
            width: query.above_zero("width")?,
            y,
            camera: query.whole("camera")?,
            image: query.whole("image")?,
            against: query.get("against").map(|text| word("against", text)).transpose()?,
            components: components.into_iter().map(|text| word("component", text)).collect::<Result<_, _>>()?,
            role,
            show: query.get("show").map(|text| word("show", text)).transpose()?.unwrap_or_default(),
        })
    }
}

/// The parameters of a query; an empty one is none.
struct Parameters<'a>(&'a HashMap<String, String>);

impl Parameters<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str).filter(|text| !text.is_empty())
    }

    fn whole(&self, key: &str) -> Result<usize, String> {
        let read = |text: &str| text.parse().map_err(|_| format!("{key}={text}: expected a whole number from 0"));
        self.get(key).map_or(Ok(0), read)
    }

    fn above_zero(&self, key: &str) -> Result<Option<f64>, String> {
        let number = self.get(key).map(|text| real(key, text)).transpose()?;
        match number.filter(|number| *number <= 0.0) {
            Some(number) => Err(format!("{key}={number}: expected a number above 0")),
            None => Ok(number),
        }
    }
}

fn real(key: &str, text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("{key}={text}: expected a number"))
}

/// One of the names of a type.
fn word<T: DeserializeOwned>(key: &str, text: &str) -> Result<T, String> {
    serde_json::from_value(json!(text)).map_err(|error| format!("{key}={text}: {error}"))
}
