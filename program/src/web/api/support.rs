//! In: the station, its jobs, this machine. Out: a support file: logs and settings; pictures only if a person
//! ticked the option.
//! Frame and unit: px; base64 of PNG.

use super::answer::{Answer, beside};
use crate::web::message::{JobState, Order, SupportAsk};
use crate::web::screen::{JOBS, Screen};
use crate::web::station;
use axum::extract::{Query, State};
use axum::http::header;
use axum::response::IntoResponse;
use sheetlight::raster::png;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most job pictures in the file; `LARGEST` is the largest size of each, bytes.
const MOST: usize = 6;
const LARGEST: u64 = 4 << 20;
/// Pictures that jobs store.
const NAMES: [&str; 3] = ["found.png", "scan/height_picture.png", "scan/intensity_picture.png"];

/// GET /support?pictures=: contains no secrets; contains pictures only on request.
pub async fn support(State(screen): State<Arc<Screen>>, Query(ask): Query<SupportAsk>) -> Answer<impl IntoResponse> {
    let text = beside(screen, move |s| {
        let mut report = serde_json::json!({
            "station": station::info(&s.place),
            "bar": s.bar(),
            "jobs": s.jobs.list(JOBS),
            "adapters": sheetlight::gpu::adapters(),
            "threads": rayon::current_num_threads(),
            "system": [std::env::consts::OS, std::env::consts::ARCH],
            "seconds": s.started.elapsed().as_secs_f64(),
        });
        if ask.pictures {
            report["pictures"] = serde_json::to_value(pictures(s)).expect("plain data");
        }
        Ok(serde_json::to_string_pretty(&report).expect("plain data"))
    })
    .await?;
    let name = "attachment; filename=\"sheetlight-support.json\"";
    Ok(([(header::CONTENT_TYPE, "application/json"), (header::CONTENT_DISPOSITION, name)], text))
}

/// The camera's newest picture and those of the newest jobs, by name.
fn pictures(screen: &Screen) -> BTreeMap<String, String> {
    let encode = sheetlight::station::base64;
    let mut all = BTreeMap::new();
    if let Some(newest) = screen.camera().and_then(|c| c.other_than(0)) {
        all.insert("camera.png".into(), encode(&png(&newest.image)));
    }
    let jobs = screen.jobs.list(JOBS);
    let left = jobs.iter().filter(|j| j.state == JobState::Done && matches!(j.order, Order::Scan(_) | Order::Find(_)));
    let files = left.flat_map(|j| NAMES.iter().map(move |n| (format!("{}/{n}", j.id), screen.jobs.folder(j).join(n))));
    let there = files.filter_map(|(name, path)| Some((name, sheetlight::files::read(&path, LARGEST).ok()?)));
    all.extend(there.take(MOST).map(|(name, bytes)| (name, encode(&bytes))));
    all
}
