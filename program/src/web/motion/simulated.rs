//! In: a folder. Out: a simulated cell in this process, on local ports, and a station that fits it; the cell's
//! events go into cell.jsonl.
//! Frame and unit: scene, mm; s of the cell.

use crate::cell::{Cell, CellOptions, Over, Served};
use crate::web::message::SimulatedCell;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::BoardSpec;
use sheetlight::simulate::{DEFAULT_SCENE, SceneSpec};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Parts that have a component, each with the scene that contains its socket.
const PARTS: [(&str, &str); 4] = [
    ("led", DEFAULT_SCENE),
    ("osc", DEFAULT_SCENE),
    ("flash", DEFAULT_SCENE),
    ("dimm", include_str!("../../../../data/scenes/dimm.toml")),
];
/// Number of solids that come first in those scenes.
const BOARD_AND_TABLE: usize = 2;
/// Error of an operator's jogging, mm.
const JOGGED_OFF_MM: [f64; 2] = [3.0, -2.0];
/// Interval at which the log is written.
const LOG: Duration = Duration::from_millis(50);
/// Frame rate of the camera while no job measures, Hz.
const GLANCES: f64 = 4.0;

/// The calibration board of the simulated cell.
pub fn board() -> BoardSpec {
    BoardSpec::Charuco {
        squares: [11, 8],
        square_mm: 16.0,
        marker_mm: 11.2,
        dictionary: "DICT_5X5_250".into(),
        first_id: 0,
        first_square: None,
        border_mm: 9.6,
    }
}

/// A simulated cell and the person beside it.
pub struct SimulatedRobot {
    served: Served,
    /// The part whose component the gripper holds, and whether the arm is over the board. The lock is never held
    /// during slow work.
    at: Mutex<(String, bool)>,
    /// One person works in the cell at a time.
    hands: Mutex<()>,
    over: Arc<AtomicBool>,
}

/// The board with only this part's socket, in its middle: the pointer touches the bare board around it.
fn scene(part: &str) -> Result<SceneSpec> {
    let text = PARTS.iter().find(|(name, _)| *name == part).map(|(_, text)| *text).ok_or_else(|| {
        Fault::usage(format!("{part:?}: there is no such component here")).next("choose one from the list")
    })?;
    let mut spec = SceneSpec::parse(text)?;
    spec.part.retain(|p| p.name == part);
    spec.solid.truncate(BOARD_AND_TABLE);
    spec.part.iter_mut().for_each(|p| (p.at_mm[0], p.at_mm[1]) = (0.0, 0.0));
    Ok(spec)
}

impl SimulatedRobot {
    /// Starts the cell; `speed` is its seconds per real second.
    ///
    /// # Errors
    /// No port or thread is available; an unknown part.
    pub fn start(folder: &Path, part: &str, seed: u64, speed: f64) -> Result<SimulatedRobot> {
        let options = CellOptions { board: Some(board()), speed, ..CellOptions::of(scene(part)?, seed) };
        let served = Served::here(Cell::new(CellOptions { holds: Some(part.to_owned()), ..options })?)?;
        // As an operator leaves it: motor on, no error pending.
        served.controller.set_motor(true);
        let over = Arc::new(AtomicBool::new(false));
        follow(served.cell.clone(), folder.join("cell.jsonl"), over.clone())?;
        let at = Mutex::new((part.to_owned(), false));
        let robot = SimulatedRobot { served, at, hands: Mutex::default(), over };
        robot.put(None, false)?;
        Ok(robot)
    }

    /// The cell.
    pub fn cell(&self) -> &Cell {
        &self.served.cell
    }
    /// The robot as a URI.
    pub fn robot_uri(&self) -> String {
        self.served.robot_uri()
    }
    /// The camera as a URI, at the low frame rate for viewing.
    pub fn camera_uri(&self) -> String {
        format!("cell://{}?rate={GLANCES}", self.served.camera)
    }

    fn at(&self) -> MutexGuard<'_, (String, bool)> {
        self.at.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The state as pages see it.
    pub fn state(&self) -> SimulatedCell {
        let (holds, over_board) = self.at().clone();
        SimulatedCell { parts: PARTS.iter().map(|(name, _)| (*name).to_owned()).collect(), holds, over_board }
    }

    /// A person puts the board with a part's socket before the robot, puts its component into the gripper, and jogs
    /// the arm above it, or above the calibration board.
    pub fn put(&self, holds: Option<&str>, over_board: bool) -> Result<()> {
        let _one = self.hands.lock().unwrap_or_else(PoisonError::into_inner);
        let part = holds.map_or_else(|| self.at().0.clone(), str::to_owned);
        let spec = scene(&part)?;
        self.served.cell.jog(if over_board { Over::Board } else { Over::Place(JOGGED_OFF_MM) })?;
        self.served.cell.lay(&spec, Some(&part))?;
        *self.at() = (part, over_board);
        Ok(())
    }
}

impl Drop for SimulatedRobot {
    fn drop(&mut self) {
        self.over.store(true, Ordering::SeqCst);
    }
}

/// Writes events, one line of JSON each.
fn follow(cell: Cell, path: PathBuf, over: Arc<AtomicBool>) -> Result<()> {
    let body = move || {
        let mut said = 0;
        while !over.load(Ordering::SeqCst) {
            let news = cell.log_after(said);
            said += news.len();
            for entry in &news {
                // The cell continues if the log cannot be written.
                let _ = sheetlight::files::append_line(&path, &serde_json::to_string(entry).expect("plain data"));
            }
            std::thread::sleep(LOG);
        }
    };
    std::thread::Builder::new().name("cell log".into()).spawn(body).map(|_| ()).map_err(|e| Fault::threads(&e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Event;
    use crate::web::for_cell::station_for;
    use crate::web::guard::Tab;
    use crate::web::motion::{Desk, Links};
    use sheetlight::station::Output;
    use std::sync::mpsc::channel;
    use std::time::Instant;

    const PATIENCE: Duration = Duration::from_secs(20);

    /// Pages can read the cell's state while a person works in it, however long that takes.
    #[test]
    fn who_looks_does_not_wait_for_hands_in_the_cell() {
        let dir = tempfile::tempdir().unwrap();
        let robot = Arc::new(SimulatedRobot::start(dir.path(), "osc", 3, 1.0).unwrap());
        let (tell, told) = channel();
        // The test holds the lock that a person's work in the cell holds all the time.
        let works = robot.hands.lock().unwrap();
        let (looks, puts) = (robot.clone(), robot.clone());
        std::thread::spawn(move || tell.send(looks.state()));
        let putting = std::thread::spawn(move || puts.put(Some("led"), false));
        assert_eq!(told.recv_timeout(PATIENCE).expect("it waits").holds, "osc");
        drop(works);
        putting.join().unwrap().unwrap();
        assert_eq!(robot.state().holds, "led");
    }

    /// A laser that is being tried goes off when STOP is pressed, long before its time.
    #[test]
    fn stop_switches_off_what_is_tried() {
        let dir = tempfile::tempdir().unwrap();
        let robot = SimulatedRobot::start(dir.path(), "osc", 3, 1.0).unwrap();
        let (cell, station) = (robot.cell().clone(), dir.path().join("station"));
        station_for(&cell, &station, "simulated", Some(2000.0)).unwrap();
        let uri = Some(robot.robot_uri());
        let links = Links { station, robot: uri, may_move: true, simulated: Some(robot), ..Links::default() };
        let (desk, tab) = (Arc::new(Desk::new(links, Arc::default())), Tab { session: "s".into(), tab: "a".into() });
        desk.arm(&tab).unwrap();
        let line = cell.options().outputs.line;
        let switched = |to: bool, after: f64| {
            let until = Instant::now() + PATIENCE;
            let switch = |e: &crate::cell::Entry| {
                matches!(e.event, Event::Output { number, on } if number == line && on == to) && e.t_s > after
            };
            loop {
                if let Some(entry) = cell.log().iter().find(|e| switch(e)) {
                    return entry.t_s;
                }
                assert!(Instant::now() < until, "the laser was not switched to {to}");
                std::thread::sleep(Duration::from_millis(2));
            }
        };
        // The full duration, for comparison.
        let begun = cell.clock().now();
        desk.try_output(&tab, Output::Line).unwrap();
        let lit = switched(true, begun);
        let whole = switched(false, lit) - lit;
        let tries = std::thread::spawn({
            let (desk, tab) = (desk.clone(), tab.clone());
            move || desk.try_output(&tab, Output::Line)
        });
        let lit = switched(true, lit);
        desk.stop();
        let stopped = switched(false, lit) - lit;
        println!("lit for {whole:.3} s, with STOP for {stopped:.3} s");
        assert!(stopped < whole / 2.0, "{stopped} s of {whole}");
        tries.join().unwrap().unwrap();
        assert!(desk.state().look.is_some() && desk.looked().unwrap().look.is_none());
    }
}
