//! Requests and their answers, as [`super::api`] says.

use super::about;
use super::answers::{Answer, bad, blocking, body, embedded, unknown};
use super::asked::Asked;
use super::change::Change;
use super::figures::{NAMES, draw};
use super::guard::Refusal;
use super::measurements::{Page, measurements};
use super::node::Absent;
use super::state::Lab;
use super::{candidates, commands, points, predict, simulated, space, truth};
use axum::extract::{Path, Query, State};
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_SECURITY_POLICY, CONTENT_TYPE};
use axum::http::{StatusCode, Uri};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;
use tokio_stream::wrappers::BroadcastStream;
use tokio_stream::{Stream, StreamExt};

type App = State<Arc<Lab>>;
type Parameters = Query<HashMap<String, String>>;

/// Rows of a page of measurements at most.
const MOST_ROWS: usize = 10_000;
/// Between two signs of life of the stream of events.
const ALIVE: Duration = Duration::from_secs(10);

/// Every route.
pub(super) fn all(lab: Arc<Lab>) -> Router {
    Router::new()
        .route("/api/tree", get(tree))
        .route("/api/longest", get(longest))
        .route("/api/block", get(block))
        .route("/api/events", get(events))
        .route("/api/steps", post(add))
        .route("/api/steps/{id}/cancel", post(cancel))
        .route("/api/steps/{id}/dismiss", post(dismiss))
        .route("/api/nodes/{id}/figures/{name}", get(figure))
        .route("/api/nodes/{id}/predicted/{effect}", get(prediction))
        .route("/api/nodes/{id}/predicted/{effect}/figures/{name}", get(predicted_figure))
        .route("/api/nodes/{id}/{what}", get(node))
        .route("/api/photos/{name}", get(photo))
        .route("/api/causes", get(causes))
        .route("/api/simulate", post(simulate))
        .route("/api/truth/{id}", get(truth))
        .fallback(file)
        .with_state(lab)
}

impl From<Absent> for Refusal {
    fn from(absent: Absent) -> Self {
        let status = match absent {
            Absent::NoNode(_) => StatusCode::NOT_FOUND,
            Absent::NotDone(_) => StatusCode::CONFLICT,
        };
        Refusal::new(status, absent.to_string())
    }
}

impl From<anyhow::Error> for Refusal {
    fn from(error: anyhow::Error) -> Self {
        if let Some(absent) = error.downcast_ref::<Absent>() {
            return (*absent).into();
        }
        let of_disk = error.chain().any(|cause| cause.is::<std::io::Error>() || cause.is::<crate::io::Error>());
        let status = if of_disk { StatusCode::INTERNAL_SERVER_ERROR } else { StatusCode::BAD_REQUEST };
        Refusal::new(status, format!("{error:#}"))
    }
}

fn number(text: &str) -> Result<u32, Refusal> {
    text.parse().map_err(|_| unknown(format!("step {text:?}: expected a whole number")))
}

async fn file(uri: Uri) -> Answer {
    embedded(uri.path(), "/index.html")
}

async fn tree(State(lab): App) -> Answer {
    Ok(Json(about::tree(&lab)).into_response())
}

async fn longest(State(lab): App) -> Answer {
    blocking(lab, |lab| Ok(Json(lab.longest_of_steps()?).into_response())).await
}

async fn block(State(lab): App) -> Answer {
    blocking(lab, |lab| Ok(Json(about::block(lab)).into_response())).await
}

async fn events(State(lab): App) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    let tree = || Event::default().event("tree").data("{}");
    let stream = BroadcastStream::new(lab.listen()).map(move |event| {
        // Whoever was too slow asks for the tree again.
        let Ok(event) = event else { return Ok(tree()) };
        Ok(Event::default().event(event.name()).data(json!(event).to_string()))
    });
    Sse::new(stream).keep_alive(KeepAlive::new().interval(ALIVE))
}

/// A step that is asked for.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Wanted {
    parent: u32,
    change: Change,
}

async fn add(State(lab): App, text: String) -> Answer {
    let Wanted { parent, change } = body(&text)?;
    if matches!(change, Change::Base | Change::Simulate { .. }) {
        return Err(bad(format!("{}: this is no step that could be asked for", change.words())));
    }
    if let Change::Add { effect, .. } = &change
        && !effect.starts_with("free:")
        && lab.effect(effect).is_none()
    {
        return Err(bad(format!("there is no effect {effect:?} in the catalogue")));
    }
    let id = lab.post(Some(parent), change)?;
    Ok((StatusCode::ACCEPTED, Json(json!({ "id": id }))).into_response())
}

async fn cancel(State(lab): App, Path(id): Path<String>) -> Answer {
    lab.cancel(number(&id)?)?;
    Ok(Json(json!({})).into_response())
}

async fn dismiss(State(lab): App, Path(id): Path<String>) -> Answer {
    lab.dismiss(number(&id)?)?;
    Ok(Json(json!({})).into_response())
}

fn figure_name(name: &str) -> Result<String, Refusal> {
    let known = name.strip_suffix(".svg").filter(|name| NAMES.contains(name));
    let expected =
        || unknown(format!("there is no figure {name:?}; expected NAME.svg, NAME one of {}", NAMES.join(", ")));
    known.map(String::from).ok_or_else(expected)
}

fn svg(text: String) -> Response {
    ([(CONTENT_TYPE, "image/svg+xml")], text).into_response()
}

async fn figure(State(lab): App, Path((id, name)): Path<(String, String)>, Query(query): Parameters) -> Answer {
    let (id, name, asked) = (number(&id)?, figure_name(&name)?, Asked::read(&query).map_err(bad)?);
    blocking(lab, move |lab| Ok(svg(draw(lab, id, &name, None, &asked)?))).await
}

async fn predicted_figure(
    State(lab): App,
    Path((id, effect, name)): Path<(String, String, String)>,
    Query(query): Parameters,
) -> Answer {
    let (id, name, asked) = (number(&id)?, figure_name(&name)?, Asked::read(&query).map_err(bad)?);
    blocking(lab, move |lab| Ok(svg(draw(lab, id, &name, Some(&effect), &asked)?))).await
}

async fn prediction(State(lab): App, Path((id, effect)): Path<(String, String)>) -> Answer {
    let id = number(&id)?;
    blocking(lab, move |lab| {
        let found = predict::predicted(lab, id, &effect)?;
        let before = lab.saved(id)?.figures;
        let after = super::tree::Figures {
            tie_rms_px: Some(found.tie_rms_px),
            check_rms_m: found.check_rms_m,
            gnss_rms_m: found.gnss_rms_m,
            ..Default::default()
        };
        let words = super::figures::difference(&before, &after);
        Ok(Json(json!({
            "effect": effect, "tie_rms_px": found.tie_rms_px, "check_rms_m": found.check_rms_m, "words": words,
        }))
        .into_response())
    })
    .await
}

async fn node(State(lab): App, Path((id, what)): Path<(String, String)>, Query(query): Parameters) -> Answer {
    let id = number(&id)?;
    let page = Page {
        brush: Asked::read(&query).map_err(bad)?.brush,
        offset: count(&query, "offset", 0)?,
        limit: count(&query, "limit", 100)?.min(MOST_ROWS),
        by_size: query.get("sort").is_none_or(|sort| sort != "image"),
    };
    blocking(lab, move |lab| {
        let json = |value: Value| Json(value).into_response();
        Ok(match what.as_str() {
            "measurements" => json(measurements(lab, id, &page)?),
            "model" => json(about::model(lab, id)?),
            "candidates" => json(candidates::candidates(lab, id)?),
            "points" => json(points::points(lab, id)?),
            "commands" => json(commands::commands(lab, id)?),
            "space" => {
                let bytes = space::space(lab, id, page.brush.as_ref())?;
                ([(CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
            }
            "report.html" | "model.toml" | "outliers.csv" => of_folder(lab, id, &what)?,
            other => return Err(unknown(format!("a step has no {other:?}"))),
        })
    })
    .await
}

fn count(query: &HashMap<String, String>, key: &str, default: usize) -> Result<usize, Refusal> {
    let read = |text: &String| text.parse().map_err(|_| bad(format!("{key}={text}: expected a whole number from 0")));
    query.get(key).map_or(Ok(default), read)
}

/// A file of the folder of a step, one of those that the route names.
fn of_folder(lab: &Lab, id: u32, name: &str) -> Answer {
    lab.saved(id)?;
    let path = lab.setup.folder.step(id).join(name);
    let bytes = crate::files::read(&path)
        .map_err(|error| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, format!("{}: {error}", path.display())))?;
    Ok(match name {
        // One file without any script: nothing but its own style applies.
        "report.html" => {
            let policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'";
            let headers = [(CONTENT_TYPE, "text/html; charset=utf-8"), (CONTENT_SECURITY_POLICY, policy)];
            (headers, bytes).into_response()
        }
        _ => {
            let disposition = format!("attachment; filename=\"step-{id:04}-{name}\"");
            let headers = [(CONTENT_TYPE, "text/plain; charset=utf-8".to_string()), (CONTENT_DISPOSITION, disposition)];
            (headers, bytes).into_response()
        }
    })
}

/// The file of an image, which is named as in the block.
async fn photo(State(lab): App, Path(name): Path<String>) -> Answer {
    blocking(lab, move |lab| {
        let photos = lab.setup.photos.as_ref();
        let photos = photos.ok_or_else(|| unknown("the laboratory was not opened with --images"))?;
        let image = lab.setup.block.images.iter().position(|image| image.name == name);
        let image = image.ok_or_else(|| unknown(format!("the block has no image {name:?}")))?;
        let (content_type, bytes) =
            photos.read(image)?.ok_or_else(|| unknown(format!("the folder of images has no file of {name:?}")))?;
        Ok(([(CONTENT_TYPE, content_type)], bytes).into_response())
    })
    .await
}

async fn causes(State(lab): App) -> Answer {
    let simulated = lab.setup.simulated.as_ref();
    let simulated = simulated.ok_or_else(|| unknown("the laboratory was not opened with --simulate"))?;
    Ok(Json(simulated::causes(simulated)).into_response())
}

/// A block that is to be measured anew.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Measure {
    errors: Vec<String>,
    #[serde(default = "first_seed")]
    seed: u64,
}

fn first_seed() -> u64 {
    1
}

async fn simulate(State(lab): App, text: String) -> Answer {
    let Measure { errors, seed } = body(&text)?;
    blocking(lab, move |lab| {
        let simulated = lab.setup.simulated.as_ref();
        let simulated = simulated.ok_or_else(|| unknown("the laboratory was not opened with --simulate"))?;
        simulated.check(&errors, seed).map_err(|refused| bad(format!("{refused:#}")))?;
        let id = lab.post(None, Change::Simulate { errors, seed })?;
        Ok((StatusCode::ACCEPTED, Json(json!({ "id": id }))).into_response())
    })
    .await
}

async fn truth(State(lab): App, Path(id): Path<String>) -> Answer {
    let id = number(&id)?;
    blocking(lab, move |lab| Ok(Json(truth::truth(lab, id)?).into_response())).await
}
