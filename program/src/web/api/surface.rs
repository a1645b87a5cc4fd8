//! In: questions about a finished scan's surface. Out: its map's layers, sections, measurements, points to view.
//! Frame and unit: grid frame, points in the cloud's frame; mm. Layers and points are sent as little-endian floats.

use super::answer::{Answer, beside, body, json, operates};
use crate::web::guard::Tab;
use crate::web::message::{Filtered, Filters, MapHead, Measure, MeasureAnswer, Section, SectionAsk};
use crate::web::screen::Screen;
use crate::web::surface::{measure, section, view};
use axum::body::Bytes;
use axum::extract::{Path as UrlPath, Query, State};
use axum::http::header;
use axum::response::IntoResponse;
use axum::{Extension, Json};
use serde::Deserialize;
use sheetlight::fault::{Fault, Result};
use sheetlight::scan::{CloudFile, HeightMap};
use sheetlight::station::left;
use std::sync::Arc;

type Shared = State<Arc<Screen>>;

/// GET /scans/{id}/map
pub async fn head(State(screen): Shared, UrlPath(id): UrlPath<String>) -> Answer<Json<MapHead>> {
    json(screen, move |s| {
        let map = s.look(&id)?.map;
        Ok(MapHead {
            width: map.width,
            height: map.height,
            cell_mm: map.cell,
            base_from_grid: map.base_from_grid.to_rows(),
            z_mm: span(&map.z),
            sigma_mm: span(&map.sigma),
            intensity: span(&map.intensity),
        })
    })
    .await
}

/// GET /scans/{id}/filters
pub async fn filters(State(screen): Shared, UrlPath(id): UrlPath<String>) -> Answer<Json<Filtered>> {
    json(screen, move |s| Ok(s.look(&id)?.filtered)).await
}

/// PUT /scans/{id}/filters
pub async fn filter(
    State(screen): Shared,
    Extension(tab): Extension<Tab>,
    UrlPath(id): UrlPath<String>,
    bytes: Bytes,
) -> Answer<Json<Filtered>> {
    operates(&screen, &tab)?;
    let ask: Filters = body(&bytes)?;
    json(screen, move |s| s.maps.set(&s.scan(&id)?, ask)).await
}

/// The range that contains 99 % of the finite values.
fn span(values: &[f32]) -> [f64; 2] {
    let mut finite: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let Some(last) = finite.len().checked_sub(1) else { return [0.0, 1.0] };
    let mut at = |q: f64| f64::from(*finite.select_nth_unstable_by((last as f64 * q) as usize, f32::total_cmp).1);
    let (low, high) = (at(0.005), at(0.995));
    if high > low { [low, high] } else { [low, low + 1e-3] }
}

/// GET /scans/{id}/map/{layer}: height, sigma or intensity.
pub async fn layer(
    State(screen): Shared,
    UrlPath((id, layer)): UrlPath<(String, String)>,
) -> Answer<impl IntoResponse> {
    let bytes = beside(screen, move |s| {
        let map = s.look(&id)?.map;
        Ok(floats(values(&map, &layer)?))
    })
    .await?;
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], bytes))
}

fn values<'a>(map: &'a HeightMap, layer: &str) -> Result<&'a [f32]> {
    match layer {
        "height" => Ok(&map.z),
        "sigma" => Ok(&map.sigma),
        "intensity" => Ok(&map.intensity),
        other => Err(Fault::usage(format!("{other:?} is not a layer")).next("height, sigma or intensity")),
    }
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// POST /scans/{id}/section
pub async fn along(State(screen): Shared, UrlPath(id): UrlPath<String>, bytes: Bytes) -> Answer<Json<Section>> {
    let ask: SectionAsk = body(&bytes)?;
    json(screen, move |s| section(&s.look(&id)?.map, &ask)).await
}

/// POST /scans/{id}/measure
pub async fn measured(
    State(screen): Shared,
    UrlPath(id): UrlPath<String>,
    bytes: Bytes,
) -> Answer<Json<MeasureAnswer>> {
    let what: Measure = body(&bytes)?;
    json(screen, move |s| measure(&s.look(&id)?.map, &what)).await
}

/// Number of points of a view.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Most {
    #[serde(default = "usual")]
    most: usize,
}

fn usual() -> usize {
    300_000
}

/// Most points that are sent: 40 MB.
const MOST_POINTS: usize = 2_000_000;

/// GET /scans/{id}/points?most=: number of points in the cloud and of those sent (u32 each), origin (3 doubles),
/// then x y z sigma_mm intensity of each point as floats. Any leading fraction of the points covers the whole scan.
pub async fn points(
    State(screen): Shared,
    UrlPath(id): UrlPath<String>,
    Query(ask): Query<Most>,
) -> Answer<impl IntoResponse> {
    let bytes = beside(screen, move |s| {
        let looked = s.look(&id)?;
        let cloud = CloudFile::open(&s.scan(&id)?.join("cloud.ply"))?;
        let stays = left(&looked.whole, &looked.map);
        let view = view(&cloud, cloud.count(), ask.most.clamp(1, MOST_POINTS), &stays)?;
        let mut bytes = Vec::with_capacity(32 + 20 * view.points.len());
        bytes.extend((view.all.min(u64::from(u32::MAX)) as u32).to_le_bytes());
        bytes.extend((view.points.len() as u32).to_le_bytes());
        view.origin.iter().for_each(|o| bytes.extend(o.to_le_bytes()));
        view.points.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
        Ok(bytes)
    })
    .await?;
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], bytes))
}
