//! In: a robot to arm, a button that is pressed, held and released for a shown motion. Out: that motion, once; or
//! an error.
//! Frame and unit: motions by their hash.

use super::answer::{Answer, afterwards, body, json, operates};
use crate::web::guard::Tab;
use crate::web::message::{Arming, Confirmed, Grant, InTheCell, MotionState, Redeem};
use crate::web::screen::Screen;
use axum::body::Bytes;
use axum::extract::State;
use axum::{Extension, Json};
use serde_json::{Value, json as object};
use sheetlight::fault::{Fault, Result};
use std::sync::Arc;

type Shared = State<Arc<Screen>>;

/// GET /motion
pub async fn state(State(screen): Shared) -> Json<MotionState> {
    Json(screen.desk.state())
}

/// POST /robot: arms the robot from this tab, or disarms it.
pub async fn arm(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<MotionState>> {
    operates(&screen, &tab)?;
    let ask: Arming = body(&bytes)?;
    json(screen, move |s| if ask.armed { s.desk.arm(&tab) } else { s.desk.disarm() }).await
}

/// POST /robot/looked: a person has looked at the robot.
pub async fn looked(State(screen): Shared, Extension(tab): Extension<Tab>) -> Answer<Json<MotionState>> {
    operates(&screen, &tab)?;
    json(screen, |s| s.desk.looked()).await
}

/// POST /motion/press: the button is pressed. Answers the name under which the grant can be redeemed once.
pub async fn press(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<Grant>> {
    operates(&screen, &tab)?;
    let what: Confirmed = body(&bytes)?;
    json(screen, move |s| s.desk.press(&tab, &what).map(|grant| Grant { grant })).await
}

/// POST /motion/go: the button was held long enough, and is still held.
pub async fn go(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<Value>> {
    operates(&screen, &tab)?;
    let ask: Redeem = body(&bytes)?;
    json(screen, move |s| s.desk.go(&tab, &ask.grant, &ask.what).map(|()| object!({}))).await
}

/// POST /motion/refuse: refuses the motion; the job ends.
pub async fn refuse(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<Value>> {
    operates(&screen, &tab)?;
    let what: Confirmed = body(&bytes)?;
    json(screen, move |s| s.desk.refuse(&what).map(|()| object!({}))).await
}

/// POST /motion/release: the button was released. Needs no lease: a tab that lost it must be able to release too.
pub async fn release(State(screen): Shared, Extension(tab): Extension<Tab>) -> Answer<Json<Value>> {
    // Done here, not in the queue of work that waits for the disk, so that releasing the button halts the arm at
    // once.
    screen.desk.let_go(&tab, "the button was let go");
    Ok(Json(object!({})))
}

/// POST /stop: every viewer may stop. It acts here, because every worker thread may be busy with pictures.
pub async fn stop(State(screen): Shared) -> Json<Value> {
    let stopped = screen.jobs.stop_all();
    afterwards(screen, move |s| s.jobs.keep(&stopped));
    Json(object!({}))
}

/// POST /simulated: a person's action in the simulated cell.
pub async fn simulated(
    State(screen): Shared,
    Extension(tab): Extension<Tab>,
    bytes: Bytes,
) -> Answer<Json<MotionState>> {
    operates(&screen, &tab)?;
    let ask: InTheCell = body(&bytes)?;
    json(screen, move |s| -> Result<MotionState> {
        let Some(cell) = &s.desk.links.simulated else {
            return Err(Fault::refused("this cell is not a simulated one of this program")
                .next("jog the arm with its own pendant"));
        };
        if s.desk.has_job() {
            return Err(Fault::refused("a job has the robot").next("wait until it has ended, or stop it"));
        }
        cell.put(ask.holds.as_deref(), ask.over_board)?;
        Ok(s.desk.told())
    })
    .await
}
