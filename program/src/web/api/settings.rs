//! In: questions about the station's settings, changes, backups, outputs to try. Out: the settings after that.
//! Frame and unit: as the settings.

use super::answer::{Answer, beside, body, json, operates};
use crate::web::guard::Tab;
use crate::web::message::{OutputAsk, SettingsAsk, SettingsState};
use crate::web::screen::Screen;
use crate::web::settings;
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::header;
use axum::response::IntoResponse;
use axum::{Extension, Json};
use sheetlight::fault::{Fault, Result};
use std::sync::Arc;

type Shared = State<Arc<Screen>>;

/// GET /settings
pub async fn state(State(screen): Shared) -> Answer<Json<SettingsState>> {
    json(screen, settings::state).await
}

/// PUT /settings
pub async fn change(
    State(screen): Shared,
    Extension(tab): Extension<Tab>,
    bytes: Bytes,
) -> Answer<Json<SettingsState>> {
    operates(&screen, &tab)?;
    let ask: SettingsAsk = body(&bytes)?;
    json(screen, move |s| settings::change(s, &ask)).await
}

/// POST /backups
pub async fn back_up(State(screen): Shared, Extension(tab): Extension<Tab>) -> Answer<Json<SettingsState>> {
    operates(&screen, &tab)?;
    json(screen, settings::back_up).await
}

/// GET /backups/{name}
pub async fn backup(State(screen): Shared, Path(name): Path<String>) -> Answer<impl IntoResponse> {
    let bytes = beside(screen, move |s| settings::backup(s, &name)).await?;
    Ok(([(header::CONTENT_TYPE, "application/json"), (header::CONTENT_DISPOSITION, "attachment")], bytes))
}

/// POST /backups/{name}/restore
pub async fn restore(
    State(screen): Shared,
    Extension(tab): Extension<Tab>,
    Path(name): Path<String>,
) -> Answer<Json<SettingsState>> {
    operates(&screen, &tab)?;
    json(screen, move |s| settings::restore(s, &name)).await
}

/// POST /robot/output
pub async fn output(
    State(screen): Shared,
    Extension(tab): Extension<Tab>,
    bytes: Bytes,
) -> Answer<Json<serde_json::Value>> {
    operates(&screen, &tab)?;
    let ask: OutputAsk = body(&bytes)?;
    json(screen, move |s| -> Result<serde_json::Value> {
        let what = ask.output.parse().map_err(|e: String| Fault::usage(e).next("choose one of them"))?;
        s.desk.try_output(&tab, what).map(|number| serde_json::json!({ "number": number }))
    })
    .await
}
