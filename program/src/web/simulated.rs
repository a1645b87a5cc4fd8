//! In: a folder. Out: a simulated cell that runs in this process, a station for it in the folder, and recordings to
//! scan, made once. Shows the product without camera, robot or GPU.
//! Frame and unit: as recordings; px.

use super::for_cell::station_for;
use super::motion::{SimulatedRobot, board};
use sheetlight::fault::Result;
use sheetlight::simulate::{Set, SimulateOptions, simulate};
use std::path::{Path, PathBuf};

/// Longest silence of the link to the controller, ms: cell and controller share this machine with all other
/// programs.
const SILENCE_MS: f64 = 2000.0;

/// Options of the simulation.
#[derive(Clone, Debug)]
pub struct SimulatedOptions {
    /// Shots of the recorded scan.
    pub shots: usize,
    /// Recordings made in addition to the cell.
    pub sets: Vec<Set>,
    /// Part whose component the gripper holds: led, osc, flash or dimm.
    pub part: String,
    /// Seed of specimen, poses and noise.
    pub seed: u64,
    /// Seconds of the cell per real second, 0.1 to 1000.
    pub speed: f64,
}

/// Starts the cell. Makes `folder/station` and recordings beside it if they do not exist yet; `progress` counts
/// pictures. Returns the station.
pub fn simulated(
    folder: &Path,
    options: &SimulatedOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(PathBuf, SimulatedRobot)> {
    sheetlight::files::make_folder(folder)?;
    let station = folder.join("station");
    let robot = SimulatedRobot::start(folder, &options.part, options.seed, options.speed)?;
    // station.toml is written last, so that a station that has it is complete.
    if !station.join("station.toml").is_file() {
        if !options.sets.is_empty() {
            let (sets, shots) = (options.sets.clone(), options.shots);
            simulate(
                folder,
                &SimulateOptions { sets, seed: options.seed, shots, ..SimulateOptions::default() },
                progress,
            )?;
        }
        let boards = station.join("boards");
        sheetlight::files::make_folder(&boards)?;
        let text = serde_json::to_string_pretty(&board()).expect("plain data");
        sheetlight::files::write(&boards.join("charuco-16.json"), text.as_bytes())?;
        station_for(robot.cell(), &station, "simulated", Some(SILENCE_MS))?;
    }
    Ok((station, robot))
}
