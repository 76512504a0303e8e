//! The line that says where a report comes from.

use super::pictures::RunFolder;

/// Date, version, command, block, coordinate system and units of a run, as far as its folder tells.
pub(super) fn line(run: &RunFolder) -> String {
    let noted = &run.provenance;
    let written = noted.written.as_deref().map(|utc| utc.replace('T', " ").replace('Z', " UTC"));
    let version = noted.version.as_deref().map_or("misclosure".into(), |version| format!("misclosure {version}"));
    let crs = noted.crs.as_deref().map(|crs| match crs {
        "" => "coordinate system not stated".to_string(),
        crs => format!("coordinate system {crs}"),
    });
    let units = match run.summary.has_scale() {
        true => "coordinates in m, differences in mm, image measurements in px",
        false => "no scale: coordinates in the unit of the start values, image measurements in px",
    };
    let block = format!("block {}", run.summary.block);
    let parts = [written, Some(version), noted.command.clone(), Some(block), crs, Some(units.into())];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" · ")
}

/// The same for the foot of a printed page, where there is little room.
pub(super) fn short(run: &RunFolder) -> String {
    let noted = &run.provenance;
    let date = noted.written.as_deref().and_then(|utc| utc.get(..10)).map(String::from);
    let version = noted.version.as_deref().map_or("misclosure".into(), |version| format!("misclosure {version}"));
    let parts = [Some(format!("Block {}", run.summary.block)), date, Some(version), noted.crs.clone()];
    parts.into_iter().flatten().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" · ")
}
