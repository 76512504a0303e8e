//! A wrong convention in sentences, with its edits.

use super::cause::{Cause, Table};
use super::compete::Found;
use super::scene::Scope;
use crate::mistakes::Mistake;

/// One mistake for each cause of what was found. `tables`: files of measurements that share the convention.
pub fn mistakes(found: &Found, scope: &Scope<'_>, table: Table, tables: &[&str]) -> Vec<Mistake> {
    found.alternative.causes.iter().map(|cause| mistake(*cause, found, scope, table, tables)).collect()
}

fn mistake(cause: Cause, found: &Found, scope: &Scope<'_>, table: Table, tables: &[&str]) -> Mistake {
    let [subject, kind] = cause.kind(table);
    let [says, remedy] = cause.words();
    let mut sentence = format!("{}: {says}. {}", who(cause, scope, table), evidence(found, table));
    let mut place = if let Cause::Coordinates(_) = cause { format!(" ({})", tables.join(", ")) } else { String::new() };
    if !found.rivals.is_empty() {
        sentence += &format!(" The rays fit as well where {}.", rivals(found));
        place += "; first make sure which it is";
    }
    let alone = found.rivals.is_empty();
    let edits = if alone { cause.edits(scope, tables) } else { Vec::new() };
    let made = Mistake::new(kind, subject, sentence, format!("{remedy}{place}."))
        .of(names(subject, scope))
        // The median over points falls by an order of magnitude: no chance reaches that.
        .tested(f64::NAN, f64::NEG_INFINITY)
        .undone_by(edits);
    match cause.value(scope) {
        Some((value, unit)) => made.sized(value, None, unit),
        None => made,
    }
}

/// Cameras or images concerned; none where all are.
fn names(subject: &str, scope: &Scope<'_>) -> Vec<String> {
    if scope.is_everything() {
        return Vec::new();
    }
    match subject {
        "camera" => scope.cameras().into_iter().map(|camera| scope.scene.cameras[camera].id.clone()).collect(),
        _ => scope.cameras().into_iter().flat_map(|camera| scope.images(camera)).collect(),
    }
}

fn who(cause: Cause, scope: &Scope<'_>, table: Table) -> String {
    let who = match (cause, table) {
        (Cause::Orientation(_), _) => "Approximate orientation",
        (Cause::Coordinates(_), Table::Ties) => "Tie points",
        (Cause::Coordinates(_), Table::Marks) => "Marks",
        (Cause::Lens(_), _) => "Camera",
    };
    match scope.camera.filter(|_| !scope.is_everything()) {
        Some(camera) => format!("{who} ({})", scope.scene.cameras[camera].id),
        None => who.into(),
    }
}

fn evidence(found: &Found, table: Table) -> String {
    let points = match table {
        Table::Ties => "tie points",
        Table::Marks => "surveyed points",
    };
    let (own, undone) = (&found.own, &found.undone);
    if found.alternative.is_unit {
        return format!("Once that is undone, rays of {points} meet to {} (median).", pixels(undone.px));
    }
    format!(
        "Once that is undone, rays of {points} meet to {} instead of {} (median of the reprojection error).",
        pixels(undone.px),
        pixels(own.px)
    )
}

fn pixels(px: f64) -> String {
    match px {
        px if px < 10.0 => format!("{px:.1} px"),
        px => format!("{px:.0} px"),
    }
}

/// Alternatives that are listed.
const LISTED: usize = 3;

fn rivals(found: &Found) -> String {
    let of = |causes: &[Cause]| causes.iter().map(|cause| cause.words()[0].clone()).collect::<Vec<_>>().join(" and ");
    let list: Vec<String> = found.rivals.iter().take(LISTED).map(|one| of(&one.causes)).collect();
    list.join(", or where ")
}
