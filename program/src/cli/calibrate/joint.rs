//! In: recordings of boards and a station. Out: the station's whole rig from one solve, stored together.
//! Frame and unit: mm, degrees.

use super::store::{Keep, figures, stale};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::surroundings::{in_folder, with_bar};
use crate::procedure::calibrate::JointOrder;
use sheetlight::fault::{Fault, Result};
use sheetlight::rig::Verdict;
use sheetlight::station::{JointResult, store_joint};
use std::path::{Path, PathBuf};

/// Calibrate everything in one solve from any recordings of boards
///
/// Recordings come in any order and number: boards in room light, with robot poses of a board that is fixed or on the
/// flange, with the stripe or the pointer's spot as meta.json states (`beam`). Everything that they share is solved
/// at once. The scatter of corners, stripe, spots and robot is estimated from the residuals and sets their weights.
/// The verdict is the expected error of a scanned point in the working volume, with its sources, beside that of
/// separate calibrations. docs/joint.md explains it.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight calibrate joint recordings/intrinsics recordings/handeye recordings/laserplane \\
      recordings/pointer --poses poses --station cell3
  sheetlight calibrate joint recordings/* --station cell3
Guide: docs/joint.md")]
pub struct Args {
    /// Station folder for the results
    #[arg(long)]
    station: PathBuf,
    #[command(flatten)]
    inputs: JointOrder,
    #[command(flatten)]
    keep: Keep,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let result = with_bar(console, |progress| in_folder(&args.station, console, |at| args.inputs.solve(at, progress)))?;
    finish(&args.station, &result, &args.keep, console)?;
    stale(&args.station, console);
    Ok(())
}

/// Stores all records, or none if they are badly determined.
pub(super) fn finish(station: &Path, result: &JointResult, keep: &Keep, console: &Console) -> Result<()> {
    let q = &result.quality;
    if q.verdict >= Verdict::BadlyDetermined && !keep.badly_determined() {
        let html = station.join("calibration").join("joint.refused.html");
        sheetlight::files::make_folder(&station.join("calibration"))?;
        result.page.save(&html)?;
        console.say(format!("{}not stored; {}: what was found", figures(q), html.display()));
        let what = format!("the joint calibration is {}: {}", q.verdict.words(), q.reasons.join("; "));
        return Err(Fault::refused(what)
            .cause("too few, too similar or contradicting pictures; the station keeps its former calibration")
            .next(q.advice.first().map_or("take more pictures", String::as_str)));
    }
    let stored = store_joint(station, result)?;
    let mut text = format!("verdict: {}\n", q.verdict.words());
    q.reasons.iter().for_each(|r| text += &format!("  {r}\n"));
    q.advice.iter().for_each(|a| text += &format!("  next: {a}\n"));
    text += &format!("stored {}", stored.iter().map(|k| k.words()).collect::<Vec<_>>().join(", "));
    console.result(q, &text);
    Ok(())
}
