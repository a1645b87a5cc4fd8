//! In: a recording of boards with the stripe on them. Out: the laser plane.
//! Frame and unit: camera frame, mm.

use super::store::{Keep, finish};
use crate::cli::terminal::console::Console;
use sheetlight::calibrate::laser_plane::options::LaserPlaneOptions;
use sheetlight::fault::Result;
use sheetlight::raster::Channel;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::Where;
use sheetlight::station::volume::asked;
use sheetlight::station::{LaserPlaneRun, Settings, calibrate_laser_plane};
use std::path::PathBuf;

/// Calibrate the laser plane from pictures of the stripe on boards
///
/// Each frame has an ambient picture, which gives the board's pose, and a laser picture of the same pose. Room light
/// in the laser picture is subtracted. The stripe is found as in a scan. Only peaks on the board and away from the
/// print's edges count. The camera's calibration is fixed, and its uncertainty is propagated.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight calibrate laser-plane recordings/laserplane --station cell3
Guide: docs/calibration.md")]
pub struct Args {
    /// Recording with an ambient and a laser picture per frame
    recording: PathBuf,
    /// Station folder with the camera's calibration
    #[arg(long)]
    station: PathBuf,
    /// Nearest depth at which the result is judged, mm [default: station.toml's, else where boards were lit]
    #[arg(long, value_name = "MM", requires = "far_mm")]
    near_mm: Option<f64>,
    /// Farthest depth at which the result is judged, mm
    #[arg(long, value_name = "MM", requires = "near_mm")]
    far_mm: Option<f64>,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
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
    let run = LaserPlaneRun {
        solver: LaserPlaneOptions::default(),
        asked: asked(&settings, args.near_mm.zip(args.far_mm).map(<[f64; 2]>::from)),
        extraction: settings.extraction.clone(),
        place: args.on,
    };
    let bar = console.bar("boards", 0);
    let progress = |done: usize, all: usize| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    };
    let c = calibrate_laser_plane(&recording, &rig, &run, &progress)?;
    bar.finish_and_clear();
    let p = c.calibration.value;
    let text = format!(
        "laser plane: normal {:.6} {:.6} {:.6}, offset {:.4} mm (camera frame)",
        p.normal.x, p.normal.y, p.normal.z, p.offset
    );
    finish(&args.station, &c.calibration, &c.page, &text, &args.keep, console)
}
