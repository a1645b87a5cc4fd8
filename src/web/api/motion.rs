//! In: a robot to arm, a button that goes down over a motion that is shown, is held, is let go. Out: that motion,
//! once; or why not.
//! Frame and unit: motions by their hash.

use super::answer::{Answer, body, json, operates};
use crate::fault::{Fault, Result};
use crate::web::guard::Tab;
use crate::web::message::{Arming, Confirmed, Grant, InTheCell, JobState, MotionState, Redeem};
use crate::web::screen::{JOBS, Screen};
use axum::body::Bytes;
use axum::extract::State;
use axum::{Extension, Json};
use serde_json::{Value, json as object};
use std::sync::Arc;

type Shared = State<Arc<Screen>>;

/// GET /motion
pub async fn state(State(screen): Shared) -> Json<MotionState> {
    Json(screen.desk.state())
}

/// POST /robot: arms it from this tab, or gives it back.
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

/// POST /motion/press: the button goes down. Answers the name under which it can be redeemed once.
pub async fn press(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<Grant>> {
    operates(&screen, &tab)?;
    let what: Confirmed = body(&bytes)?;
    json(screen, move |s| s.desk.press(&tab, &what).map(|grant| Grant { grant })).await
}

/// POST /motion/go: it was held long enough, and is held on.
pub async fn go(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<Value>> {
    operates(&screen, &tab)?;
    let ask: Redeem = body(&bytes)?;
    json(screen, move |s| s.desk.go(&tab, &ask.grant, &ask.what).map(|()| object!({}))).await
}

/// POST /motion/refuse: no; the job ends.
pub async fn refuse(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<Value>> {
    operates(&screen, &tab)?;
    let what: Confirmed = body(&bytes)?;
    json(screen, move |s| s.desk.refuse(&what).map(|()| object!({}))).await
}

/// POST /motion/release: the button was let go. Needs no lease: who lost it lets go too.
pub async fn release(State(screen): Shared, Extension(tab): Extension<Tab>) -> Answer<Json<Value>> {
    // Here, not in the queue of work that waits for the disk: a hand that opens halts the arm at once.
    screen.desk.let_go(&tab, "the button was let go");
    Ok(Json(object!({})))
}

/// POST /stop: everybody may.
pub async fn stop(State(screen): Shared) -> Answer<Json<Value>> {
    // The robot first, and here: every thread for the work below may be busy with pictures.
    screen.desk.stop();
    json(screen, |s| {
        for job in s.jobs.list(JOBS) {
            if matches!(job.state, JobState::Running | JobState::Queued) {
                // One that has just ended needs no stop.
                let _ = s.jobs.stop(&job.id);
            }
        }
        Ok(object!({}))
    })
    .await
}

/// POST /simulated: what a person does in the simulated cell.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::web::event::Hub;
    use crate::web::guard::Sessions;
    use crate::web::message::Mode;
    use crate::web::motion::{Desk, Links};
    use crate::web::work::{Jobs, Place};
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc::channel;
    use std::time::Duration;

    /// STOP acts although every thread for other work sleeps; its answer, which writes the jobs' states, may wait.
    #[test]
    fn stop_waits_for_no_other_work() {
        let dir = tempfile::tempdir().unwrap();
        let [station, recordings] = ["station", "recordings"].map(|name| dir.path().join(name));
        let hub = Arc::new(Hub::default());
        let desk = Arc::new(Desk::new(Links { station: station.clone(), ..Links::default() }, hub.clone()));
        let place = Place { station, recordings, mode: Mode::Replay };
        std::fs::create_dir_all(place.jobs()).unwrap();
        let jobs = Jobs::open(place, hub, desk.clone()).unwrap();
        let screen = Arc::new(Screen::new(jobs, Arc::new(Sessions::new("token")), "cookie".into(), None));
        let stopped = Arc::new(AtomicBool::new(false));
        desk.a_job_runs(&stopped);
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(1).max_blocking_threads(1).enable_all().build();
        let runtime = runtime.unwrap();
        let (wake, sleeps) = channel::<()>();
        runtime.spawn_blocking(move || sleeps.recv());
        runtime.block_on(async {
            let asked = tokio::time::timeout(Duration::from_millis(200), stop(State(screen)));
            assert!(asked.await.is_err(), "the answer waits for a free thread");
        });
        assert!(stopped.load(Ordering::SeqCst), "the job goes on");
        wake.send(()).unwrap();
    }
}
