//! In: requests from registers, the screen's state. Out: jobs that are ordered under the conditions of the screen;
//! what the registers show.
//! Frame and unit: poses in a notation; s.

use super::job::{Stored, has_ended, is_of_parts, procedure, shown, stored};
use super::recording::{taken, target};
use crate::web::message::{CalibrateOrder, FindOrder, InsertOrder, Job, JobState, Order, ScanOrder};
use crate::web::screen::{JOBS, Screen};
use crate::web::work::{Place, recipe_named};
use sheetlight::fault::{Fault, Kind};
use sheetlight::robot::Convention;
use sheetlight::station::Settings;
use sheetlight::station::socket::words::{Code, Of, Reply, Request, Target, Which, Wrong};
use sheetlight::station::socket::{Executor, RobotShown, Shown, Traffic};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Name of this door among the links.
pub const MODBUS: &str = "modbus";
/// Interval at which the state of a running job is read from the disk.
const READ_AGAIN: Duration = Duration::from_millis(200);
/// Most jobs that are ordered in a minute: each makes a folder.
const MOST_JOBS: usize = 30;
const A_MINUTE: Duration = Duration::from_secs(60);

/// What stands behind the registers of a station.
pub(super) struct Plc {
    screen: Arc<Screen>,
    notation: Convention,
    /// The job that is shown: the one that runs, or the last one.
    job: Option<String>,
    /// Its end is counted.
    counted: bool,
    ended: u16,
    inserted: u16,
    /// What was read of that job, in which state, and when.
    read: Option<(JobState, Instant)>,
    stored: Stored,
    /// When the last jobs were ordered.
    ordered: VecDeque<Instant>,
}

/// A fault in what a request names: no name, or nothing has it.
fn named(fault: &Fault) -> Wrong {
    match fault.kind {
        Kind::Usage => Wrong::new(Code::Word, fault.what.clone()),
        Kind::Input => Wrong::new(Code::Refused, fault.what.clone()),
        _ => ours(fault),
    }
}

/// A fault of ours as an answer.
fn ours(fault: &Fault) -> Wrong {
    let code = match fault.kind {
        Kind::Refused => Code::Refused,
        Kind::Device => Code::Failed,
        Kind::Output => Code::Full,
        Kind::Input | Kind::Usage => Code::Station,
    };
    Wrong::new(code, fault.what.clone())
}

impl Plc {
    /// Shows the last job of the kinds that registers order.
    pub fn new(screen: Arc<Screen>, notation: Convention) -> Plc {
        let job = screen.jobs.list(JOBS).into_iter().find(|job| procedure(&job.order).is_some());
        Plc {
            screen,
            notation,
            counted: job.as_ref().is_none_or(has_ended),
            job: job.map(|job| job.id),
            ended: 0,
            inserted: 0,
            read: None,
            stored: Stored::default(),
            ordered: VecDeque::new(),
        }
    }

    /// The job that is shown, as it is now.
    fn present(&self) -> Option<Job> {
        self.screen.jobs.get(self.job.as_deref()?).ok()
    }

    /// Shows another job from now on.
    fn take(&mut self, id: String) {
        (self.job, self.counted, self.read, self.stored) = (Some(id), false, None, Stored::default());
    }

    /// Shows the job that runs, counts it when it has ended, and reads what it has stored. A scan or calibration of the
    /// screen does not take the place of a part that a PLC may still ask for.
    fn follow(&mut self) -> Option<Job> {
        let jobs = &self.screen.jobs;
        let running = jobs.running().and_then(|id| jobs.get(&id).ok());
        let is_shown = |job: &Job| self.job.as_ref() == Some(&job.id);
        if let Some(job) = running
            && if is_shown(&job) { self.counted } else { is_of_parts(&job.order) }
        {
            self.take(job.id);
        }
        let job = self.present()?;
        let known =
            self.read.is_some_and(|(state, at)| state == job.state && (has_ended(&job) || at.elapsed() < READ_AGAIN));
        if !known {
            self.stored = stored(&self.screen.jobs, &job);
            self.read = Some((job.state, Instant::now()));
        }
        if has_ended(&job) && !self.counted {
            self.counted = true;
            self.ended = self.ended.wrapping_add(1);
            let inserted = job.state == JobState::Done && matches!(job.order, Order::Insert(_));
            self.inserted = self.inserted.wrapping_add(u16::from(inserted));
        }
        Some(job)
    }

    /// Whether a person is there, as the screen demands it of whoever orders. For what moves the robot it is the
    /// person who armed it.
    fn attended(&self, moves: bool) -> Result<(), Wrong> {
        let screen = &self.screen;
        if !moves {
            return match screen.leases.state().holder {
                Some(_) => Ok(()),
                None => Err(Wrong::new(Code::Unattended, "no screen operates: press Operate there")),
            };
        }
        let Some(tab) = screen.desk.armed_by() else {
            let (code, why) = match (screen.desk.armed(), &screen.desk.links.robot) {
                (true, _) => (Code::Unattended, "another screen operates than the one that armed the robot"),
                (false, Some(_)) => (Code::Unarmed, "the robot is not armed: press Arm on the screen"),
                (false, None) => (Code::Unarmed, "no robot: the screen was served without --robot"),
            };
            return Err(Wrong::new(code, why));
        };
        if let Some(why) = screen.desk.state().look {
            return Err(Wrong::new(Code::Look, format!("somebody has to look at the robot first: {why}")));
        }
        if !screen.leases.holds(&tab) {
            let what = format!("screen {} armed the robot and was idle for 60 s: press Operate there", tab.short());
            return Err(Wrong::new(Code::Unattended, what));
        }
        Ok(())
    }

    /// Orders the job that `make` makes, if the screen would take it now and no other one runs or waits.
    fn order(&mut self, moves: bool, make: impl FnOnce(&Place) -> Result<Order, Fault>) -> Result<Reply, Wrong> {
        if let Some(busy) = self.screen.jobs.busy() {
            return Err(Wrong::new(Code::Busy, format!("{busy} runs or waits")));
        }
        self.attended(moves)?;
        while self.ordered.front().is_some_and(|at| at.elapsed() > A_MINUTE) {
            self.ordered.pop_front();
        }
        if self.ordered.len() >= MOST_JOBS {
            let what = format!("{MOST_JOBS} jobs were ordered in the last minute, no more are taken");
            return Err(Wrong::new(Code::Busy, what));
        }
        let order = make(&self.screen.place).map_err(|fault| named(&fault))?;
        // What ended since the last look is counted before another job takes its place.
        self.follow();
        let job = self.screen.jobs.order_alone(order).map_err(|fault| match fault.kind {
            Kind::Refused => Wrong::new(Code::Busy, fault.what),
            _ => ours(&fault),
        })?;
        self.ordered.push_back(Instant::now());
        self.take(job.id.clone());
        Ok(Reply::Ordered(job.id))
    }

    /// Looks for a part in the last finished scan.
    fn find(&mut self, recipe: String) -> Result<Reply, Wrong> {
        let scanned = |job: &Job| matches!((&job.order, job.state), (Order::Scan(_), JobState::Done));
        let scan = self.screen.jobs.list(JOBS).into_iter().find(scanned);
        let scan =
            scan.ok_or_else(|| Wrong::new(Code::Order, "no scan is finished: SCAN first, or scan on the screen"))?;
        self.order(false, |place| {
            recipe_named(place, &recipe)?;
            Ok(Order::Find(FindOrder { scans: vec![scan.id], recipe, ..FindOrder::default() }))
        })
    }

    fn insert(&mut self, recipe: String, sweep_mm: Option<f64>) -> Result<Reply, Wrong> {
        self.order(true, |place| {
            recipe_named(place, &recipe)?;
            Ok(Order::Insert(InsertOrder { recipe, sweep_mm, ..InsertOrder::default() }))
        })
    }

    /// Scans a recording with the station's settings.
    fn scan(&mut self, recording: Option<String>) -> Result<Reply, Wrong> {
        self.order(false, |place| {
            let recording = taken(place, recording, "scan", "the laser line")?;
            Ok(Order::Scan(ScanOrder { recording, ..ScanOrder::default() }))
        })
    }

    /// Calibrates from a recording. A person accepts the result at the screen, or not.
    fn calibrate(&mut self, of: Target, recording: Option<String>) -> Result<Reply, Wrong> {
        self.order(false, |place| {
            let target = target(of);
            let recording = taken(place, recording, target.into(), "boards that suits this calibration")?;
            Ok(Order::Calibrate(CalibrateOrder::new(target, recording)))
        })
    }

    fn give(&mut self, which: Which, of: Of) -> Result<Reply, Wrong> {
        self.follow();
        let Some(part) = &self.stored.part else {
            return Err(Wrong::new(Code::Order, "the job has found nothing yet: INSERT or FIND, then GIVE"));
        };
        let tool = Settings::load(&self.screen.place.station).map_err(|fault| ours(&fault))?.tool;
        part.give(which, of, tool, self.notation).map(Reply::Pose)
    }
}

impl Executor for Plc {
    fn notation(&self) -> Convention {
        self.notation
    }

    fn jobs(&self) -> bool {
        true
    }

    /// Jobs are the station's: another PLC sees the same.
    fn afresh(&mut self) {}

    fn done(&mut self, request: Request) -> Result<Reply, Wrong> {
        match request {
            Request::Insert { recipe, sweep_mm } => self.insert(recipe, sweep_mm),
            Request::Scan(recording) => self.scan(recording),
            Request::Calibrate(target, recording) => self.calibrate(target, recording),
            Request::Find(recipe) => self.find(recipe),
            Request::Give(which, of) => self.give(which, of),
            // As every viewer may.
            Request::Stop => {
                let stopped = self.screen.jobs.stop_all();
                self.screen.jobs.keep(&stopped);
                Ok(Reply::Stopped)
            }
            Request::Pose(_) => {
                Err(Wrong::new(Code::Order, "here the station moves the robot: INSERT scans, finds and inserts"))
            }
            Request::Hello | Request::Status | Request::Bye => {
                Err(Wrong::new(Code::Word, "registers have no such request"))
            }
        }
    }

    fn state(&mut self) -> Reply {
        match &self.stored.part {
            _ if self.screen.jobs.busy().is_some() => Reply::Works,
            Some(part) if part.poses.is_some() => Reply::Found(part.recipe.clone()),
            _ => Reply::Idle,
        }
    }

    fn shown(&mut self) -> Shown {
        let motion = self.screen.desk.state();
        let job = self.follow();
        let armed_by = self.screen.desk.armed_by();
        let robot = RobotShown {
            linked: self.screen.robot().is_some_and(|robot| robot.seen().state.is_some()),
            armed: motion.armed.is_some(),
            attended: armed_by.is_some_and(|tab| self.screen.leases.holds(&tab)),
            moves: motion.moving,
            look: motion.look.is_some(),
        };
        let job = job.and_then(|job| shown(&job, &self.stored, &motion, self.notation));
        Shown { robot, job, ended: self.ended, inserted: self.inserted }
    }

    fn heard(&mut self, traffic: Traffic) {
        self.screen.hub.link(MODBUS, |link| {
            (link.peers, link.sent, link.lost) = (traffic.peers, traffic.answered, traffic.refused);
            link.last_error = traffic.last_error;
        });
    }
}
