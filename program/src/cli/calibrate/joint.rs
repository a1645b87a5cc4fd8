//! In: recordings of boards and a station. Out: the station's whole rig from one solve, stored together.
//! Frame and unit: mm, degrees.

use super::mount;
use super::store::{Keep, figures, stale};
use crate::cli::terminal::console::Console;
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::Channel;
use sheetlight::recording::Recording;
use sheetlight::rig::{Rig, Verdict};
use sheetlight::scan::Where;
use sheetlight::station::volume::asked;
use sheetlight::station::{JointResult, JointRun, Settings, calibrate_joint, store_joint};
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
    /// Recording folders with meta.json
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Station folder for the results
    #[arg(long)]
    station: PathBuf,
    /// Pose file of the recordings with robot poses, without extension [default: the one in meta.json]
    #[arg(long)]
    poses: Option<String>,
    #[command(flatten)]
    mount: mount::Where,
    /// Nearest and farthest depth of the stated error, mm [default: the working volume, else where boards were lit]
    #[arg(long, num_args = 2, value_names = ["NEAR", "FAR"])]
    working_mm: Option<Vec<f64>>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = crate::cli::terminal::arguments::parse::<Channel>)]
    channel: Channel,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
    #[command(flatten)]
    keep: Keep,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load_camera(&args.station)?);
    let mut recordings = args.recordings.iter().map(|r| Recording::open(r)).collect::<Result<Vec<_>>>()?;
    recordings.iter_mut().for_each(|r| r.channel = args.channel);
    let asked = asked(&settings, args.working_mm.as_ref().map(|w| [w[0], w[1]]));
    let mount = args.mount.of(&args.station, &settings, console)?;
    let run = JointRun { poses: args.poses.clone(), ..JointRun::new(mount, asked, &settings.extraction, args.on) };
    let bar = console.bar("boards", 0);
    let progress = |done: usize, all: usize| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    };
    let result = calibrate_joint(&recordings, &rig, &run, &progress)?;
    bar.finish_and_clear();
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
