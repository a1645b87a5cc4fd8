//! In: waiting jobs. Out: the same jobs, run one after the other on one thread. A panic in a job ends only that
//! job.
//! Frame and unit: seconds.

use super::jobs::{Jobs, Taken};
use super::procedures::run;
use super::run::Run;
use super::store::number_of;
use crate::web::message::JobState;
use sheetlight::fault::{Fault, Result};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Instant;

/// The worker thread.
pub struct Worker {
    jobs: Arc<Jobs>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread.
    pub fn start(jobs: Arc<Jobs>) -> Result<Worker> {
        let work = jobs.clone();
        let body = move || {
            while let Some(taken) = work.take() {
                one(&work, taken);
            }
        };
        let thread = std::thread::Builder::new().name("jobs".into()).spawn(body).map_err(|e| Fault::threads(&e))?;
        Ok(Worker { jobs, thread: Some(thread) })
    }

    /// Stops the running job and waits until it has ended.
    pub fn close(mut self) {
        self.jobs.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn one(jobs: &Arc<Jobs>, Taken { mut job, stop }: Taken) {
    let begun = Instant::now();
    let again = job.done > 0 || job.resumable || job.seconds > 0.0;
    job.state = JobState::Running;
    let number = number_of(&job.id).expect("a job's id");
    let id = job.id.clone();
    let this = Run { jobs: jobs.clone(), id, number, folder: jobs.folder(&job), again, stop: stop.clone() };
    let order = job.order.clone();
    let camera = jobs.desk.links.camera.as_ref();
    camera.inspect(|c| c.make_way(true));
    let ended = jobs.put(&job).and_then(|()| {
        if this.stopped() {
            return Err(Fault::refused("stopped before it began").next("resume it, or take it away"));
        }
        catch_unwind(AssertUnwindSafe(|| run(&this, &order))).unwrap_or_else(|panic| {
            let said = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
            Err(Fault::device(format!("the procedure ended in a bug: {}", said.unwrap_or("no message")))
                .cause("sheetlight itself; nothing half done is shown as done")
                .next("save the support file on the page Health and report it"))
        })
    });
    camera.inspect(|c| c.make_way(false));
    let stopped = stop.load(std::sync::atomic::Ordering::Relaxed);
    jobs.end(job, stopped, ended, begun.elapsed().as_secs_f64());
}
