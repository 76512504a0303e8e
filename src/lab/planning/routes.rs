//! Requests of a plan on sliders, and their answers.

use super::super::answers::{self, bad, blocking, body, embedded};
use super::{Planning, Turned};
use axum::extract::State;
use axum::http::Uri;
use axum::response::IntoResponse;
use axum::routing::{get, post};
use axum::{Json, Router};
use serde_json::json;
use std::sync::Arc;

type App = State<Arc<Planning>>;

/// Every route.
pub(in super::super) fn all(planning: Arc<Planning>) -> Router {
    Router::new().route("/api/dials", get(dials)).route("/api/plan", post(plan)).fallback(file).with_state(planning)
}

async fn file(uri: Uri) -> answers::Answer {
    embedded(uri.path(), "/plan.html")
}

async fn dials(State(planning): App) -> answers::Answer {
    let dials = planning.dials().map_err(|error| bad(error.to_string()))?;
    Ok(Json(json!({ "scenario": planning.name, "datum": planning.datum, "dials": dials })).into_response())
}

async fn plan(State(planning): App, text: String) -> answers::Answer {
    let turned: Turned = body(&text)?;
    let answer = move |planning: &Planning| planning.answer(&turned).map_err(|error| bad(format!("{error:#}")));
    Ok(Json(blocking(planning, answer).await?).into_response())
}
