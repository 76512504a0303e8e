//! A problem as `suite.json` states it.

use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::Path;

/// What is estimated of a camera, and how residuals count.
pub struct Entry {
    pub focal_length: bool,
    pub principal_point: bool,
    pub distortion: bool,
    /// Scale of Cauchy's loss, px; `None` in least squares.
    pub cauchy: Option<f64>,
}

/// Reads the problem `name` of a suite, one that COLMAP can express.
pub fn read(suite: &Path, name: &str) -> Result<Entry> {
    let path = suite.join("suite.json");
    let text = std::fs::read_to_string(&path).with_context(|| format!("{}: cannot read", path.display()))?;
    let suite: Value = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    let entry = suite["problems"].as_array().and_then(|all| all.iter().find(|entry| entry["name"] == name));
    let entry = entry.with_context(|| format!("{}: no problem `{name}`", path.display()))?;
    let expected = |key: &str, what: &str| format!("{}: `{key}` of `{name}`: expected {what}", path.display());
    let refine = |key: &str| entry["colmap"][key].as_bool().with_context(|| expected(key, "true or false"));
    let cauchy = match entry["loss"].as_str() {
        Some("none") => None,
        Some("cauchy") => Some(entry["loss_scale_px"].as_f64().with_context(|| expected("loss_scale_px", "a number"))?),
        _ => bail!(expected("loss", "`none` or `cauchy`")),
    };
    Ok(Entry {
        focal_length: refine("refine_focal_length")?,
        principal_point: refine("refine_principal_point")?,
        distortion: refine("refine_extra_params")?,
        cauchy,
    })
}
