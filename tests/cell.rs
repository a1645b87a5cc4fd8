//! In: a simulated cell on its wires. Out: whether controller, camera, motion rules and job behave as they must;
//! judged by the controller's own log and by the truth of the cell.
//! Frame and unit: base frame, mm, degrees; times in ms.

mod common;

#[path = "cell/cold.rs"]
mod cold;
#[path = "cell/exposure.rs"]
mod exposure;
#[path = "cell/faults.rs"]
mod faults;
#[path = "cell/golden.rs"]
mod golden;
#[path = "cell/guard.rs"]
mod guard;
#[path = "cell/job.rs"]
mod job;
#[path = "cell/lasers.rs"]
mod lasers;
#[path = "cell/plc.rs"]
mod plc;
#[path = "cell/programs.rs"]
mod programs;
#[path = "cell/refusals.rs"]
mod refusals;
#[path = "cell/resumed.rs"]
mod resumed;
#[path = "cell/rules.rs"]
mod rules;
#[path = "cell/socket.rs"]
mod socket;
#[path = "cell/speeds.rs"]
mod speeds;
#[path = "cell/trap.rs"]
mod trap;
#[path = "cell/wire.rs"]
mod wire;
#[path = "cell/workplace.rs"]
mod workplace;
#[path = "cell/worlds.rs"]
mod worlds;

use sheetlight::simulate::SceneSpec;
use sheetlight_program::cell::{Cell, CellOptions, Served};

/// A cell with the circuit board that ships with the program, `speed` times as fast as ours.
fn cell(seed: u64, speed: f64) -> Served {
    let scene = SceneSpec::parse(sheetlight::simulate::DEFAULT_SCENE).unwrap();
    Served::here(Cell::new(CellOptions { speed, ..CellOptions::of(scene, seed) }).unwrap()).unwrap()
}
