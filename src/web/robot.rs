//! In: a robot's URI. Out: what its controller says, read over and over on a thread of its own; a link that breaks is
//! opened again.
//! Frame and unit: poses base_from_flange, mm.

use super::message::RobotState;
use super::track::Track;
use crate::arm::{Arm, Mode, Outputs, RobotUri, State, open};
use crate::capture::now_ns;
use crate::fault::{Fault, Result};
use crate::station::Settings;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// The pose is read so often.
const READ: Duration = Duration::from_millis(100);
/// The state is read with every so many of them.
const STATE: u32 = 5;
/// A link that broke is opened again after so long.
const AGAIN: Duration = Duration::from_secs(2);

/// What is known of the robot.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// None: no link.
    pub state: Option<State>,
    /// Why there is none, or what stands on the controller.
    pub wrong: Option<String>,
    /// Line or pointer is on, by the controller's outputs; None: the link cannot say.
    pub laser: Option<bool>,
}

/// A robot that is looked at, over a link of its own; it is moved from [`super::motion`].
pub struct Robot {
    seen: Arc<Mutex<Seen>>,
    track: Arc<Mutex<Track>>,
    ended: Arc<AtomicBool>,
}

impl Robot {
    /// Begins to look, at the outputs that the station names too. The robot need not be there yet.
    pub fn watch(uri: &str, station: &Path) -> Result<Robot> {
        // Poses of a file have no times: none of them is that of a picture.
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

    /// Where the flange was.
    pub fn track(&self) -> MutexGuard<'_, Track> {
        self.track.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// What was seen last.
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

/// Reads the state and tells it.
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
    /// As the bar shows it.
    pub fn bar(&self, armed: bool, moving: bool) -> RobotState {
        match &self.state {
            Some(s) if moving || s.busy == Some(true) => RobotState::Moving,
            Some(_) if armed => RobotState::Armed,
            Some(_) => RobotState::ReadOnly,
            None => RobotState::NoLink,
        }
    }
}
