//! In: the inputs of a calibration that makes one record, and a station. Out: the record, stored in the station.
//! Frame and unit: each record names its frames.

use super::store::{Keep, finish};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::surroundings::{in_folder, with_bar};
use crate::procedure::calibrate::Calibration;
use sheetlight::fault::Result;
use std::path::PathBuf;

/// The inputs, with the station's folder and what happens with a bad result.
#[derive(clap::Args)]
pub struct One<Inputs: clap::Args> {
    /// Station folder; the result is stored in it
    #[arg(long)]
    station: PathBuf,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    keep: Keep,
}

pub fn run<Inputs: clap::Args + Calibration>(args: &One<Inputs>, console: &Console) -> Result<()> {
    let solved = with_bar(console, |progress| in_folder(&args.station, console, |at| args.inputs.solve(at, progress)))?;
    finish(&args.station, &solved, &args.keep, console)
}
