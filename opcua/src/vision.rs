//! In: calls of clients, what the station shows. Out: requests to the station, states, results and events of the
//! vision system. The rules are the station's: this only passes them on.
//! Frame and unit: poses in mm and degrees in the station's notation.

use crate::machine::{Machine, State, Transition};
use crate::model::data::JobId;
use crate::model::ids::{self, kind, transition_of};
use crate::outlet::{Told, Value};
use crate::results::{Order, Outcome, Results, strings};
use opcua::types::Variant;
use sheetlight_registers::{Answer, Ask, Job, Seen, Station, Unanswered};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use tokio::runtime::Handle;

/// Errors of this program. Those of the station are its own numbers; all are less than 0 at the door.
pub mod error {
    pub const NOT_REACHED: i32 = 101;
    pub const ANSWER_LOST: i32 = 102;
    pub const NOT_SERVED: i32 = 103;
    pub const NOT_PREPARED: i32 = 104;
    pub const NO_SUCH_RESULT: i32 = 105;
    pub const REGISTERS: i32 = 106;
    pub const BUSY: i32 = 6;
    pub const NO_SUCH_RECIPE: i32 = 4;
    pub const NO_NAME: i32 = 1;
}

/// A refusal: its number and words.
pub type Refusal = (i32, String);

/// A scan by a robot that the client moves.
pub struct Guided {
    pub order: Order,
    pub shots: u16,
}

/// What is behind its lock.
pub struct Inner {
    pub machine: Machine,
    /// What the station shows; nothing while it is lost.
    pub seen: Option<Seen>,
    /// Why it is lost.
    pub trouble: String,
    /// A job is being ordered.
    pub starting: bool,
    /// The job that was started here and has not ended.
    pub mine: Option<Order>,
    /// The job whose result is kept, or which had ended before this program came.
    pub recorded: Option<u32>,
    /// The poses of a job are being asked for.
    pub closing: bool,
    pub guided: Option<Guided>,
    pub guided_count: u32,
    pub results: Results,
    pub refusal: Refusal,
    pub outer: Option<Transition>,
    pub inner: Option<Transition>,
}

/// Where values and events go.
type Out = Box<dyn Fn(Vec<Value>, Vec<Told>) + Send + Sync>;

/// The vision system.
pub struct Vision {
    inner: Mutex<Inner>,
    station: OnceLock<Station>,
    out: OnceLock<Out>,
    runtime: Handle,
    /// Names of recipes that are offered; empty: the station decides.
    pub recipes: Vec<String>,
}

/// Why a request came to nothing, as a refusal.
fn refused(unanswered: &Unanswered) -> Refusal {
    match unanswered {
        Unanswered::NotReached(why) => (error::NOT_REACHED, why.clone()),
        Unanswered::Lost(why) => {
            (error::ANSWER_LOST, format!("{why}: whether the request was executed is unknown, it is not repeated"))
        }
        Unanswered::Busy(why) => (error::BUSY, why.clone()),
        Unanswered::Refused(why) => (error::REGISTERS, why.clone()),
    }
}

/// An answer without an error, or the refusal.
fn good(answer: Result<Answer, Unanswered>) -> Result<Answer, Refusal> {
    match answer {
        Ok(answer) if answer.error == 0 => Ok(answer),
        Ok(answer) => Err((i32::from(answer.error), answer.words)),
        Err(unanswered) => Err(refused(&unanswered)),
    }
}

impl Vision {
    pub fn new(recipes: Vec<String>, runtime: Handle) -> Arc<Vision> {
        let inner = Inner {
            machine: Machine::default(),
            seen: None,
            trouble: "the station has not been reached yet".into(),
            starting: false,
            mine: None,
            recorded: None,
            closing: false,
            guided: None,
            guided_count: 0,
            results: Results::default(),
            refusal: (0, String::new()),
            outer: None,
            inner: None,
        };
        let (station, out) = (OnceLock::new(), OnceLock::new());
        Arc::new(Vision { inner: Mutex::new(inner), station, out, runtime, recipes })
    }

    /// Connects it with its station and its nodes, once.
    pub fn connect(&self, station: Station, out: Out) {
        let _ = self.station.set(station);
        let _ = self.out.set(out);
        let inner = self.lock();
        self.show(&inner, vec![]);
    }

    pub fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub async fn ask(&self, ask: Ask) -> Result<Answer, Refusal> {
        match self.station.get() {
            Some(station) => good(station.ask(ask).await),
            None => Err((error::NOT_REACHED, "the station has not been reached yet".into())),
        }
    }

    /// Gives the present values and some events to the nodes.
    pub fn show(&self, inner: &Inner, told: Vec<Told>) {
        if let Some(out) = self.out.get() {
            out(inner.values(&self.recipes), told);
        }
    }

    /// Keeps a refusal where clients can read its words; returns its number at the door.
    pub fn refuses(&self, (number, words): Refusal) -> i32 {
        let mut inner = self.lock();
        inner.refusal = (-number, words);
        self.show(&inner, vec![]);
        -number
    }

    /// The station shows this, or is lost.
    pub fn saw(self: &Arc<Self>, what: Result<Seen, String>) {
        let mut guard = self.lock();
        let inner = &mut *guard;
        let mut told = vec![];
        match what {
            Err(why) => {
                inner.seen = None;
                inner.trouble = why;
                inner.closing = false;
                // What a robot scanned by the client's motions is lost with the connection's request.
                inner.guided = None;
                let by = inner.machine.lost();
                inner.goes(by, &mut told);
            }
            Ok(seen) => {
                let first = inner.seen.is_none();
                if first {
                    let by = inner.machine.back();
                    inner.goes(by, &mut told);
                    inner.trouble = String::new();
                }
                let job = seen.job.clone();
                let same = inner.seen.as_ref() == Some(&seen);
                let jobs = seen.jobs;
                inner.seen = Some(seen);
                if jobs {
                    self.follows(inner, &job, first, &mut told);
                }
                if same && told.is_empty() {
                    return;
                }
            }
        }
        self.show(inner, told);
    }

    /// Follows the station's job.
    fn follows(self: &Arc<Self>, inner: &mut Inner, job: &Job, first: bool, told: &mut Vec<Told>) {
        let mine = inner.mine.as_ref().is_some_and(|order| order.job == job.number.to_string());
        if job.stage.is_under_way() {
            inner.recorded = None;
            if !inner.starting {
                let by = inner.machine.started_elsewhere();
                inner.goes(by, told);
            }
            return;
        }
        if inner.starting || inner.closing {
            return;
        }
        if job.stage.is_over() && inner.recorded != Some(job.number) {
            inner.recorded = Some(job.number);
            if mine && job.found == 1 {
                // In the state SingleExecution until its poses are here: no other job of this program comes between.
                inner.closing = true;
                self.runtime.spawn(self.clone().closes(job.clone()));
                return;
            }
            // What had ended before this program saw the station is nobody's result here.
            if mine || !first {
                let order = inner.mine.take_if(|_| mine);
                inner.keeps(Outcome::of(job.clone(), order, [None, None]), told);
            }
        }
        let by = inner.machine.ended();
        inner.goes(by, told);
    }

    /// Asks for the poses of a job that found a part, and ends it.
    async fn closes(self: Arc<Self>, job: Job) {
        let mut poses = [None, None];
        for (pose, which) in poses.iter_mut().zip([0, 2]) {
            *pose = self.ask(Ask::Give(which)).await.ok().map(|answer| answer.pose);
        }
        let mut guard = self.lock();
        let inner = &mut *guard;
        // Another job may have been started at the screen meanwhile: then the poses may be of that one.
        if inner.seen.as_ref().is_none_or(|seen| seen.job.number != job.number) {
            poses = [None, None];
        }
        let mut told = vec![];
        let order = inner.mine.take();
        inner.keeps(Outcome::of(job, order, poses), &mut told);
        inner.closing = false;
        let by = inner.machine.ended();
        inner.goes(by, &mut told);
        self.show(inner, told);
    }
}

impl Inner {
    /// Notes a transition, with the events that it has [opc-mv, tables 84 and 99].
    pub fn goes(&mut self, by: Option<Transition>, told: &mut Vec<Told>) {
        let Some(by) = by else { return };
        let row = transition_of(by);
        if row.vision {
            self.outer = Some(by);
            // The automatic mode begins anew.
            self.inner = None;
        } else {
            self.inner = Some(by);
        }
        told.push(Told::transition(row));
        let job = self.mine.as_ref().or(self.guided.as_ref().map(|g| &g.order)).map(|order| order.job.clone());
        let job = job.or_else(|| self.seen.as_ref().filter(|s| s.jobs).map(|s| s.job.number.to_string()));
        let job = JobId { id: job.unwrap_or_default().as_str().into() };
        match (row.from, row.to) {
            (ids::state::READY, ids::state::SINGLE_EXECUTION) => {
                told.push(Told::new(kind::JOB_STARTED, format!("job {} has started", job.id)).with("JobId", job));
            }
            (ids::state::SINGLE_EXECUTION, ids::state::READY) => {
                told.push(Told::new(kind::READY, "ready for a job".into()).with("JobId", job));
            }
            _ => {}
        }
    }

    /// Keeps a result and tells of it.
    pub fn keeps(&mut self, outcome: Outcome, told: &mut Vec<Told>) {
        let data = outcome.data();
        let told_of = Told::new(kind::RESULT_READY, format!("result {} is ready", outcome.id))
            .with("ResultId", data.result_id)
            .with("JobId", data.job_id)
            .with("ResultState", data.result_state)
            .with("IsPartial", data.is_partial)
            .with("InternalRecipeId", data.internal_recipe_id)
            .with("InternalConfigurationId", data.internal_configuration_id)
            .with("CreationTime", data.creation_time);
        told.push(told_of);
        self.results.keep(outcome);
    }

    /// What all variables show now.
    fn values(&self, recipes: &[String]) -> Vec<Value> {
        let state = self.machine.state();
        let outer = match state {
            State::Preoperational => ids::state::PREOPERATIONAL,
            State::Halted => ids::state::HALTED,
            State::Error => ids::state::ERROR,
            _ => ids::state::OPERATIONAL,
        };
        let inner = match state {
            State::Initialized => Some(ids::state::INITIALIZED),
            State::Ready => Some(ids::state::READY),
            State::SingleExecution => Some(ids::state::SINGLE_EXECUTION),
            _ => None,
        };
        let mut out = vec![
            Value::State { outer: true, state: Some(outer) },
            Value::State { outer: false, state: inner },
            Value::Transition { outer: true, by: self.outer },
            Value::Transition { outer: false, by: self.inner },
        ];
        let none = Seen::default();
        let seen = self.seen.as_ref().unwrap_or(&none);
        let Seen { robot, job, .. } = seen;
        let shown: [(&'static str, Variant); 19] = [
            ("Connected", self.seen.is_some().into()),
            ("Trouble", self.trouble.as_str().into()),
            ("RunsJobs", seen.jobs.into()),
            ("RobotLinked", robot.linked.into()),
            ("RobotArmed", robot.armed.into()),
            ("ScreenOperates", robot.attended.into()),
            ("RobotMoves", robot.moves.into()),
            ("SomebodyMustLook", robot.look.into()),
            ("JobNumber", job.number.into()),
            ("JobState", job.stage.word().into()),
            ("Phase", job.phase.into()),
            ("AwaitsConfirmation", job.asks.into()),
            ("JobsEnded", seen.ended.into()),
            ("Inserted", seen.inserted.into()),
            ("PreparedRecipe", self.machine.recipe().unwrap_or_default().into()),
            ("LastRefusal", self.refusal.0.into()),
            ("LastRefusalWords", self.refusal.1.as_str().into()),
            ("Shots", self.guided.as_ref().map_or(0, |guided| guided.shots).into()),
            ("Recipes", strings(recipes)),
        ];
        out.extend(shown.map(|(name, value)| Value::Shown { name, value }));
        let last = self.results.last();
        let nothing = Outcome::of(Job::default(), None, [None, None]);
        let outcome = last.unwrap_or(&nothing);
        let order = outcome.order.as_ref();
        let part = order.and_then(|o| o.part.as_ref()).map_or("", |part| part.id.as_ref());
        let heads: [(&'static str, Variant); 4] = [
            ("ResultId", last.map_or("", |o| &o.id).into()),
            ("ResultState", last.map_or(0, |o| o.state).into()),
            ("Recipe", outcome.recipe().into()),
            ("PartId", part.into()),
        ];
        let heads = heads.into_iter().chain(outcome.values());
        out.extend(heads.map(|(name, value)| Value::Result { name, value }));
        out
    }
}
