//! In: every request. Out: an error if host, origin, length or session are wrong; headers on every answer that
//! isolate the page from other sites.
//! Frame and unit: bytes.

use super::host::Hosts;
use super::tls::Peer;
use super::{Sessions, Tab};
use axum::body::Body;
use axum::extract::{ConnectInfo, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// Largest body of a request, bytes: recipes and outlines are far shorter.
pub const MOST_BODY: usize = 1 << 20;

/// State that the middleware checks requests against.
pub struct Door {
    /// Names by which browsers may call this server.
    pub hosts: Hosts,
    /// The open sessions.
    pub sessions: Arc<Sessions>,
    /// Token that lets a program read the figures, and nothing else.
    pub metrics: Option<String>,
    /// Name of the cookie. It contains the port, because cookies do not depend on the port.
    pub cookie: String,
}

/// Scripts, styles, pictures and connections from this server only; no frames, no plugins, no inline code.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
                      connect-src 'self'; \
                      font-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors \
                      'none'";

const HEADERS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// The middleware.
pub async fn door(
    State(door): State<Arc<Door>>,
    ConnectInfo(peer): ConnectInfo<Peer>,
    mut request: Request<Body>,
    next: Next,
) -> Response {
    let mut response = match door.refuses(&request, &peer) {
        Some((status, why)) => refusal(status, why),
        None => {
            let open = is_open(request.method(), request.uri().path());
            match door.tab(request.headers()).or_else(|| door.scraper(&request)) {
                Some(tab) => {
                    peer.shows_session();
                    request.extensions_mut().insert(tab);
                    next.run(request).await
                }
                None if open => next.run(request).await,
                None => refusal(
                    StatusCode::UNAUTHORIZED,
                    "not signed in: open the address printed by the running server; addresses from earlier runs no \
                     longer work",
                ),
            }
        }
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    // Pages and answers change with the station; a browser that caches them shows an old state.
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}

fn refusal(status: StatusCode, why: &str) -> Response {
    let body = serde_json::json!({ "error": { "kind": "usage", "what": why, "cause": "", "next": "" } });
    (status, axum::Json(body)).into_response()
}

/// Whether a request needs no session: pages, which contain no secrets, and the request that opens a session.
fn is_open(method: &Method, path: &str) -> bool {
    let page = !path.starts_with("/api/") && (method == Method::GET || method == Method::HEAD);
    page || (method == Method::POST && path == "/api/v1/session")
}

impl Door {
    fn refuses(&self, request: &Request<Body>, peer: &Peer) -> Option<(StatusCode, &'static str)> {
        let headers = request.headers();
        let text = |name: HeaderName| headers.get(name).and_then(|v| v.to_str().ok()).map(str::to_ascii_lowercase);
        // A page of another name that resolves to this server (DNS rebinding) is rejected.
        if !text(header::HOST).is_some_and(|host| self.hosts.are(&host, peer.local)) {
            return Some((StatusCode::MISDIRECTED_REQUEST, "another host's name: open the address that was printed"));
        }
        if text(header::ORIGIN).is_some_and(|origin| !self.hosts.origin(&origin, peer.local)) {
            return Some((StatusCode::FORBIDDEN, "a page of another origin asks"));
        }
        if text(HeaderName::from_static("sec-fetch-site")).is_some_and(|s| s == "cross-site" || s == "same-site")
            && request.uri().path().starts_with("/api/")
        {
            return Some((StatusCode::FORBIDDEN, "a page of another site asks"));
        }
        let length = text(header::CONTENT_LENGTH).map(|l| l.parse::<u64>().unwrap_or(u64::MAX));
        if length.is_some_and(|l| l > MOST_BODY as u64) {
            return Some((StatusCode::PAYLOAD_TOO_LARGE, "the body is longer than 1 MiB"));
        }
        None
    }

    /// The tab that sends the request: identified by cookie, or by the token in `Authorization: Bearer`.
    fn tab(&self, headers: &HeaderMap) -> Option<Tab> {
        let tab = headers.get("x-sheetlight-tab").and_then(|v| v.to_str().ok()).unwrap_or("none");
        let tab: String = tab.chars().filter(char::is_ascii_alphanumeric).take(32).collect();
        if bearer(headers).is_some_and(|token| self.sessions.is_token(token)) {
            return Some(Tab { session: "token".into(), tab });
        }
        let session = cookie(headers, &self.cookie)?;
        self.sessions.knows(session).then(|| Tab { session: session.to_owned(), tab })
    }
}

/// Path of the figures for Prometheus.
const METRICS: &str = "/api/v1/metrics";

impl Door {
    /// A program that has the token of the figures and asks for them.
    fn scraper(&self, request: &Request<Body>) -> Option<Tab> {
        let asks = request.uri().path() == METRICS && request.method() == Method::GET;
        let (token, given) = (self.metrics.as_deref()?, bearer(request.headers())?);
        // Hashes of both, so that the time of a comparison says nothing of the token.
        let same = Sessions::new(token).is_token(given);
        (asks && same).then(|| Tab { session: "metrics".into(), tab: "none".into() })
    }
}

fn bearer(headers: &HeaderMap) -> Option<&str> {
    headers.get(header::AUTHORIZATION)?.to_str().ok()?.strip_prefix("Bearer ")
}

fn cookie<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    let all = headers.get_all(header::COOKIE).into_iter().filter_map(|v| v.to_str().ok());
    let mut pairs = all.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
    pairs.find(|(n, _)| *n == name).map(|(_, v)| v)
}
