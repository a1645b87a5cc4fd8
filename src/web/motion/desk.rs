//! In: what tabs do (arm, press, hold, let go, STOP), what jobs ask. Out: each motion confirmed by one tab that held
//! its button while it was shown; a Halt where it lets go, goes, or loses the lease.
//! Frame and unit: s.

use super::grants::Grants;
use super::simulated::SimulatedRobot;
use crate::arm::Switchboard;
use crate::arm::rules::{Guard, StopButton};
use crate::fault::{Fault, Result};
use crate::station::{Output, Settings, guarded, try_output};
use crate::web::camera::Camera;
use crate::web::event::Hub;
use crate::web::guard::Tab;
use crate::web::message::{Asked, Confirmed, Event, MotionState};
use crate::web::robot::Robot;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// While something moves the tab that holds the button says so again and again; silence for so long halts.
const SILENCE: Duration = Duration::from_secs(1);
/// Lines of what a job said that are kept.
const MOST_SAID: usize = 60;

/// What a screen can move and look with.
#[derive(Default)]
pub struct Links {
    /// The station's folder: [motion], [tool], the log of motions.
    pub station: PathBuf,
    /// The robot's URI.
    pub robot: Option<String>,
    /// It may be moved.
    pub may_move: bool,
    /// What that robot says, read over and over.
    pub watched: Option<Arc<Robot>>,
    /// The camera.
    pub camera: Option<Arc<Camera>>,
    /// The cell that robot and camera are of, where it is one of ours.
    pub simulated: Option<SimulatedRobot>,
    /// Ends the program.
    pub stop: Arc<AtomicBool>,
}

/// Where the operator sits.
pub struct Desk {
    /// What there is.
    pub links: Links,
    hub: Arc<Hub>,
    grants: Grants,
    at: Mutex<At>,
    wake: Condvar,
}

/// What becomes of a motion that was shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// It is made.
    Yes,
    /// It is not, and the job ends.
    No,
    /// Nobody said anything while it was good.
    Late,
    /// The job was ended.
    Over,
}

/// A button that is down.
struct Hold {
    tab: Tab,
    grant: String,
    heard: Instant,
}

#[derive(Default)]
pub(super) struct At {
    /// Here while no job has it.
    pub guard: Option<Guard>,
    /// Counts the times that the robot was taken and given back: a guard of an earlier time is never put back.
    turn: u64,
    pub button: Option<StopButton>,
    armed: Option<Tab>,
    hold: Option<Hold>,
    answer: Option<bool>,
    /// Ends the job that runs.
    pub stop: Option<Arc<AtomicBool>>,
    pub shown: MotionState,
}

impl At {
    /// Counts the time since the held button was heard, while something moves.
    fn silent(&mut self) {
        if let (true, Some(hold)) = (self.shown.moving, &self.hold) {
            let ms = hold.heard.elapsed().as_secs_f64() * 1e3;
            self.shown.silence_ms = self.shown.silence_ms.map(|longest| longest.max(ms));
        }
    }
}

impl At {
    /// Puts a guard back that was taken in this turn. It comes out again where the robot was given back meanwhile: the
    /// caller drops it after the desk, because giving an arm back asks the controller.
    pub(super) fn put_back(&mut self, guard: Guard, turn: u64) -> Option<Guard> {
        if self.turn != turn || self.guard.is_some() {
            return Some(guard);
        }
        self.guard = Some(guard);
        None
    }
}

/// Takes the guard out, so that nobody holds the desk while the controller is asked. With it comes the turn that it
/// is of.
pub(super) fn taken(at: &mut At) -> Result<(Guard, u64)> {
    let guard = at.guard.take().ok_or_else(|| {
        Fault::refused("the robot is in use")
            .cause("a job, or a test of its outputs, has it")
            .next("wait until it has ended")
    })?;
    Ok((guard, at.turn))
}

fn no(what: impl Into<String>) -> Fault {
    Fault::refused(what).cause("nothing was moved").next("look at the motion that is shown and hold its button again")
}

impl Desk {
    /// Nothing is armed.
    pub fn new(links: Links, hub: Arc<Hub>) -> Desk {
        let shown = MotionState { robot: links.robot.is_some(), may_move: links.may_move, ..MotionState::default() };
        let at = At { shown, ..At::default() };
        Desk { links, hub, grants: Grants::default(), at: Mutex::new(at), wake: Condvar::new() }
    }

    pub(super) fn at(&self) -> MutexGuard<'_, At> {
        self.at.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// As it stands.
    pub fn state(&self) -> MotionState {
        self.seen(&self.at())
    }

    fn seen(&self, at: &At) -> MotionState {
        let armed = at.armed.as_ref().filter(|_| at.button.is_some()).map(Tab::short);
        let simulated = self.links.simulated.as_ref().map(SimulatedRobot::state);
        MotionState { armed, simulated, ..at.shown.clone() }
    }

    pub(super) fn tell(&self, at: &At) {
        self.hub.tell(&Event::Motion(Box::new(self.seen(at))));
    }

    /// Tells everybody how it stands.
    pub fn told(&self) -> MotionState {
        let at = self.at();
        self.tell(&at);
        self.seen(&at)
    }

    /// A job has the robot.
    pub fn has_job(&self) -> bool {
        self.at().stop.is_some()
    }

    /// Takes the arm for motions from this tab.
    pub fn arm(&self, tab: &Tab) -> Result<MotionState> {
        let Some(uri) = &self.links.robot else {
            return Err(Fault::refused("no robot: the screen was served without --robot")
                .next("start it with --robot URI, or with --simulate"));
        };
        let taken = self.at().button.is_some();
        let made = if taken {
            None
        } else {
            let mut guard = guarded(&self.links.station, uri)?;
            guard.stop_button().listen(self.links.stop.clone());
            guard.arm(self.links.may_move)?;
            // What a program that was killed left lit goes off before anybody goes near.
            let outputs = Settings::load(&self.links.station)?.outputs;
            outputs.map(|o| Switchboard::of(guard.link(), o)).transpose()?;
            Some(guard)
        };
        let mut at = self.at();
        // Of two who arm at once the second one's guard is dropped after the desk: giving an arm back asks the
        // controller.
        let late = match made {
            Some(guard) if at.button.is_none() => {
                (at.button, at.guard, at.turn) = (Some(guard.stop_button()), Some(guard), at.turn + 1);
                None
            }
            other => other,
        };
        if at.button.is_none() {
            return Err(Fault::refused("the robot was given back meanwhile").next("press Arm again"));
        }
        at.armed = Some(tab.clone());
        self.tell(&at);
        let state = self.seen(&at);
        drop(at);
        drop(late);
        Ok(state)
    }

    /// Gives the arm back.
    pub fn disarm(&self) -> Result<MotionState> {
        let mut at = self.at();
        if at.stop.is_some() {
            return Err(Fault::refused("a job has the robot").next("stop the job first"));
        }
        (at.armed, at.button, at.turn) = (None, None, at.turn + 1);
        let guard = at.guard.take();
        self.tell(&at);
        let state = self.seen(&at);
        drop(at);
        drop(guard);
        Ok(state)
    }

    /// Some tab has armed the robot.
    pub fn armed(&self) -> bool {
        self.at().button.is_some()
    }

    /// Tries an output of the controller, from the tab that armed it, while no job has it; its number.
    pub fn try_output(&self, tab: &Tab, what: Output) -> Result<u16> {
        let mut at = self.at();
        if at.armed.as_ref() != Some(tab) {
            return Err(Fault::refused("the robot is not armed from this screen")
                .cause("only the person beside the cell switches outputs")
                .next("press Arm first"));
        }
        let (mut guard, turn) = taken(&mut at)?;
        drop(at);
        let outputs = Settings::load(&self.links.station).map(|s| s.outputs.unwrap_or_default());
        let tried = outputs.and_then(|o| try_output(guard.link(), &o, what, &self.links.stop));
        let former = self.at().put_back(guard, turn);
        drop(former);
        tried
    }

    /// Somebody has looked at the robot after a motion that was stopped: motions may be proposed again.
    pub fn looked(&self) -> Result<MotionState> {
        let mut at = self.at();
        if at.stop.is_some() {
            return Err(Fault::refused("a job has the robot").next("wait until it has ended"));
        }
        if at.button.is_some() {
            let (mut guard, turn) = taken(&mut at)?;
            // The controller may take seconds to answer: STOP must not wait for it.
            drop(at);
            let looked = guard.looked();
            at = self.at();
            let former = at.put_back(guard, turn);
            if former.is_some() {
                drop(at);
                return Err(Fault::refused("the robot was given back meanwhile").next("press Arm, then look again"));
            }
            looked?;
            at.button.iter().for_each(StopButton::release);
        }
        at.shown.look = None;
        self.tell(&at);
        Ok(self.seen(&at))
    }

    /// The button goes down over the motion that is shown. Gives the name under which it is redeemed once.
    pub fn press(&self, tab: &Tab, what: &Confirmed) -> Result<String> {
        let at = self.at();
        self.may(&at, tab, what)?;
        let asked = at.shown.asked.as_ref().expect("it may");
        let down = at.hold.as_ref().is_some_and(|h| h.heard.elapsed() < SILENCE);
        if down && !asked.stays_down {
            return Err(no(format!("'{}' wants the button pressed again", asked.step)));
        }
        Ok(self.grants.give(tab, what.clone()))
    }

    /// It was held long enough: the motion is confirmed, once.
    pub fn go(&self, tab: &Tab, grant: &str, what: &Confirmed) -> Result<()> {
        self.grants.redeem(grant, tab, what)?;
        let mut at = self.at();
        self.may(&at, tab, what)?;
        if let Some(button) = &at.button {
            button.lease(SILENCE);
        }
        at.hold = Some(Hold { tab: tab.clone(), grant: grant.to_owned(), heard: Instant::now() });
        (at.answer, at.shown.moving, at.shown.silence_ms) = (Some(true), true, Some(0.0));
        self.tell(&at);
        self.wake.notify_all();
        Ok(())
    }

    fn may(&self, at: &At, tab: &Tab, what: &Confirmed) -> Result<()> {
        if at.armed.as_ref() != Some(tab) {
            return Err(no("the robot is not armed from this screen"));
        }
        if let Some(why) = &at.shown.look {
            return Err(no(format!("somebody has to look at the robot first: {why}")));
        }
        let same = |a: &Asked| a.hash == what.hash && a.job == what.job;
        match &at.shown.asked {
            Some(asked) if same(asked) && at.answer.is_none() => Ok(()),
            Some(asked) if same(asked) => Err(no("this motion was confirmed already")),
            Some(_) => Err(no("the motion is not the one that is shown now")),
            None => Err(no("no motion waits for a confirmation")),
        }
    }

    /// No: the job that asks ends.
    pub fn refuse(&self, what: &Confirmed) -> Result<()> {
        let mut at = self.at();
        match &at.shown.asked {
            Some(asked) if asked.hash == what.hash && at.answer.is_none() => {
                at.answer = Some(false);
                self.wake.notify_all();
                Ok(())
            }
            _ => Err(no("that motion is not asked for")),
        }
    }

    /// The tab that holds the button says that it still does. False: it holds none.
    pub fn held(&self, tab: &Tab, grant: &str) -> bool {
        let mut at = self.at();
        at.silent();
        let At { hold: Some(hold), button, .. } = &mut *at else { return false };
        if hold.tab != *tab || hold.grant != grant {
            return false;
        }
        hold.heard = Instant::now();
        if let Some(button) = button {
            button.renew();
        }
        true
    }

    /// The button was let go, or can be held no longer: what moves is halted.
    pub fn let_go(&self, tab: &Tab, why: &str) {
        let mut at = self.at();
        self.grants.drop_of(tab);
        if at.hold.as_ref().is_some_and(|h| h.tab == *tab) {
            at.hold = None;
            if at.shown.moving {
                self.halt(&mut at, why);
            }
        }
    }

    /// Another tab operates from now on: nothing is armed from the former one.
    pub fn handed_over(&self) {
        let mut at = self.at();
        self.grants.drop_all();
        at.armed = None;
        if at.hold.take().is_some() && at.shown.moving {
            self.halt(&mut at, "another screen took over");
        }
        self.tell(&at);
    }

    /// STOP, from any screen: the job that has the robot ends, what moves is halted.
    pub fn stop(&self) {
        let mut at = self.at();
        self.grants.drop_all();
        if let Some(stop) = &at.stop {
            stop.store(true, Ordering::SeqCst);
            self.halt(&mut at, "STOP was pressed");
        }
        self.wake.notify_all();
    }

    /// STOP for one job: what it moves is halted where it is the one that has the robot.
    pub fn stop_job(&self, id: &str) {
        let at = self.at();
        let has_it = at.stop.is_some() && at.shown.job.as_deref() == Some(id);
        drop(at);
        if has_it {
            self.stop();
        }
    }

    fn halt(&self, at: &mut At, why: &str) {
        if let Some(button) = &at.button {
            button.press_for(why);
        }
        at.shown.look.get_or_insert_with(|| why.to_owned());
        self.tell(at);
    }

    /// Shows a motion and waits for what becomes of it.
    pub(super) fn ask(&self, asked: Asked) -> Answer {
        let until = Instant::now() + Duration::from_secs_f64(asked.within_s);
        let mut at = self.at();
        (at.shown.asked, at.answer) = (Some(asked), None);
        self.tell(&at);
        let answer = loop {
            if at.stop.as_ref().is_none_or(|s| s.load(Ordering::SeqCst)) {
                break Answer::Over;
            }
            match at.answer {
                Some(true) => return Answer::Yes,
                Some(false) => break Answer::No,
                None if Instant::now() >= until => break Answer::Late,
                None => {}
            }
            at = self.wake.wait_timeout(at, Duration::from_millis(100)).unwrap_or_else(|e| e.into_inner()).0;
        };
        (at.shown.asked, at.shown.moving) = (None, false);
        self.tell(&at);
        answer
    }

    /// The confirmed motion has ended.
    pub(super) fn over(&self) {
        let mut at = self.at();
        at.silent();
        (at.shown.asked, at.shown.moving, at.answer) = (None, false, None);
        if let Some(button) = &at.button {
            button.end_lease();
        }
        self.tell(&at);
    }

    /// A line of the job.
    pub fn say(&self, line: &str) {
        let mut at = self.at();
        at.shown.said.push(line.to_owned());
        let more = at.shown.said.len().saturating_sub(MOST_SAID);
        at.shown.said.drain(..more);
        self.tell(&at);
    }

    /// A calibration's stops and the error that is expected after them, mm.
    pub fn expects(&self, stops: usize, mm: f64) {
        let mut at = self.at();
        at.shown.expected.push((stops, mm));
        self.tell(&at);
    }
}

#[cfg(test)]
impl Desk {
    /// A job with this flag has the robot.
    pub fn a_job_runs(&self, stop: &Arc<AtomicBool>) {
        self.at().stop = Some(stop.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::rules::{Carried, MotionLog};

    fn guard(folder: &std::path::Path) -> Guard {
        let poses = folder.join("poses.csv");
        std::fs::write(&poses, "# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,2,3,0,0,0\n").unwrap();
        let link = crate::arm::open(&format!("file:{}", poses.display())).unwrap();
        Guard::new(link, None, Carried::new(None, Ok(vec![])), MotionLog::default())
    }

    /// A test of an output runs, the robot is given back and armed anew meanwhile: the former guard does not come back.
    #[test]
    fn a_guard_of_an_earlier_time_is_not_put_back() {
        let dir = tempfile::tempdir().unwrap();
        let mut at = At { guard: Some(guard(dir.path())), ..At::default() };
        let (former, turn) = taken(&mut at).unwrap();
        assert!(taken(&mut at).is_err(), "it is in use");
        at.turn += 1;
        assert!(at.put_back(former, turn).is_some() && at.guard.is_none());
        at.guard = Some(guard(dir.path()));
        let (held, turn) = taken(&mut at).unwrap();
        assert!(at.put_back(held, turn).is_none() && at.guard.is_some());
    }
}
