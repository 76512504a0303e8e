//! Who is answered: a page of this server in a browser on this machine, which has the token. A page of elsewhere may
//! send requests to 127.0.0.1, too, and by a name of its own may even read the answers; host, origin and token keep it
//! out.

use axum::Json;
use axum::extract::{Request, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HOST, ORIGIN, REFERRER_POLICY};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde_json::json;
use std::sync::Arc;

/// The header that carries the token.
pub const TOKEN: &str = "x-token";

/// Nothing from elsewhere, nothing inline.
const POLICY: &str = "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; form-action \
                      'none'; frame-ancestors 'none'";

/// Where the page is, and what its requests carry.
#[derive(Debug, Clone)]
pub struct Access {
    /// The port.
    pub port: u16,
    /// What a request of ours carries.
    pub token: String,
}

/// A refusal, or whatever else is no answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// Its status.
    pub status: StatusCode,
    /// Why, for people.
    pub text: String,
}

impl Refusal {
    /// A refusal.
    pub fn new(status: StatusCode, text: impl Into<String>) -> Self {
        Self { status, text: text.into() }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.status, Json(json!({ "error": self.text }))).into_response()
    }
}

/// Lets through what may be answered, and says to the browser what it may load.
pub async fn guard(State(access): State<Arc<Access>>, request: Request, next: Next) -> Response {
    let mut response = match admitted(&access, request.method(), request.uri(), request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    let headers = response.headers_mut();
    if !headers.contains_key(CONTENT_SECURITY_POLICY) {
        headers.insert(CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    }
    headers.insert(HeaderName::from_static("x-content-type-options"), HeaderValue::from_static("nosniff"));
    // The token stands in the address.
    headers.insert(REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

/// Is the request of our own page?
///
/// # Errors
/// Why not.
pub fn admitted(access: &Access, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<(), Refusal> {
    let own = [format!("127.0.0.1:{}", access.port), format!("localhost:{}", access.port)];
    let host = headers.get(HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    if !own.iter().any(|name| name == host) || headers.get_all(HOST).iter().count() != 1 {
        return Err(Refusal::new(StatusCode::FORBIDDEN, format!("host {host:?}: expected {}", own.join(" or "))));
    }
    for origin in headers.get_all(ORIGIN) {
        let origin = origin.to_str().unwrap_or_default();
        if !own.iter().any(|name| origin.strip_prefix("http://") == Some(name)) {
            let text = format!("origin {origin:?}: only pages of this server are answered");
            return Err(Refusal::new(StatusCode::FORBIDDEN, text));
        }
    }
    if !uri.path().starts_with("/api/") {
        return match *method {
            Method::GET | Method::HEAD => Ok(()),
            _ => Err(Refusal::new(StatusCode::METHOD_NOT_ALLOWED, "expected GET")),
        };
    }
    let in_query = || uri.query().and_then(|query| query.split('&').find_map(|pair| pair.strip_prefix("token=")));
    let given = headers.get(TOKEN).and_then(|token| token.to_str().ok()).or_else(in_query).unwrap_or_default();
    if !same(given, &access.token) {
        let text = "no or a wrong token: open the address that `misclosure lab` printed";
        return Err(Refusal::new(StatusCode::UNAUTHORIZED, text));
    }
    if *method == Method::POST {
        let json = headers.get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
        if json.split(';').next().map(str::trim) != Some("application/json") {
            return Err(Refusal::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "expected content-type: application/json"));
        }
    }
    Ok(())
}

/// Are two texts the same? Takes as long for any two of one length.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b)) == 0
}
