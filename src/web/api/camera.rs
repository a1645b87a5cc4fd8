//! In: the number of the picture that a page shows. Out: the newest other one with its peaks, as soon as there is one.
//! Frame and unit: px, grey levels of 8 bits, ms; numbers little endian.

use super::answer::Answer;
use crate::fault::Fault;
use crate::web::camera::Looked;
use crate::web::screen::Screen;
use axum::extract::{Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Waited for a picture at most so long; the page asks again.
const LONGEST: Duration = Duration::from_secs(1);
/// Looked for one this often.
const OFTEN: Duration = Duration::from_millis(4);

/// Which one the page has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct After {
    #[serde(default)]
    after: u64,
}

/// GET /camera/newest?after=: number, columns, rows, number of peaks (u32), delay in ms (float), then u, v (float) and fate (u32) of
/// each peak, then the grey levels; 204 where none came within a second.
pub async fn newest(State(screen): State<Arc<Screen>>, Query(ask): Query<After>) -> Answer<Response> {
    let Some(camera) = screen.camera() else {
        return Err(Fault::input("no camera: the screen was served without --camera")
            .next("start it with --camera URI")
            .into());
    };
    let begun = Instant::now();
    loop {
        if let Some(looked) = camera.other_than(ask.after) {
            return Ok(([(header::CONTENT_TYPE, "application/octet-stream")], bytes(&looked)).into_response());
        }
        if begun.elapsed() > LONGEST {
            return Ok(StatusCode::NO_CONTENT.into_response());
        }
        tokio::time::sleep(OFTEN).await;
    }
}

fn bytes(l: &Looked) -> Vec<u8> {
    let mut out = Vec::with_capacity(20 + 12 * l.peaks.len() + l.grey.len());
    for word in [l.number as u32, l.width, l.height, l.peaks.len() as u32, l.delay_ms.to_bits()] {
        out.extend(word.to_le_bytes());
    }
    for (u, v, fate) in &l.peaks {
        out.extend([u.to_bits(), v.to_bits(), *fate].iter().flat_map(|w| w.to_le_bytes()));
    }
    out.extend(&l.grey);
    out
}
