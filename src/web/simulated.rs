//! In: a folder. Out: a simulated station in it with recordings to scan, made once: a first look at the product without
//! camera, robot or GPU.
//! Frame and unit: as recordings; px.

use crate::fault::Result;
use crate::robot::Convention;
use crate::simulate::{Set, SimulateOptions, simulate};
use crate::station::Settings;
use std::path::{Path, PathBuf};

/// Of the simulated robot.
const NOTATION: Convention = Convention::Denso;
const SEED: u64 = 3;

/// Makes `folder/station` and recordings beside it where they are not there yet, `shots` a scan; `progress` counts pictures.
/// Gives the station.
pub fn simulated(
    folder: &Path,
    shots: usize,
    sets: &[Set],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<PathBuf> {
    let station = folder.join("station");
    // Its settings come last, so that a station that has them is whole.
    if station.join("station.toml").is_file() {
        return Ok(station);
    }
    let options = SimulateOptions { sets: sets.to_vec(), seed: SEED, shots, ..SimulateOptions::default() };
    let made = simulate(folder, &options, progress)?;
    Settings { name: "simulated".into(), robot: Some(NOTATION), ..Settings::default() }.store(&made.station)?;
    Ok(made.station)
}
