//! In: the number of the picture that a page shows. Out: the newest other picture with its peaks, as soon as there
//! is one; a part over it.
//! Frame and unit: px, grey levels of 8 bits, ms; numbers little endian.

use super::answer::{Answer, body, json, operates};
use super::place::recorded;
use crate::web::camera::Camera;
use crate::web::ghost as parts;
use crate::web::guard::Tab;
use crate::web::message::{CameraState, Ghost, Outlines, PictureLook, PictureRef, SetFeature};
use crate::web::screen::Screen;
use axum::body::Bytes;
use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use serde::Deserialize;
use sheetlight::capture::look;
use sheetlight::fault::{Fault, Result};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest wait for a picture; the page asks again.
pub(super) const LONGEST: Duration = Duration::from_secs(1);
/// Polling interval of that wait.
const OFTEN: Duration = Duration::from_millis(4);

/// The picture that the page has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct After {
    #[serde(default)]
    after: u64,
}

fn camera(screen: &Screen) -> Result<&Arc<Camera>> {
    screen.camera().ok_or_else(|| {
        Fault::input("no camera: the screen was served without --camera").next("start it with --camera URI")
    })
}

/// GET /camera
pub async fn state(State(screen): State<Arc<Screen>>) -> Answer<Json<CameraState>> {
    json(screen, |s| camera(s).map(|c| c.features())).await
}

/// PUT /camera/features
pub async fn set(
    State(screen): State<Arc<Screen>>,
    Extension(tab): Extension<Tab>,
    bytes: Bytes,
) -> Answer<Json<CameraState>> {
    operates(&screen, &tab)?;
    let ask: SetFeature = body(&bytes)?;
    json(screen, move |s| camera(s)?.set(&ask)).await
}

/// GET /camera/look: measures of the newest picture.
pub async fn look_now(State(screen): State<Arc<Screen>>) -> Answer<Json<PictureLook>> {
    json(screen, |s| {
        let newest = camera(s)?.other_than(0).ok_or_else(|| {
            Fault::input("the camera has sent no picture yet").next("see what alarms say of the camera")
        })?;
        Ok(PictureLook::from(&look(&newest.image)))
    })
    .await
}

/// GET /look?recording=&frame=&light=
pub async fn look_back(State(screen): State<Arc<Screen>>, Query(ask): Query<PictureRef>) -> Answer<Json<PictureLook>> {
    json(screen, move |s| recorded(s, &ask).map(|image| PictureLook::from(&look(&image)))).await
}

/// GET /camera/newest?after=: number, columns, rows, number of peaks (u32), delay in ms (float), then u, v (float)
/// and fate (u32) of each peak, then the grey levels. 204 if no picture came within a second.
pub async fn newest(State(screen): State<Arc<Screen>>, Query(ask): Query<After>) -> Answer<Response> {
    let camera = camera(&screen)?;
    Ok(match camera.next(ask.after, LONGEST).await {
        Some(looked) => ([(header::CONTENT_TYPE, "application/octet-stream")], looked.bytes()).into_response(),
        None => StatusCode::NO_CONTENT.into_response(),
    })
}

/// The picture over which the part is drawn.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Number {
    number: u64,
}

/// GET /jobs/{id}/outlines
pub async fn outlines(State(screen): State<Arc<Screen>>, Path(id): Path<String>) -> Answer<Json<Outlines>> {
    json(screen, move |s| parts::outlines(s, &id)).await
}

/// GET /jobs/{id}/ghost?number=: waits until the robot's pose after the picture has been read.
pub async fn ghost(
    State(screen): State<Arc<Screen>>,
    Path(id): Path<String>,
    Query(ask): Query<Number>,
) -> Answer<Json<Ghost>> {
    let (at_ns, begun) = (parts::moment(&screen, ask.number)?, Instant::now());
    while !parts::known(&screen, at_ns) && begun.elapsed() < LONGEST {
        tokio::time::sleep(OFTEN).await;
    }
    json(screen, move |s| parts::over(s, &id, ask.number, at_ns)).await
}
