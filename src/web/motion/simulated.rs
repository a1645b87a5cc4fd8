//! In: a folder. Out: a simulated cell in this process, on ports of this machine, and a station that fits it; what
//! happens in it goes into cell.jsonl.
//! Frame and unit: scene, mm; s of the cell.

use crate::cell::{Cell, CellOptions, Over, Served};
use crate::fault::{Fault, Result};
use crate::recording::BoardSpec;
use crate::simulate::{DEFAULT_SCENE, SceneSpec};
use crate::web::message::SimulatedCell;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Parts whose components there are, each with the scene that has its socket.
const PARTS: [(&str, &str); 4] = [
    ("led", DEFAULT_SCENE),
    ("osc", DEFAULT_SCENE),
    ("flash", DEFAULT_SCENE),
    ("dimm", include_str!("../../../data/scenes/dimm.toml")),
];
/// Solids that come first in those scenes.
const BOARD_AND_TABLE: usize = 2;
/// An operator jogs no better than this, mm.
const JOGGED_OFF_MM: [f64; 2] = [3.0, -2.0];
/// The log is written this often.
const LOG: Duration = Duration::from_millis(50);
/// The camera's pictures a second while nobody measures: a glance.
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

/// A simulated cell and who stands beside it.
pub struct SimulatedRobot {
    served: Served,
    at: Mutex<(String, bool)>,
    over: Arc<AtomicBool>,
}

/// The board with this part's socket alone, in its middle: the pointer touches the bare board around it.
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
    /// Starts it; `speed` seconds of the cell pass in one of ours.
    ///
    /// # Errors
    /// No port or no thread can be had; an unknown part.
    pub fn start(folder: &Path, part: &str, seed: u64, speed: f64) -> Result<SimulatedRobot> {
        let options = CellOptions { board: Some(board()), speed, ..CellOptions::of(scene(part)?, seed) };
        let served = Served::here(Cell::new(CellOptions { holds: Some(part.to_owned()), ..options })?)?;
        // As the operator leaves it: motor on, nothing pending.
        served.controller.set_motor(true);
        let over = Arc::new(AtomicBool::new(false));
        follow(served.cell.clone(), folder.join("cell.jsonl"), over.clone())?;
        let robot = SimulatedRobot { served, at: Mutex::new((part.to_owned(), false)), over };
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
    /// The camera as a URI, to look at.
    pub fn camera_uri(&self) -> String {
        format!("cell://{}?rate={GLANCES}", self.served.camera)
    }

    /// As pages see it.
    pub fn state(&self) -> SimulatedCell {
        let (holds, over_board) = self.at.lock().unwrap_or_else(|e| e.into_inner()).clone();
        SimulatedCell { parts: PARTS.iter().map(|(name, _)| (*name).to_owned()).collect(), holds, over_board }
    }

    /// A person lays the board with a part's socket before the robot, puts its component into the gripper, and jogs
    /// the arm there, or over the calibration board.
    pub fn put(&self, holds: Option<&str>, over_board: bool) -> Result<()> {
        let mut at = self.at.lock().unwrap_or_else(|e| e.into_inner());
        let part = holds.unwrap_or(&at.0).to_owned();
        let spec = scene(&part)?;
        self.served.cell.jog(if over_board { Over::Board } else { Over::Place(JOGGED_OFF_MM) })?;
        self.served.cell.lay(&spec, Some(&part))?;
        *at = (part, over_board);
        Ok(())
    }
}

impl Drop for SimulatedRobot {
    fn drop(&mut self) {
        self.over.store(true, Ordering::SeqCst);
    }
}

/// Writes what happens, a line of JSON each.
fn follow(cell: Cell, path: PathBuf, over: Arc<AtomicBool>) -> Result<()> {
    let body = move || {
        let mut said = 0;
        while !over.load(Ordering::SeqCst) {
            let log = cell.log();
            for entry in &log[said..] {
                // A log that cannot be written stops no cell.
                let _ = crate::files::append_line(&path, &serde_json::to_string(entry).expect("plain data"));
            }
            said = log.len();
            std::thread::sleep(LOG);
        }
    };
    std::thread::Builder::new().name("cell log".into()).spawn(body).map(|_| ()).map_err(|e| Fault::threads(&e))
}
