//! In: a recording of boards with the pointer's spot on them. Out: the beam.
//! Frame and unit: camera frame, mm.

use super::store::{Keep, finish};
use crate::cli::terminal::console::Console;
use sheetlight::calibrate::pointer::solve::PointerOptions;
use sheetlight::calibrate::pointer::spot::SpotOptions;
use sheetlight::fault::Result;
use sheetlight::raster::Channel;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::station::volume::asked;
use sheetlight::station::{PointerRun, Settings, calibrate_pointer};
use std::path::PathBuf;

/// Calibrate the laser pointer's beam from pictures of its spot on boards
///
/// Each frame has an ambient picture, which gives the board's pose, and a laser picture of the same pose. Room light
/// in the laser picture is subtracted. The camera's calibration is fixed, and its uncertainty is propagated.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight calibrate pointer recordings/pointer_cal --station cell3
Guide: docs/calibration.md")]
pub struct Args {
    /// Recording with an ambient and a laser picture per frame
    recording: PathBuf,
    /// Station folder with the camera's calibration
    #[arg(long)]
    station: PathBuf,
    /// Nearest depth at which the result is judged, mm [default: station.toml's, else where spots were]
    #[arg(long, value_name = "MM", requires = "far_mm")]
    near_mm: Option<f64>,
    /// Farthest depth at which the result is judged, mm
    #[arg(long, value_name = "MM", requires = "near_mm")]
    far_mm: Option<f64>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = crate::cli::terminal::arguments::parse::<Channel>)]
    channel: Channel,
    #[command(flatten)]
    keep: Keep,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let mut recording = Recording::open(&args.recording)?;
    recording.channel = args.channel;
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load_to_calibrate(&args.station)?);
    let run = PointerRun {
        spots: SpotOptions::default(),
        solver: PointerOptions::default(),
        asked: asked(&settings, args.near_mm.zip(args.far_mm).map(<[f64; 2]>::from)),
    };
    let bar = console.bar("boards", 0);
    let progress = |done: usize, all: usize| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    };
    let c = calibrate_pointer(&recording, &rig, &run, &progress)?;
    bar.finish_and_clear();
    let (o, d) = (c.calibration.value.origin, c.calibration.value.direction);
    let text = format!(
        "pointer: through {:.4} {:.4} {:.4} mm along {:.7} {:.7} {:.7} (camera frame)",
        o.x, o.y, o.z, d.x, d.y, d.z
    );
    finish(&args.station, &c.calibration, &c.page, &text, &args.keep, console)
}
