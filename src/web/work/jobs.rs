//! In: orders, and what becomes of them. Out: the list of jobs, on disk before anybody is told.
//! Frame and unit: none; at most so many jobs as the limit says.

use super::place::Place;
use super::store::{self, FORMAT, number_of};
use crate::fault::{Fault, Result};
use crate::web::event::Hub;
use crate::web::message::{Event, Frames, Job, JobState, Order, Outcome, Problem};
use crate::web::motion::Desk;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Jobs that wait.
const MOST_WAITING: usize = 32;
/// Pages are told of progress this often at most: a browser without a GPU spends 10 ms of a core on each frame,
/// whatever changed in it.
const TOLD: Duration = Duration::from_millis(500);

/// All jobs of a station.
pub struct Jobs {
    /// Where things lie.
    pub place: Place,
    /// Who is told.
    pub hub: Arc<Hub>,
    /// What moves the robot, and who confirms it.
    pub desk: Arc<Desk>,
    /// Frames of the scan that runs, or of the last one.
    pub frames: Mutex<Frames>,
    state: Mutex<State>,
    wake: Condvar,
}

struct State {
    all: BTreeMap<u32, Job>,
    waiting: VecDeque<u32>,
    running: Option<Running>,
    closing: bool,
}

struct Running {
    number: u32,
    stop: Arc<AtomicBool>,
    told: Instant,
}

/// What the worker takes up.
pub(super) struct Taken {
    pub job: Job,
    pub stop: Arc<AtomicBool>,
}

impl Jobs {
    /// Reads what there is.
    pub fn open(place: Place, hub: Arc<Hub>, desk: Arc<Desk>) -> Result<Arc<Jobs>> {
        let all = store::load(&place.jobs())?;
        let state = State { all, waiting: VecDeque::new(), running: None, closing: false };
        Ok(Arc::new(Jobs {
            place,
            hub,
            desk,
            frames: Mutex::default(),
            state: Mutex::new(state),
            wake: Condvar::new(),
        }))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Newest first, at most `most`.
    pub fn list(&self, most: usize) -> Vec<Job> {
        self.state().all.values().rev().take(most).cloned().collect()
    }

    /// One of them.
    pub fn get(&self, id: &str) -> Result<Job> {
        let found = number_of(id).and_then(|n| self.state().all.get(&n).filter(|j| j.id == id).cloned());
        found.ok_or_else(|| {
            Fault::input(format!("{id:?}: is not a job of this station"))
                .cause("it was taken away meanwhile")
                .next("reload the page")
        })
    }

    /// The job that runs.
    pub fn running(&self) -> Option<String> {
        let state = self.state();
        state.running.as_ref().and_then(|r| state.all.get(&r.number)).map(|j| j.id.clone())
    }

    /// A job's own folder.
    pub fn folder(&self, job: &Job) -> PathBuf {
        self.place.jobs().join(&job.id)
    }

    /// Takes an order. Errors: too many wait; the disk.
    pub fn order(&self, order: Order) -> Result<Job> {
        let mut state = self.state();
        if state.waiting.len() >= MOST_WAITING {
            return Err(
                Fault::refused(format!("{MOST_WAITING} jobs wait already")).next("wait for some of them, or stop them")
            );
        }
        let number = state.all.keys().next_back().map_or(1, |n| n + 1);
        let job = Job {
            format: FORMAT,
            id: format!("{number:04}-{}", order.word()),
            order,
            state: JobState::Queued,
            done: 0,
            of: None,
            created: jiff::Timestamp::now().to_string(),
            seconds: 0.0,
            problem: None,
            outcome: None,
            resumable: false,
        };
        store::save(&self.place.jobs(), &job)?;
        state.all.insert(number, job.clone());
        state.waiting.push_back(number);
        drop(state);
        self.tell(&job);
        self.wake.notify_all();
        Ok(job)
    }

    /// Goes on with a job that was cut off or stopped; `back_out`: an insertion goes back up instead.
    pub fn resume(&self, id: &str, back_out: bool) -> Result<Job> {
        let mut job = self.get(id)?;
        let number = number_of(id).expect("a job's id");
        // Looked at and queued under one lock: a request that comes twice queues the job once.
        let mut state = self.state();
        job.state = state.all.get(&number).map_or(JobState::Done, |j| j.state);
        if back_out && !matches!(job.order, Order::Insert(_)) {
            return Err(
                Fault::usage(format!("{id}: moves no robot, so it cannot back out")).next("take it away, or resume it")
            );
        }
        if !matches!(job.state, JobState::CutOff | JobState::Stopped | JobState::Failed) {
            return Err(
                Fault::usage(format!("{id}: is {:?}, nothing is left to go on with", job.state)).next("order it again")
            );
        }
        if let Order::Insert(ask) = &mut job.order {
            ask.back_out = back_out;
        }
        (job.state, job.problem, job.outcome) = (JobState::Queued, None, None);
        store::save(&self.place.jobs(), &job)?;
        state.all.insert(number, job.clone());
        state.waiting.push_back(number);
        drop(state);
        self.tell(&job);
        self.wake.notify_all();
        Ok(job)
    }

    /// Stops a job that runs or waits; what it did is kept.
    pub fn stop(&self, id: &str) -> Result<Job> {
        let mut job = self.get(id)?;
        let number = number_of(id).expect("a job's id");
        let mut state = self.state();
        if let Some(r) = state.running.as_ref().filter(|r| r.number == number) {
            r.stop.store(true, Ordering::Relaxed);
            drop(state);
            if job.order.moves() {
                self.desk.stop();
            }
            return Ok(job);
        }
        let waited = state.waiting.len();
        state.waiting.retain(|n| *n != number);
        if state.waiting.len() == waited {
            return Err(Fault::usage(format!("{id}: neither runs nor waits")).next("nothing is to be stopped"));
        }
        drop(state);
        job.state = JobState::Stopped;
        job.resumable = true;
        self.put(&job)?;
        Ok(job)
    }

    /// Takes a job and its files away; refused while it runs or waits.
    pub fn remove(&self, id: &str) -> Result<()> {
        let job = self.get(id)?;
        if matches!(job.state, JobState::Running | JobState::Queued) {
            return Err(Fault::usage(format!("{id}: runs or waits")).next("stop it first"));
        }
        let folder = self.folder(&job);
        crate::files::remove(&folder).map_err(|e| Fault::write(&folder, e))?;
        self.state().all.remove(&number_of(id).expect("a job's id"));
        self.hub.tell(&Event::Gone(id.to_owned()));
        Ok(())
    }

    /// Keeps a job's record and tells of it.
    pub(super) fn put(&self, job: &Job) -> Result<()> {
        store::save(&self.place.jobs(), job)?;
        self.state().all.insert(number_of(&job.id).expect("a job's id"), job.clone());
        self.tell(job);
        Ok(())
    }

    fn tell(&self, job: &Job) {
        self.hub.tell(&Event::Job(Box::new(job.clone())));
    }

    /// The next one that waits; waits for one; `None` when the program ends.
    pub(super) fn take(&self) -> Option<Taken> {
        let mut state = self.state();
        loop {
            if state.closing {
                return None;
            }
            if let Some(number) = state.waiting.pop_front() {
                // A job whose folder vanished is not begun.
                let Some(job) = state.all.get(&number).cloned() else { continue };
                let stop = Arc::new(AtomicBool::new(false));
                state.running = Some(Running { number, stop: stop.clone(), told: Instant::now() });
                return Some(Taken { job, stop });
            }
            state = self.wake.wait(state).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// How far the running job is; in memory alone, because procedures keep their own checkpoints.
    pub(super) fn progress(&self, done: usize, of: Option<usize>) {
        let mut state = self.state();
        let Some(running) = &mut state.running else { return };
        let number = running.number;
        let tell = running.told.elapsed() > TOLD || of == Some(done);
        if tell {
            running.told = Instant::now();
        }
        let Some(job) = state.all.get_mut(&number) else { return };
        (job.done, job.of) = (done, of);
        let job = job.clone();
        drop(state);
        if tell {
            self.tell(&job);
        }
    }

    /// The running job ended.
    pub(super) fn end(&self, mut job: Job, stopped: bool, ended: Result<Outcome>, seconds: f64) {
        let now = self.get(&job.id).unwrap_or_else(|_| job.clone());
        (job.done, job.of) = (now.done, now.of);
        job.seconds += seconds;
        match ended {
            Ok(outcome) => (job.state, job.outcome, job.resumable) = (JobState::Done, Some(outcome), false),
            Err(fault) => {
                job.state = if stopped { JobState::Stopped } else { JobState::Failed };
                job.resumable = super::resumes::resumes(&self.folder(&job), &job.order, stopped);
                job.problem = Some(Problem::from(&fault));
            }
        }
        self.state().running = None;
        if let Err(fault) = self.put(&job) {
            // The disk that the record belongs on is full or gone: those who look on hear it at least.
            (job.state, job.problem) = (JobState::Failed, Some(Problem::from(&fault)));
            self.tell(&job);
            self.state().all.insert(number_of(&job.id).expect("a job's id"), job);
        }
    }

    /// Ends the worker: the job that runs is stopped and can be resumed.
    pub fn close(&self) {
        let mut state = self.state();
        state.closing = true;
        if let Some(r) = &state.running {
            r.stop.store(true, Ordering::Relaxed);
        }
        drop(state);
        self.wake.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::web::message::{Mode, Plain};
    use crate::web::motion::Links;

    fn jobs(folder: &std::path::Path) -> Arc<Jobs> {
        let hub = Arc::new(Hub::default());
        let desk = Arc::new(Desk::new(Links { station: folder.to_owned(), ..Links::default() }, hub.clone()));
        let place = Place { station: folder.to_owned(), recordings: folder.to_owned(), mode: Mode::Replay };
        std::fs::create_dir_all(place.jobs()).unwrap();
        Jobs::open(place, hub, desk).unwrap()
    }

    #[test]
    fn a_request_to_resume_that_comes_twice_queues_the_job_once() {
        let dir = tempfile::tempdir().unwrap();
        let jobs = jobs(dir.path());
        let job = jobs.order(Order::Check(Plain {})).unwrap();
        jobs.stop(&job.id).unwrap();
        let both = std::thread::scope(|scope| {
            let ask = || scope.spawn(|| jobs.resume(&job.id, false).is_ok());
            let both = [ask(), ask()];
            both.map(|asked| asked.join().unwrap())
        });
        assert_eq!(both.iter().filter(|ok| **ok).count(), 1);
        assert_eq!(jobs.state().waiting.len(), 1);
    }

    #[test]
    fn a_job_whose_record_vanished_is_not_left_running() {
        let dir = tempfile::tempdir().unwrap();
        let jobs = jobs(dir.path());
        let gone = jobs.order(Order::Check(Plain {})).unwrap();
        let next = jobs.order(Order::Check(Plain {})).unwrap();
        jobs.state().all.remove(&number_of(&gone.id).unwrap());
        assert_eq!(jobs.take().unwrap().job.id, next.id);
        assert_eq!(jobs.running(), Some(next.id));
    }
}
