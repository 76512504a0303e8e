//! How requests are answered, by whichever page they come from.

use super::assets::asset;
use super::guard::Refusal;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use serde::de::DeserializeOwned;
use std::sync::Arc;

pub(super) type Answer = Result<Response, Refusal>;

pub(super) fn bad(text: impl Into<String>) -> Refusal {
    Refusal::new(StatusCode::BAD_REQUEST, text)
}

pub(super) fn unknown(text: impl Into<String>) -> Refusal {
    Refusal::new(StatusCode::NOT_FOUND, text)
}

/// Has a thread that may take its time do the work.
pub(super) async fn blocking<S: Send + Sync + 'static, T: Send + 'static>(
    state: Arc<S>,
    work: impl FnOnce(&S) -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let failed =
        |_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "internal error, described where the program runs");
    tokio::task::spawn_blocking(move || work(&state)).await.map_err(failed)?
}

pub(super) fn body<T: DeserializeOwned>(text: &str) -> Result<T, Refusal> {
    serde_json::from_str(text).map_err(|error| bad(format!("the body of the request: {error}")))
}

/// A file of the page; `front` is what stands at `/`.
pub(super) fn embedded(path: &str, front: &str) -> Answer {
    let found = asset(if path == "/" { front } else { path });
    let found = found.ok_or_else(|| unknown(format!("there is nothing at {path:?}")))?;
    Ok(([(CONTENT_TYPE, found.content_type)], found.bytes).into_response())
}
