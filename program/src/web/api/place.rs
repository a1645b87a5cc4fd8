//! In: questions about the station, its recordings and recipes. Out: lists, pictures, texts.
//! Frame and unit: px.

use super::answer::{Answer, beside, body, json, operates};
use crate::web::guard::{Tab, resolve};
use crate::web::message::{
    Bar, BoardView, DrawingAsk, DrawingRead, PictureRef, PointsChange, PointsChanged, PointsOf, RecipeAsk, RecipePoint,
    RecipeText, RecordingInfo, StationInfo, ViewRef,
};
use crate::web::screen::Screen;
use crate::web::{station, work};
use axum::body::Bytes;
use axum::extract::{Path as UrlPath, Query, State};
use axum::http::header;
use axum::response::IntoResponse;
use axum::{Extension, Json};
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::{Image, png};
use sheetlight::recording::Recording;
use std::sync::Arc;

/// GET /station
pub async fn station(State(screen): State<Arc<Screen>>) -> Answer<Json<StationInfo>> {
    json(screen, |s| Ok(station::info(&s.place))).await
}

/// GET /bar
pub async fn bar(State(screen): State<Arc<Screen>>) -> Answer<Json<Bar>> {
    json(screen, |s| Ok(s.bar())).await
}

/// GET /recordings
pub async fn recordings(State(screen): State<Arc<Screen>>) -> Answer<Json<Vec<RecordingInfo>>> {
    json(screen, |s| s.place.listed()).await
}

/// A picture of a recording, at its original depth.
pub(super) fn recorded(screen: &Screen, ask: &PictureRef) -> Result<Image> {
    let recording = Recording::open(&resolve(&screen.place.recordings, &ask.recording)?)?;
    let frame = recording.meta.frames.get(ask.frame).ok_or_else(|| {
        Fault::input(format!("frame {} of {} was asked for", ask.frame, recording.meta.frames.len()))
            .next("reload the page")
    })?;
    let name = match ask.light.as_deref() {
        Some("ambient") => frame.ambient.as_ref(),
        Some("laser") => frame.laser.as_ref(),
        _ => frame.laser.as_ref().or(frame.ambient.as_ref()),
    };
    let name =
        name.ok_or_else(|| Fault::input(format!("frame {} has no such picture", ask.frame)).next("choose another"))?;
    recording.picture(name)
}

/// GET /picture?recording=&frame=&light=&width=
pub async fn picture(State(screen): State<Arc<Screen>>, Query(ask): Query<PictureRef>) -> Answer<impl IntoResponse> {
    let bytes = beside(screen, move |s| Ok(png(&smaller(&recorded(s, &ask)?, ask.width)))).await?;
    Ok(([(header::CONTENT_TYPE, "image/png"), (header::CACHE_CONTROL, "private, max-age=300")], bytes))
}

/// GET /view?recording=&frame=
pub async fn view(State(screen): State<Arc<Screen>>, Query(ask): Query<ViewRef>) -> Answer<Json<BoardView>> {
    json(screen, move |s| s.views.of_recording(&s.place, &ask.recording, ask.frame)).await
}

/// An 8-bit thumbnail. Each pixel is the brightest of those that it covers, because a stripe is thinner than a
/// thumbnail's pixel.
fn smaller(image: &Image, width: Option<u32>) -> Image {
    let by = width.map_or(1, |w| image.width.div_ceil(w.clamp(16, 4096))).max(1);
    let (w, h) = (image.width.div_ceil(by), image.height.div_ceil(by));
    let levels = image.to_u8();
    let mut out = vec![0u8; w as usize * h as usize];
    for (y, row) in levels.chunks(image.width as usize).enumerate() {
        for (x, level) in row.iter().enumerate() {
            let cell = &mut out[y / by as usize * w as usize + x / by as usize];
            *cell = (*cell).max(*level);
        }
    }
    Image::from_u8(w, h, out)
}

/// GET /boards
pub async fn boards(State(screen): State<Arc<Screen>>) -> Answer<Json<Vec<String>>> {
    json(screen, |s| Ok(s.place.boards())).await
}

/// GET /recipes
pub async fn recipes(State(screen): State<Arc<Screen>>) -> Answer<Json<Vec<RecipeText>>> {
    json(screen, |s| Ok(work::recipes(&s.place))).await
}

/// PUT /recipes/{name}
pub async fn save_recipe(
    State(screen): State<Arc<Screen>>,
    Extension(tab): Extension<Tab>,
    UrlPath(name): UrlPath<String>,
    bytes: Bytes,
) -> Answer<Json<RecipeText>> {
    operates(&screen, &tab)?;
    let ask: RecipeAsk = body(&bytes)?;
    json(screen, move |s| work::save_recipe(&s.place, &name, &ask.text, ask.replace)).await
}

/// POST /drawings
pub async fn drawing(
    State(screen): State<Arc<Screen>>,
    Extension(tab): Extension<Tab>,
    bytes: Bytes,
) -> Answer<Json<DrawingRead>> {
    operates(&screen, &tab)?;
    let ask: DrawingAsk = body(&bytes)?;
    json(screen, move |s| work::from_drawing(&s.place, &ask)).await
}

/// POST /points: of a recipe text that need not be stored.
pub async fn points(State(screen): State<Arc<Screen>>, bytes: Bytes) -> Answer<Json<Vec<RecipePoint>>> {
    let ask: PointsOf = body(&bytes)?;
    json(screen, move |_| work::points(&ask.text)).await
}

/// POST /points/change: of a recipe text that need not be stored.
pub async fn change_points(State(screen): State<Arc<Screen>>, bytes: Bytes) -> Answer<Json<PointsChanged>> {
    let ask: PointsChange = body(&bytes)?;
    json(screen, move |_| work::change_points(&ask)).await
}

/// DELETE /recipes/{name}
pub async fn remove_recipe(
    State(screen): State<Arc<Screen>>,
    Extension(tab): Extension<Tab>,
    UrlPath(name): UrlPath<String>,
) -> Answer<Json<serde_json::Value>> {
    operates(&screen, &tab)?;
    json(screen, move |s| {
        work::remove_recipe(&s.place, &name)?;
        Ok(serde_json::json!({}))
    })
    .await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thin_stripe_stays_in_a_thumbnail() {
        let mut levels = vec![3u8; 640 * 480];
        levels[240 * 640..241 * 640].fill(200);
        let small = smaller(&Image::from_u8(640, 480, levels), Some(64));
        assert_eq!((small.width, small.height), (64, 48));
        assert!((0..64).all(|x| small.get(x, 24) == 200 && small.get(x, 23) == 3));
        assert_eq!(smaller(&Image::from_u8(7, 3, vec![1; 21]), None).width, 7);
    }
}
