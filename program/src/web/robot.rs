//! In: a robot's URI. Out: the state of its controller, polled on a separate thread; a broken link is reopened.
//! Frame and unit: poses base_from_flange, mm.

use super::message::RobotState;
use super::track::Track;
use sheetlight::arm::{Arm, Mode, Outputs, RobotUri, State, open};
use sheetlight::capture::now_ns;
use sheetlight::fault::{Fault, Result};
use sheetlight::station::Settings;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// Interval at which the pose is read.
const READ: Duration = Duration::from_millis(100);
/// The state is read with every n-th pose.
const STATE: u32 = 5;
/// Time after which a broken link is reopened.
const AGAIN: Duration = Duration::from_secs(2);

/// The last known state of the robot.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// `None`: no link.
    pub state: Option<State>,
    /// Why there is no link, or what the controller reports as wrong.
    pub wrong: Option<String>,
    /// Line or pointer is on, by the controller's outputs; `None`: the link does not report it.
    pub laser: Option<bool>,
}

/// A robot that is watched over a separate link; it is moved from [`super::motion`].
pub struct Robot {
    seen: Arc<Mutex<Seen>>,
    track: Arc<Mutex<Track>>,
    ended: Arc<AtomicBool>,
}

impl Robot {
    /// Starts watching the robot, and the outputs that the station names. The robot need not be connected yet.
    pub fn watch(uri: &str, station: &Path) -> Result<Robot> {
        // Poses from a file have no times, so none of them can be assigned to a picture.
        let timed = !matches!(uri.parse::<RobotUri>()?, RobotUri::File(_));
        let (seen, ended) = (Arc::new(Mutex::new(Seen::default())), Arc::new(AtomicBool::new(false)));
        let track = Arc::new(Mutex::new(Track::default()));
        let (uri, tell, end, tracks) = (uri.to_owned(), seen.clone(), ended.clone(), track.clone());
        let station = station.to_owned();
        let body = move || {
            while !end.load(Ordering::Relaxed) {
                let outputs = Settings::load(&station).ok().and_then(|s| s.outputs).unwrap_or_default();
                let Err(fault) = look(&uri, &outputs, &tell, timed.then_some(&*tracks), &end) else { return };
                let gone = Seen { wrong: Some(fault.what), ..Seen::default() };
                *tell.lock().unwrap_or_else(|e| e.into_inner()) = gone;
                std::thread::sleep(AGAIN);
            }
        };
        std::thread::Builder::new().name("robot".into()).spawn(body).map_err(|e| Fault::threads(&e))?;
        Ok(Robot { seen, track, ended })
    }

    /// The flange's poses over time.
    pub fn track(&self) -> MutexGuard<'_, Track> {
        self.track.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// The last known state.
    pub fn seen(&self) -> Seen {
        self.seen.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
    }
}

fn look(
    uri: &str,
    outputs: &Outputs,
    tell: &Mutex<Seen>,
    track: Option<&Mutex<Track>>,
    end: &AtomicBool,
) -> Result<()> {
    let mut arm = open(uri)?;
    for turn in 0u32.. {
        if end.load(Ordering::Relaxed) {
            break;
        }
        if let Some(track) = track {
            let (asked, pose) = (now_ns(), arm.pose()?);
            let at = asked + (now_ns() - asked) / 2;
            track.lock().unwrap_or_else(|e| e.into_inner()).add(at, pose.base_from_flange);
        }
        if turn % STATE == 0 {
            state(&mut *arm, outputs, tell)?;
        }
        std::thread::sleep(READ);
    }
    Ok(())
}

/// Reads the state and stores it.
fn state(arm: &mut dyn Arm, outputs: &Outputs, tell: &Mutex<Seen>) -> Result<()> {
    let state = arm.state()?;
    let lit: Vec<bool> = [outputs.line, outputs.pointer].into_iter().filter_map(|n| arm.signal(n).ok()).collect();
    let laser = (!lit.is_empty()).then(|| lit.contains(&true));
    let mut wrong: Vec<String> =
        state.errors.iter().map(|e| format!("controller error {:X}: {}", e.code, e.text)).collect();
    if state.emergency_stop == Some(true) {
        wrong.push("emergency stop is pressed".into());
    }
    if matches!(state.mode, Mode::Manual | Mode::Teach) {
        wrong.push("the controller is not in automatic mode".into());
    }
    let wrong = (!wrong.is_empty()).then(|| wrong.join("; "));
    *tell.lock().unwrap_or_else(|e| e.into_inner()) = Seen { state: Some(state), wrong, laser };
    Ok(())
}

impl Seen {
    /// The state that the bar shows.
    pub fn bar(&self, armed: bool, moving: bool) -> RobotState {
        match &self.state {
            Some(s) if moving || s.busy == Some(true) => RobotState::Moving,
            Some(_) if armed => RobotState::Armed,
            Some(_) => RobotState::ReadOnly,
            None => RobotState::NoLink,
        }
    }
}
