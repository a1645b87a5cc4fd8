//! In: orders, and the results of jobs. Out: the list of jobs; a change is on disk before viewers are notified.
//! Frame and unit: none.

use super::place::Place;
use super::store::{self, FORMAT, number_of};
use crate::web::event::Hub;
use crate::web::message::{Event, Frames, Job, JobState, Order, Outcome, Problem};
use crate::web::motion::Desk;
use sheetlight::fault::{Fault, Result};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Most jobs that wait.
const MOST_WAITING: usize = 32;
/// Shortest interval between progress events: a browser without a GPU spends 10 ms of a core on each frame,
/// whatever changed in it.
const TOLD: Duration = Duration::from_millis(500);

/// All jobs of a station.
pub struct Jobs {
    /// Folders of the station.
    pub place: Place,
    /// The viewers to notify.
    pub hub: Arc<Hub>,
    /// The robot's motions, and their confirmation.
    pub desk: Arc<Desk>,
    /// Frames of the running scan, or of the last one.
    pub frames: Mutex<Frames>,
    /// Held while a record on the disk is changed, so that two changes of one job do not overlap. It is taken
    /// before the state, and may be held for as long as the disk takes.
    pen: Mutex<()>,
    /// In memory only: nobody reads or writes the disk while holding it, because STOP waits for it.
    state: Mutex<State>,
    wake: Condvar,
}

struct State {
    all: BTreeMap<u32, Arc<Job>>,
    waiting: VecDeque<u32>,
    running: Option<Running>,
    /// Number of STOP presses so far: an order that is being written during one is stopped too.
    stops: u64,
    closing: bool,
}

struct Running {
    number: u32,
    stop: Arc<AtomicBool>,
    told: Instant,
}

impl State {
    /// Marks a waiting job as stopped.
    fn stopped(&mut self, number: u32) -> Option<Job> {
        let job = Arc::make_mut(self.all.get_mut(&number)?);
        (job.state, job.resumable) = (JobState::Stopped, true);
        Some(job.clone())
    }
}

/// A job that the worker takes.
pub(super) struct Taken {
    pub job: Job,
    pub stop: Arc<AtomicBool>,
}

impl Jobs {
    /// Reads the stored jobs.
    pub fn open(place: Place, hub: Arc<Hub>, desk: Arc<Desk>) -> Result<Arc<Jobs>> {
        let all = store::load(&place.jobs())?;
        let all = all.into_iter().map(|(number, job)| (number, Arc::new(job))).collect();
        let state = State { all, waiting: VecDeque::new(), running: None, stops: 0, closing: false };
        Ok(Arc::new(Jobs {
            place,
            hub,
            desk,
            frames: Mutex::default(),
            pen: Mutex::default(),
            state: Mutex::new(state),
            wake: Condvar::new(),
        }))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn pen(&self) -> MutexGuard<'_, ()> {
        self.pen.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Newest first, at most `most`.
    pub fn list(&self, most: usize) -> Vec<Job> {
        let some: Vec<Arc<Job>> = self.state().all.values().rev().take(most).cloned().collect();
        some.iter().map(|job| Job::clone(job)).collect()
    }

    /// A job by its name.
    pub fn get(&self, id: &str) -> Result<Job> {
        let found = number_of(id).and_then(|n| self.state().all.get(&n).filter(|j| j.id == id).cloned());
        found.map(|job| Job::clone(&job)).ok_or_else(|| {
            Fault::input(format!("{id:?}: is no job of this station"))
                .cause("it was taken away meanwhile")
                .next("reload the page")
        })
    }

    /// The running job.
    pub fn running(&self) -> Option<String> {
        let state = self.state();
        state.running.as_ref().and_then(|r| state.all.get(&r.number)).map(|j| j.id.clone())
    }

    /// A job's folder.
    pub fn folder(&self, job: &Job) -> PathBuf {
        self.place.jobs().join(&job.id)
    }

    /// Accepts an order. Returns an error if too many jobs wait, or if the record cannot be written.
    pub fn order(&self, order: Order) -> Result<Job> {
        let _pen = self.pen();
        self.ordered(order)
    }

    /// The same, if no job runs or waits.
    ///
    /// # Errors
    /// A job runs or waits, of kind refused; the record cannot be written.
    pub fn order_alone(&self, order: Order) -> Result<Job> {
        let _pen = self.pen();
        if let Some(busy) = self.busy() {
            return Err(Fault::refused(format!("{busy} runs or waits")).next("wait until it has ended, or stop it"));
        }
        self.ordered(order)
    }

    /// A job that runs or waits.
    pub fn busy(&self) -> Option<String> {
        let state = self.state();
        let number = state.running.as_ref().map(|r| r.number).or(state.waiting.front().copied())?;
        state.all.get(&number).map(|job| job.id.clone())
    }

    /// Writes and queues an order; the caller holds the pen.
    fn ordered(&self, order: Order) -> Result<Job> {
        let state = self.state();
        if state.waiting.len() >= MOST_WAITING {
            return Err(
                Fault::refused(format!("{MOST_WAITING} jobs wait already")).next("wait for some of them, or stop them")
            );
        }
        let number = state.all.keys().next_back().map_or(1, |n| n + 1);
        let stops = state.stops;
        drop(state);
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
        self.queue(job, stops)
    }

    /// Resumes a job that was cut off or stopped; `back_out`: an insertion retracts instead.
    pub fn resume(&self, id: &str, back_out: bool) -> Result<Job> {
        // Checked and queued under one lock, so that a repeated request queues the job once.
        let _pen = self.pen();
        let stops = self.state().stops;
        let mut job = self.get(id)?;
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
        self.queue(job, stops)
    }

    /// Writes a job's record and queues it; the caller holds the pen. If STOP was pressed since `stops` was read,
    /// the job is stopped instead.
    fn queue(&self, mut job: Job, stops: u64) -> Result<Job> {
        store::save(&self.place.jobs(), &job)?;
        let number = number_of(&job.id).expect("a job's id");
        let mut state = self.state();
        state.all.insert(number, Arc::new(job.clone()));
        if state.stops == stops {
            state.waiting.push_back(number);
        } else {
            job = state.stopped(number).expect("just put there");
        }
        drop(state);
        if job.state == JobState::Stopped {
            store::save(&self.place.jobs(), &job)?;
        }
        self.tell(&job);
        self.wake.notify_all();
        Ok(job)
    }

    /// STOP: ends the running job and stops the waiting ones, at once and in memory; finished steps stay stored.
    /// Returns the names of those whose records must be written ([`Jobs::keep`]).
    pub fn stop_all(&self) -> Vec<String> {
        let mut state = self.state();
        state.stops += 1;
        if let Some(r) = &state.running {
            r.stop.store(true, Ordering::SeqCst);
        }
        let waiting = std::mem::take(&mut state.waiting);
        let stopped: Vec<Job> = waiting.into_iter().filter_map(|number| state.stopped(number)).collect();
        drop(state);
        // After the flag is set, so that a job that takes the robot only now sees it.
        self.desk.stop();
        stopped.iter().for_each(|job| self.tell(job));
        stopped.into_iter().map(|job| job.id).collect()
    }

    /// Stops a running or waiting job in the same way; finished steps stay stored.
    pub fn stop(&self, id: &str) -> Result<Job> {
        let job = self.get(id)?;
        let number = number_of(id).expect("a job's id");
        let mut state = self.state();
        if let Some(r) = state.running.as_ref().filter(|r| r.number == number) {
            r.stop.store(true, Ordering::SeqCst);
            drop(state);
            self.desk.stop_job(id);
            return Ok(job);
        }
        let waited = state.waiting.len();
        state.waiting.retain(|n| *n != number);
        let stopped = if state.waiting.len() < waited { state.stopped(number) } else { None };
        drop(state);
        let stopped = stopped
            .ok_or_else(|| Fault::usage(format!("{id}: neither runs nor waits")).next("nothing is to be stopped"))?;
        self.tell(&stopped);
        Ok(stopped)
    }

    /// Writes jobs' records in their present state. If one cannot be written, the job reports that; after a restart
    /// it counts as cut off.
    pub fn keep(&self, ids: &[String]) {
        let _pen = self.pen();
        for mut job in ids.iter().filter_map(|id| self.get(id).ok()) {
            if let Err(fault) = store::save(&self.place.jobs(), &job) {
                job.problem = Some(Problem::from(&fault));
                self.set(&job);
            }
        }
    }

    /// Removes a job and its files. Returns an error while it runs or waits.
    pub fn remove(&self, id: &str) -> Result<()> {
        // Under the pen, so that nobody resumes the job while its files are removed.
        let _pen = self.pen();
        let job = self.get(id)?;
        if matches!(job.state, JobState::Running | JobState::Queued) {
            return Err(Fault::usage(format!("{id}: runs or waits")).next("stop it first"));
        }
        let folder = self.folder(&job);
        sheetlight::files::remove(&folder).map_err(|e| Fault::write(&folder, e))?;
        self.state().all.remove(&number_of(id).expect("a job's id"));
        self.hub.tell(&Event::Gone(id.to_owned()));
        Ok(())
    }

    /// Stores a job's record and notifies viewers. Returns an error if the job was removed meanwhile, or the record
    /// cannot be written.
    pub(super) fn put(&self, job: &Job) -> Result<()> {
        let _pen = self.pen();
        self.get(&job.id)?;
        store::save(&self.place.jobs(), job)?;
        self.set(job);
        Ok(())
    }

    /// Changes a job in memory and notifies viewers.
    fn set(&self, job: &Job) {
        self.state().all.insert(number_of(&job.id).expect("a job's id"), Arc::new(job.clone()));
        self.tell(job);
    }

    fn tell(&self, job: &Job) {
        self.hub.tell(&Event::Job(Box::new(job.clone())));
    }

    /// The next waiting job; blocks until there is one. `None` when the program ends.
    pub(super) fn take(&self) -> Option<Taken> {
        let mut state = self.state();
        loop {
            if state.closing {
                return None;
            }
            if let Some(number) = state.waiting.pop_front() {
                // A job that was removed meanwhile is skipped.
                let Some(job) = state.all.get(&number).cloned() else { continue };
                let stop = Arc::new(AtomicBool::new(false));
                state.running = Some(Running { number, stop: stop.clone(), told: Instant::now() });
                return Some(Taken { job: Job::clone(&job), stop });
            }
            state = self.wake.wait(state).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Records the progress of the running job, only in memory: procedures write their own checkpoints.
    pub(super) fn progress(&self, done: usize, of: Option<usize>) {
        let mut state = self.state();
        let Some(running) = &mut state.running else { return };
        let number = running.number;
        let tell = running.told.elapsed() > TOLD || of == Some(done);
        if tell {
            running.told = Instant::now();
        }
        let Some(job) = state.all.get_mut(&number) else { return };
        let now = Arc::make_mut(job);
        (now.done, now.of) = (done, of);
        let job = job.clone();
        drop(state);
        if tell {
            self.tell(&job);
        }
    }

    /// Stores the result of the running job.
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
            // The disk for the record is full or gone: at least the viewers are notified.
            (job.state, job.problem) = (JobState::Failed, Some(Problem::from(&fault)));
            self.set(&job);
        }
    }

    /// Ends the worker: the running job is stopped and can be resumed.
    pub fn close(&self) {
        let mut state = self.state();
        state.closing = true;
        if let Some(r) = &state.running {
            r.stop.store(true, Ordering::SeqCst);
        }
        drop(state);
        // Switches off an output that is being tried before the program ends.
        self.desk.stop();
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

    /// STOP acts and pages are answered even while a record is being written, however long the disk takes. An order
    /// that is being written is stopped too.
    #[test]
    fn stop_and_lists_do_not_wait_for_the_disk() {
        let dir = tempfile::tempdir().unwrap();
        let jobs = jobs(dir.path());
        let waits = jobs.order(Order::Check(Plain {})).unwrap();
        let runs = jobs.take().unwrap();
        let queued = jobs.order(Order::Check(Plain {})).unwrap();
        let at_the_disk = jobs.pen();
        let stops = jobs.state().stops;
        let (tell, told) = std::sync::mpsc::channel();
        std::thread::spawn({
            let jobs = jobs.clone();
            move || tell.send((jobs.stop_all(), jobs.list(10)))
        });
        let (stopped, list) = told.recv_timeout(Duration::from_secs(20)).expect("it waits for the disk");
        assert!(runs.stop.load(Ordering::SeqCst) && runs.job.id == waits.id);
        assert_eq!((stopped.as_slice(), list[0].state), (&[queued.id.clone()][..], JobState::Stopped));
        let late = Job { id: "0009-check".into(), ..queued.clone() };
        assert_eq!(jobs.queue(late, stops).unwrap().state, JobState::Stopped);
        assert!(jobs.state().waiting.is_empty());
        drop(at_the_disk);
        jobs.keep(&stopped);
        let of = |id: &str| std::fs::read_to_string(dir.path().join("jobs").join(id).join("job.json")).unwrap();
        assert!(of(&queued.id).contains("\"stopped\"") && of("0009-check").contains("\"stopped\""));
    }

    /// If a job is resumed and removed at the same time, one request fails, and a queued job exists.
    #[test]
    fn a_job_is_not_taken_away_while_it_is_resumed() {
        let dir = tempfile::tempdir().unwrap();
        let jobs = jobs(dir.path());
        for _ in 0..30 {
            let job = jobs.order(Order::Check(Plain {})).unwrap();
            jobs.stop(&job.id).unwrap();
            let files = jobs.folder(&job).join("files");
            std::fs::create_dir(&files).unwrap();
            (0..50).for_each(|k| std::fs::write(files.join(k.to_string()), "").unwrap());
            let (resumed, removed) = std::thread::scope(|scope| {
                let resumes = scope.spawn(|| jobs.resume(&job.id, false).is_ok());
                let removes = scope.spawn(|| jobs.remove(&job.id).is_ok());
                (resumes.join().unwrap(), removes.join().unwrap())
            });
            assert!(resumed != removed, "resumed {resumed}, removed {removed}");
            assert_eq!(jobs.folder(&job).exists(), resumed);
            assert_eq!(jobs.state().waiting.pop_front().is_some(), resumed);
        }
    }

    /// An order that must be alone is refused while another job waits or runs.
    #[test]
    fn an_order_that_must_be_alone_is_alone() {
        let dir = tempfile::tempdir().unwrap();
        let jobs = jobs(dir.path());
        let first = jobs.order_alone(Order::Check(Plain {})).unwrap();
        let refused = |jobs: &Jobs| jobs.order_alone(Order::Check(Plain {})).unwrap_err().what;
        assert_eq!(refused(&jobs), "0001-check runs or waits");
        let taken = jobs.take().unwrap();
        assert_eq!((refused(&jobs).as_str(), jobs.busy()), ("0001-check runs or waits", Some(first.id)));
        jobs.end(taken.job, false, Err(Fault::refused("over").next("again")), 1.0);
        let both = std::thread::scope(|scope| {
            let ask = || scope.spawn(|| jobs.order_alone(Order::Check(Plain {})).is_ok());
            let both = [ask(), ask()];
            both.map(|asked| asked.join().unwrap())
        });
        assert_eq!(both.iter().filter(|ok| **ok).count(), 1);
        assert_eq!(jobs.list(10).len(), 2);
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
