//! Requests that halt act in their own task: in this test every worker thread sleeps and never wakes.

use crate::web::api::{jobs, motion, session};
use crate::web::event::Hub;
use crate::web::guard::{Sessions, Tab};
use crate::web::message::{JobState, Mode, Order, Plain};
use crate::web::motion::{Desk, Links};
use crate::web::screen::Screen;
use crate::web::work::{Jobs, Place};
use axum::Extension;
use axum::body::Bytes;
use axum::extract::{Path, State};
use sheetlight::arm::rules::{Carried, Guard, MotionLog};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;

/// Longest wait for a request that acts before the queue; a request in the queue waits without end.
const PATIENCE: Duration = Duration::from_secs(20);

fn tab(name: &str) -> Tab {
    Tab { session: "s".into(), tab: name.into() }
}

/// A screen whose only worker thread sleeps.
fn asleep(what: impl AsyncFnOnce(Arc<Screen>)) {
    let dir = tempfile::tempdir().unwrap();
    let [station, recordings] = ["station", "recordings"].map(|name| dir.path().join(name));
    let hub = Arc::new(Hub::default());
    let desk = Arc::new(Desk::new(Links { station: station.clone(), ..Links::default() }, hub.clone()));
    let place = Place { station, recordings, mode: Mode::Replay };
    std::fs::create_dir_all(place.jobs()).unwrap();
    let jobs = Jobs::open(place, hub, desk).unwrap();
    let screen = Arc::new(Screen::new(jobs, Arc::new(Sessions::new("token")), "cookie".into(), None));
    let runtime =
        tokio::runtime::Builder::new_multi_thread().worker_threads(1).max_blocking_threads(1).enable_all().build();
    let runtime = runtime.unwrap();
    let (wake, sleeps) = channel::<()>();
    runtime.spawn_blocking(move || sleeps.recv());
    runtime.block_on(async {
        tokio::time::timeout(PATIENCE, what(screen)).await.expect("it waits for a thread that sleeps");
    });
    drop(wake);
}

#[test]
fn stop_waits_for_no_other_work() {
    asleep(async |screen| {
        let stopped = Arc::new(AtomicBool::new(false));
        screen.desk.a_job_runs(&stopped);
        let waits = screen.jobs.order(Order::Check(Plain {})).unwrap();
        let _ = motion::stop(State(screen.clone())).await;
        assert!(stopped.load(Ordering::SeqCst), "the job goes on");
        assert_eq!(screen.jobs.get(&waits.id).unwrap().state, JobState::Stopped);
        assert_eq!(screen.desk.state().look.as_deref(), Some("STOP was pressed"));
        // Later orders are not affected.
        let later = screen.jobs.order(Order::Check(Plain {})).unwrap();
        assert_eq!(screen.jobs.get(&later.id).unwrap().state, JobState::Queued);
    });
}

#[test]
fn stopping_one_job_waits_for_no_other_work() {
    asleep(async |screen| {
        let [one, other] = [0; 2].map(|_| screen.jobs.order(Order::Check(Plain {})).unwrap().id);
        let path = Path((one.clone(), "stop".to_owned()));
        assert!(jobs::act(State(screen.clone()), Extension(tab("a")), path).await.is_ok());
        assert_eq!(screen.jobs.get(&one).unwrap().state, JobState::Stopped);
        assert_eq!(screen.jobs.get(&other).unwrap().state, JobState::Queued);
    });
}

#[test]
fn taking_over_and_letting_go_wait_for_no_other_work() {
    asleep(async |screen| {
        let take = async |name: &str| {
            let firmly = Bytes::from_static(b"{\"firmly\":true}");
            assert!(session::take(State(screen.clone()), Extension(tab(name)), firmly).await.is_ok());
        };
        take("a").await;
        let dir = tempfile::tempdir().unwrap();
        let poses = dir.path().join("poses.csv");
        std::fs::write(&poses, "# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,2,3,0,0,0\n").unwrap();
        let link = sheetlight::arm::open(&format!("file:{}", poses.display())).unwrap();
        let guard = Guard::new(link, None, Carried::new(None, Ok(vec![])), MotionLog::default());
        screen.desk.is_armed(guard, &tab("a"));
        assert_eq!(screen.desk.state().armed.as_deref(), Some("a"));
        take("b").await;
        assert_eq!(screen.desk.state().armed, None, "the previous operator's button still moves the robot");
        assert!(session::release(State(screen.clone()), Extension(tab("b"))).await.is_ok());
        assert_eq!(screen.leases.state().holder, None);
    });
}
