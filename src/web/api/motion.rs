//! In: a button that goes down over a pose, and one that was held. Out: one motion to that pose, or why not.
//! Frame and unit: poses by their hash; mm.

use super::answer::{Answer, body, json, operates};
use crate::fault::{Fault, Result};
use crate::web::guard::Tab;
use crate::web::message::{Confirmed, Grant, Job, JobState, Outcome, Redeem, RobotPoses};
use crate::web::screen::Screen;
use axum::body::Bytes;
use axum::extract::State;
use axum::{Extension, Json};
use serde_json::{Value, json as object};
use std::sync::Arc;

type Shared = State<Arc<Screen>>;

/// POST /motion/press: the button goes down. Answers the name under which it can be redeemed once.
pub async fn press(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<Grant>> {
    operates(&screen, &tab)?;
    let what: Confirmed = body(&bytes)?;
    json(screen, move |s| {
        shown(s, &what)?;
        Ok(Grant { grant: s.grants.give(&tab, what) })
    })
    .await
}

/// POST /motion/go: it was held long enough.
pub async fn go(State(screen): Shared, Extension(tab): Extension<Tab>, bytes: Bytes) -> Answer<Json<Value>> {
    operates(&screen, &tab)?;
    let ask: Redeem = body(&bytes)?;
    json(screen, move |s| {
        s.grants.redeem(&ask.grant, &tab, &ask.what)?;
        shown(s, &ask.what)?;
        Err::<Value, _>(
            Fault::refused("this screen moves no robot: nothing was moved")
                .cause("it reads the controller's state at most")
                .next("take the numbers over to the controller"),
        )
    })
    .await
}

/// POST /motion/release: the button was let go before its time.
pub async fn release(State(screen): Shared, Extension(tab): Extension<Tab>) -> Answer<Json<Value>> {
    operates(&screen, &tab)?;
    screen.grants.drop_all();
    Ok(Json(object!({})))
}

/// The poses that a confirmation names, where they still are those that were shown and nothing newer was found.
fn shown(screen: &Screen, what: &Confirmed) -> Result<RobotPoses> {
    let job = screen.jobs.get(&what.job)?;
    let old = |why: &str| {
        Err(Fault::refused(why).cause("nothing was moved").next("look at the newest position and hold its button"))
    };
    let Some(poses) = poses_of(&job) else { return old("this job has no pose: a gate was missed, or it is not done") };
    if poses.hash != what.hash {
        return old("the pose is not the one that was shown");
    }
    // What was found later, and every scan that began later, makes a pose old: the part may have been moved for it.
    let newer = screen.jobs.list(usize::MAX).into_iter().find(|j| {
        j.id > job.id
            && (matches!(j.outcome, Some(Outcome::Find(_)) | Some(Outcome::Scan(_))) || j.state == JobState::Running)
    });
    match newer {
        Some(j) => old(&format!("the pose is older than {}", j.id)),
        None => Ok(poses),
    }
}

fn poses_of(job: &Job) -> Option<RobotPoses> {
    match &job.outcome {
        Some(Outcome::Find(p)) if job.state == JobState::Done && p.passed => p.poses.clone(),
        _ => None,
    }
}
