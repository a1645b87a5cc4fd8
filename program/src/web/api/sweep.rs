//! In: questions about a planned sweep, and about repeated poses of a part. Out: the plan; the repeatability.
//! Frame and unit: mm, degrees.

use super::answer::{Answer, body, json};
use crate::web::message::{Outcome, Repeats, RepeatsAsk, SweepAsk, SweepPlan};
use crate::web::screen::Screen;
use crate::web::sweep::sweep;
use axum::Json;
use axum::body::Bytes;
use axum::extract::{Query, State};
use sheetlight::station::{Placed, repeats};
use std::sync::Arc;

/// GET /sweep?recipe=
pub async fn planned(State(screen): State<Arc<Screen>>, Query(ask): Query<SweepAsk>) -> Answer<Json<SweepPlan>> {
    json(screen, move |s| sweep(s, &ask)).await
}

/// POST /repeats: repeatability of jobs that found a part.
pub async fn repeated(State(screen): State<Arc<Screen>>, bytes: Bytes) -> Answer<Json<Repeats>> {
    let ask: RepeatsAsk = body(&bytes)?;
    json(screen, move |s| {
        let mut placed = Vec::new();
        for id in &ask.jobs {
            if let Some(Outcome::Find(p)) = s.jobs.get(id)?.outcome {
                placed.extend(Placed::of(&p.part, p.sigma_mm, p.sigma_deg));
            }
        }
        Ok(Repeats::of(placed.len(), repeats(&placed)))
    })
    .await
}
