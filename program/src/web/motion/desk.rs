//! The operator's desk: who uses the robot, and what halts it. Slow work (controller, disk) is done without holding
//! the desk's lock.

use super::brake::Brake;
use super::grants::Grants;
use super::simulated::SimulatedRobot;
use super::state::{At, Robot, Step, Told};
use crate::web::camera::Camera;
use crate::web::event::Hub;
use crate::web::guard::Tab;
use crate::web::message::{Event, MotionState};
use crate::web::robot::Robot as Watched;
use sheetlight::arm::rules::Guard;
use sheetlight::fault::{Fault, Result};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Most lines of a job's messages that are stored.
const MOST_SAID: usize = 60;

/// Connections and permissions of a screen.
#[derive(Default)]
pub struct Links {
    /// The station's folder: [motion], [tool], the log of motions.
    pub station: PathBuf,
    /// The robot's URI.
    pub robot: Option<String>,
    /// The robot may be moved.
    pub may_move: bool,
    /// State of that robot, polled continuously.
    pub watched: Option<Arc<Watched>>,
    /// The camera.
    pub camera: Option<Arc<Camera>>,
    /// The simulated cell to which robot and camera belong, if it is one.
    pub simulated: Option<SimulatedRobot>,
    /// Ends the program.
    pub stop: Arc<AtomicBool>,
}

/// The desk of a screen.
pub struct Desk {
    /// The available connections.
    pub links: Links,
    hub: Arc<Hub>,
    pub(super) grants: Grants,
    /// What STOP needs, outside the desk's lock.
    pub(super) brake: Brake,
    at: Mutex<At>,
    pub(super) wake: Condvar,
}

/// Error for a request for the robot while it is in use.
fn in_use(robot: &Robot) -> Fault {
    match robot {
        Robot::Job(_) => Fault::refused("a job has the robot").next("wait until it has ended, or stop it"),
        _ => Fault::refused("the robot is in use")
            .cause("an output is tried, or the controller is asked for the arm's pose")
            .next("wait a moment, or press STOP"),
    }
}

impl Desk {
    /// A desk with nothing armed.
    pub fn new(links: Links, hub: Arc<Hub>) -> Desk {
        let (grants, brake) = (Grants::default(), Brake::default());
        Desk { links, hub, grants, brake, at: Mutex::default(), wake: Condvar::new() }
    }

    pub(super) fn at(&self) -> MutexGuard<'_, At> {
        self.at.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The current state.
    pub fn state(&self) -> MotionState {
        self.seen(&self.at())
    }

    pub(super) fn seen(&self, at: &At) -> MotionState {
        let Told { job, said, silence_ms, expected } = at.told.clone();
        MotionState {
            robot: self.links.robot.is_some(),
            may_move: self.links.may_move,
            armed: at.by.as_ref().filter(|_| at.armed()).map(Tab::short),
            moving: at.moves(),
            look: self.brake.look(),
            job,
            asked: at.asked().cloned(),
            said,
            silence_ms,
            expected,
            simulated: self.links.simulated.as_ref().map(SimulatedRobot::state),
        }
    }

    pub(super) fn tell(&self, at: &At) {
        self.hub.tell(&Event::Motion(Box::new(self.seen(at))));
    }

    /// Sends the state to all viewers.
    pub fn told(&self) -> MotionState {
        let at = self.at();
        self.tell(&at);
        self.seen(&at)
    }

    /// Whether a job has the robot.
    pub fn has_job(&self) -> bool {
        matches!(self.at().robot, Robot::Job(_))
    }

    /// Whether the robot is armed.
    pub fn armed(&self) -> bool {
        self.at().armed()
    }

    /// The tab that armed the robot; `None`: it is not armed, or another tab has taken over since.
    pub fn armed_by(&self) -> Option<Tab> {
        let at = self.at();
        at.by.clone().filter(|_| at.armed())
    }

    /// Takes the guard for a job, or for a request (`None`), until [`Desk::back`]; `stop` ends it.
    ///
    /// # Errors
    /// The robot is not armed or in use, or `stop` is already set.
    pub(super) fn lend(&self, at: &mut At, job: Option<&str>, stop: &Arc<AtomicBool>) -> Result<Box<Guard>> {
        let taken = if job.is_some() { Robot::Job(Step::Works) } else { Robot::Lent };
        match std::mem::replace(&mut at.robot, taken) {
            Robot::Rests(guard) => {
                self.brake.lend(job, stop.clone());
                // A STOP before the brake knew of this job has already set the job's flag.
                if stop.load(Ordering::SeqCst) {
                    self.brake.back(None);
                    at.robot = Robot::Rests(guard);
                    return Err(Fault::refused("STOP was pressed before it began").next("begin it again"));
                }
                Ok(guard)
            }
            Robot::Away => {
                at.robot = Robot::Away;
                Err(Fault::refused("the robot is not armed")
                    .cause("a job that moves it is begun by whoever stands beside it")
                    .next("press Arm, then begin it again"))
            }
            other => {
                at.robot = other;
                Err(in_use(&at.robot))
            }
        }
    }

    /// The user of the guard returns it.
    pub(super) fn back(&self, guard: Box<Guard>) {
        let mut at = self.at();
        self.brake.back(guard.unknown());
        at.robot = Robot::Rests(guard);
        self.tell(&at);
    }

    /// Disarms the robot. The guard is dropped after the desk's lock, because dropping it asks the controller.
    pub fn disarm(&self) -> Result<MotionState> {
        let mut at = self.at();
        let guard = match std::mem::take(&mut at.robot) {
            Robot::Rests(guard) => Some(guard),
            Robot::Away => None,
            other => {
                at.robot = other;
                return Err(in_use(&at.robot));
            }
        };
        at.by = None;
        self.brake.arm(None);
        self.tell(&at);
        let state = self.seen(&at);
        drop(at);
        drop(guard);
        Ok(state)
    }

    /// The button was released, or can no longer be held: a motion under way is halted.
    pub fn let_go(&self, tab: &Tab, why: &str) {
        let mut at = self.at();
        self.grants.drop_of(tab);
        if at.hold.as_ref().is_some_and(|h| h.tab == *tab) {
            at.hold = None;
            self.halt_motion(&at, why);
        }
    }

    /// Another tab operates from now on: the robot is no longer armed from the previous tab.
    pub fn handed_over(&self) {
        let mut at = self.at();
        self.grants.drop_all();
        at.by = None;
        if at.hold.take().is_some() {
            self.halt_motion(&at, "another screen took over");
        }
        self.tell(&at);
    }

    fn halt_motion(&self, at: &At, why: &str) {
        if at.moves() {
            self.brake.halt(why);
            self.tell(at);
        }
    }

    /// STOP, from any screen: the current use of the robot ends, its lights are switched off, a motion is halted.
    /// Viewers are notified after that: only the notification waits for the desk's lock.
    pub fn stop(&self) {
        let ended = self.brake.pull("STOP was pressed");
        self.grants.drop_all();
        self.after_stop(ended);
    }

    /// STOP for one job, if it has the robot.
    pub fn stop_job(&self, id: &str) {
        let ended = self.brake.pull_job(id, "STOP was pressed");
        self.after_stop(ended);
    }

    fn after_stop(&self, ended: bool) {
        if ended {
            self.wake.notify_all();
            self.tell(&self.at());
        }
    }

    /// Adds a message of the job.
    pub fn say(&self, line: &str) {
        let mut at = self.at();
        at.told.said.push(line.to_owned());
        let more = at.told.said.len().saturating_sub(MOST_SAID);
        at.told.said.drain(..more);
        self.tell(&at);
    }

    /// A calibration's number of stops and the error expected after them, mm.
    pub fn expects(&self, stops: usize, mm: f64) {
        let mut at = self.at();
        at.told.expected.push((stops, mm));
        self.tell(&at);
    }
}

#[cfg(test)]
impl Desk {
    /// A job with this flag has the robot.
    pub fn a_job_runs(&self, stop: &Arc<AtomicBool>) {
        self.at().robot = Robot::Job(Step::Works);
        self.brake.lend(Some("0001-insert"), stop.clone());
    }

    /// The robot is armed from this tab.
    pub fn is_armed(&self, guard: Guard, tab: &Tab) {
        self.brake.arm(Some(guard.stop_button()));
        let mut at = self.at();
        (at.robot, at.by) = (Robot::Rests(Box::new(guard)), Some(tab.clone()));
    }
}

#[cfg(test)]
mod tests {
    use super::super::session::Session;
    use super::*;
    use sheetlight::arm::rules::{Carried, MotionLog, StopButton};
    use std::time::{Duration, Instant};

    fn tab() -> Tab {
        Tab { session: "s".into(), tab: "a".into() }
    }

    fn desk() -> (tempfile::TempDir, Arc<Desk>, StopButton) {
        let dir = tempfile::tempdir().unwrap();
        let poses = dir.path().join("poses.csv");
        std::fs::write(&poses, "# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,2,3,0,0,0\n").unwrap();
        let link = sheetlight::arm::open(&format!("file:{}", poses.display())).unwrap();
        let guard = Guard::new(link, None, Carried::new(None, Ok(vec![])), MotionLog::default());
        let button = guard.stop_button();
        let desk = Arc::new(Desk::new(Links::default(), Arc::default()));
        desk.is_armed(guard, &tab());
        (dir, desk, button)
    }

    /// STOP acts even while the desk's lock is held.
    #[test]
    fn stop_does_not_wait_for_the_desk() {
        let (_dir, desk, button) = desk();
        let stop = Arc::new(AtomicBool::new(false));
        let _session = Session::begin(&desk, "0001-insert", &stop).unwrap();
        let held = desk.at();
        let presses = std::thread::spawn({
            let desk = desk.clone();
            move || desk.stop()
        });
        let until = Instant::now() + Duration::from_secs(20);
        while !(stop.load(Ordering::SeqCst) && button.why().is_some()) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(stop.load(Ordering::SeqCst) && button.why().as_deref() == Some("STOP was pressed"));
        drop(held);
        presses.join().unwrap();
        assert!(desk.state().look.is_some());
    }

    /// Only one user has the robot at a time; meanwhile nobody else gets it or disarms it, and no old guard comes
    /// back.
    #[test]
    fn one_has_the_robot_at_a_time() {
        let (_dir, desk, _) = desk();
        let stop = Arc::new(AtomicBool::new(false));
        let tried = Session::request(&desk, &mut desk.at(), &stop).unwrap();
        assert!(Session::begin(&desk, "0001-insert", &stop).is_err() && desk.disarm().is_err());
        drop(tried);
        let job = Session::begin(&desk, "0001-insert", &stop).unwrap();
        assert!(desk.disarm().is_err() && desk.looked().is_err() && desk.has_job());
        drop(job);
        assert!(desk.disarm().unwrap().armed.is_none() && !desk.armed());
        assert!(Session::begin(&desk, "0001-insert", &stop).is_err(), "it is not armed");
    }

    /// A job that was stopped before it takes the robot does not get it; stopping a job does not affect the next
    /// one.
    #[test]
    fn a_stop_is_for_whoever_has_the_robot() {
        let (_dir, desk, button) = desk();
        let [first, second] = [true, false].map(|set| Arc::new(AtomicBool::new(set)));
        assert!(Session::begin(&desk, "0001-insert", &first).is_err());
        desk.stop();
        assert!(button.why().is_none() && desk.state().look.is_none(), "nobody has the robot: nothing is to be halted");
        let _session = Session::begin(&desk, "0002-insert", &second).unwrap();
        desk.stop_job("0001-insert");
        assert!(!second.load(Ordering::SeqCst) && button.why().is_none());
        desk.stop_job("0002-insert");
        assert!(second.load(Ordering::SeqCst) && button.why().is_some());
    }

    /// A STOP before or while a person reports that he has looked stays in effect.
    #[test]
    fn a_stop_while_somebody_looks_is_not_undone() {
        let (_dir, desk, button) = desk();
        let stop = Arc::new(AtomicBool::new(false));
        let asks = Session::request(&desk, &mut desk.at(), &stop).unwrap();
        desk.stop();
        drop(asks);
        assert!(!desk.brake.looked(&stop) && button.why().is_some() && desk.state().look.is_some());
        assert!(
            desk.looked().unwrap().look.is_none() && button.why().is_none(),
            "and is over when he has looked again"
        );
    }
}
