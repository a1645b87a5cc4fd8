//! In: the result of a procedure. Out: an HTTP answer. Work that waits for the disk runs outside the server's
//! threads.
//! Frame and unit: none.

use crate::web::guard::Tab;
use crate::web::screen::Screen;
use axum::Json;
use axum::body::Bytes;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sheetlight::fault::{Fault, Kind, Result};
use std::sync::Arc;

/// A fault with its HTTP status.
pub struct Refusal(pub StatusCode, pub Fault);

impl From<Fault> for Refusal {
    fn from(fault: Fault) -> Refusal {
        let status = match fault.kind {
            Kind::Usage => StatusCode::BAD_REQUEST,
            Kind::Input => StatusCode::NOT_FOUND,
            Kind::Refused => StatusCode::CONFLICT,
            Kind::Output => StatusCode::INSUFFICIENT_STORAGE,
            Kind::Device => StatusCode::INTERNAL_SERVER_ERROR,
        };
        Refusal(status, fault)
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let body = serde_json::json!({ "error": crate::web::message::Problem::from(&self.1) });
        (self.0, Json(body)).into_response()
    }
}

/// Result of a handler.
pub type Answer<T> = std::result::Result<T, Refusal>;

/// Runs work that may wait for the disk or take long, and answers in JSON.
pub async fn json<T: Serialize + Send + 'static>(
    screen: Arc<Screen>,
    work: impl FnOnce(&Screen) -> Result<T> + Send + 'static,
) -> Answer<Json<T>> {
    beside(screen, work).await.map(Json)
}

/// The same for an answer that is not JSON.
pub async fn beside<T: Send + 'static>(
    screen: Arc<Screen>,
    work: impl FnOnce(&Screen) -> Result<T> + Send + 'static,
) -> Answer<T> {
    let done = tokio::task::spawn_blocking(move || work(&screen)).await;
    match done {
        Ok(done) => Ok(done?),
        Err(e) => {
            Err(Fault::device(format!("a bug in sheetlight: {e}")).next("report it with the support file").into())
        }
    }
}

/// Runs work that may take long; the answer does not wait for it.
pub fn afterwards(screen: Arc<Screen>, work: impl FnOnce(&Screen) + Send + 'static) {
    drop(tokio::task::spawn_blocking(move || work(&screen)));
}

/// Parses a body as JSON.
pub fn body<T: DeserializeOwned>(bytes: &Bytes) -> Result<T> {
    serde_json::from_slice(bytes).map_err(|e| {
        Fault::usage(format!("the request cannot be read: {e}"))
            .cause("another version's page, or a slip in a program")
            .next("reload the page; programs find the messages in docs/api.md")
    })
}

/// Returns an error for a tab that does not operate.
pub fn operates(screen: &Screen, tab: &Tab) -> Answer<()> {
    screen.leases.need(tab).map_err(|fault| Refusal(StatusCode::FORBIDDEN, fault))
}
