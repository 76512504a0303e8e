//! The picture of a block.

use misclosure::block::{Block, Image, Role};
use misclosure::report::figures::{FlightPlan, MapFrame, Station, flights_plan_profile};

/// Images and surveyed points in plan and from the side, SVG.
pub fn plan_and_profile(block: &Block) -> String {
    let of_role = |role: Role| block.surveyed.iter().filter(move |point| point.role == role);
    let places = |role: Role| of_role(role).map(|point| point.position.into()).collect();
    let station = |image: &Image| Station {
        position_m: image.pose.centre.into(),
        flight: image.flight.index(),
        name: image.name.clone(),
        ..Station::default()
    };
    flights_plan_profile(&FlightPlan {
        title: format!("Block {}: projection centres, control and check points", block.name),
        images: block.images.iter().map(station).collect(),
        control_m: places(Role::Control),
        control_names: of_role(Role::Control).map(|point| point.name.clone()).collect(),
        check_m: places(Role::Check),
        frame: MapFrame::Local,
        flights: block.flights.clone(),
        width: None,
    })
}
