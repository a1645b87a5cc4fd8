//! In: orders and questions about jobs. Out: jobs, and their files.
//! Frame and unit: bytes.

use super::answer::{Answer, afterwards, beside, body, json, operates};
use crate::web::guard::{Tab, resolve};
use crate::web::message::{BoardView, Job, Order};
use crate::web::screen::{JOBS, Screen};
use crate::web::work;
use axum::body::Bytes;
use axum::extract::{Path as UrlPath, State};
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::{Extension, Json};
use sheetlight::fault::{Fault, Result};
use std::sync::Arc;

type Shared = State<Arc<Screen>>;

/// GET /jobs
pub async fn list(State(screen): Shared) -> Json<Vec<Job>> {
    Json(screen.jobs.list(JOBS))
}

/// GET /jobs/{id}
pub async fn get(State(screen): Shared, UrlPath(id): UrlPath<String>) -> Answer<Json<Job>> {
    Ok(Json(screen.jobs.get(&id)?))
}

/// POST /jobs
pub async fn order(
    State(screen): Shared,
    Extension(tab): Extension<Tab>,
    bytes: Bytes,
) -> Answer<(StatusCode, Json<Job>)> {
    operates(&screen, &tab)?;
    let order: Order = body(&bytes)?;
    let job = json(screen, move |s| s.jobs.order(order)).await?;
    Ok((StatusCode::ACCEPTED, job))
}

/// POST /jobs/{id}/stop, /resume, /back_out, /accept
pub async fn act(
    State(screen): Shared,
    Extension(tab): Extension<Tab>,
    UrlPath((id, what)): UrlPath<(String, String)>,
) -> Answer<Json<Job>> {
    // Every viewer may stop. This acts here, not in the queue of work that waits for the disk.
    if what == "stop" {
        let job = screen.jobs.stop(&id)?;
        afterwards(screen, move |s| s.jobs.keep(&[id]));
        return Ok(Json(job));
    }
    operates(&screen, &tab)?;
    json(screen, move |s| match what.as_str() {
        "resume" => s.jobs.resume(&id, false),
        "back_out" => s.jobs.resume(&id, true),
        "accept" => {
            let job = work::accept(&s.jobs, &s.jobs.get(&id)?)?;
            s.forget();
            Ok(job)
        }
        other => Err(Fault::usage(format!("{other:?}: nothing of that name is done with a job"))
            .next("stop, resume, back_out or accept")),
    })
    .await
}

/// GET /jobs/{id}/views
pub async fn views(State(screen): Shared, UrlPath(id): UrlPath<String>) -> Answer<Json<Vec<BoardView>>> {
    json(screen, move |s| s.views.of(&s.jobs, &id)).await
}

/// DELETE /jobs/{id}
pub async fn remove(
    State(screen): Shared,
    Extension(tab): Extension<Tab>,
    UrlPath(id): UrlPath<String>,
) -> Answer<Json<serde_json::Value>> {
    operates(&screen, &tab)?;
    json(screen, move |s| s.jobs.remove(&id).map(|()| serde_json::json!({}))).await
}

/// Types of a job's files that may be downloaded, with their media types.
const KINDS: [(&str, &str); 8] = [
    ("png", "image/png"),
    ("ply", "application/octet-stream"),
    ("pcd", "application/octet-stream"),
    ("tif", "image/tiff"),
    ("json", "application/json"),
    ("toml", "text/plain; charset=utf-8"),
    ("csv", "text/csv; charset=utf-8"),
    // A report is shown as text, so that its scripts and styles do not run in this page.
    ("html", "text/plain; charset=utf-8"),
];

/// Most bytes of a downloaded file; a larger cloud must be copied from the disk by hand.
const MOST_FILE: u64 = 512 << 20;

/// GET /jobs/{id}/files/{name}
pub async fn file(State(screen): Shared, UrlPath((id, name)): UrlPath<(String, String)>) -> Answer<impl IntoResponse> {
    let (bytes, kind) = beside(screen, move |s| read(s, &id, &name)).await?;
    let shown = if kind == "image/png" { "inline" } else { "attachment" };
    Ok(([(header::CONTENT_TYPE, kind), (header::CONTENT_DISPOSITION, shown)], bytes))
}

fn read(screen: &Screen, id: &str, name: &str) -> Result<(Vec<u8>, &'static str)> {
    let job = screen.jobs.get(id)?;
    let path = resolve(&screen.place.jobs(), &format!("{}/{name}", job.id))?;
    let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    let kind = KINDS.iter().find(|(e, _)| *e == ending).map(|(_, kind)| *kind);
    let kind = kind
        .ok_or_else(|| Fault::usage(format!("{name}: files of that kind are not given out")).next("choose another"))?;
    Ok((sheetlight::files::read(&path, MOST_FILE)?, kind))
}
