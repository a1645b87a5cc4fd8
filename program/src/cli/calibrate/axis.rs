//! In: a recording of a board that is mounted on a linear axis or turntable. Out: its direction and pitch, or its
//! axis.
//! Frame and unit: camera frame; mm, rad a count.

use super::store::{Keep, finish};
use crate::cli::terminal::console::Console;
use sheetlight::fault::Result;
use sheetlight::geometry::AxisKind;
use sheetlight::raster::Channel;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::station::volume::asked;
use sheetlight::station::{AxisRun, Settings, calibrate_axis};
use std::path::PathBuf;

/// Calibrate a linear axis or turntable
///
/// A board of any kind rides on the axis. Each frame has a picture of it in room light and the axis' count. meta.json
/// states the motion: its kind (linear, turntable), what it carries, and the unit of the counts
/// (docs/file-formats.md). The axis may also carry the sensor over a fixed board. Use uneven stops, so that counts of
/// another picture or order are detected. Between neighbouring stops a turntable turns by less than half a turn.
/// Scans of such recordings need no hand-eye.
#[derive(clap::Args)]
#[command(after_help = "From calibration to cloud:
  sheetlight calibrate camera      recordings/intrinsics --station belt1
  sheetlight calibrate laser-plane recordings/laserplane --station belt1
  sheetlight calibrate axis        recordings/axis       --station belt1
  sheetlight scan recordings/parcel4 --station belt1 --out scans/parcel4
Try it without a belt:
  sheetlight simulate --motion linear --set intrinsics,laserplane,axis,scan --out belt
Guide: docs/scanning.md")]
pub struct Args {
    /// Recording of a board on the axis, with a picture and a count per frame
    recording: PathBuf,
    /// Station folder with the camera's calibration
    #[arg(long)]
    station: PathBuf,
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
    let run = AxisRun { asked: asked(&settings, None), ..AxisRun::default() };
    let bar = console.bar("boards", 0);
    let progress = |done: usize, all: usize| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    };
    let c = calibrate_axis(&recording, &rig, &run, &progress)?;
    bar.finish_and_clear();
    let a = c.calibration.value;
    let (d, p) = (a.direction(), a.origin());
    let text = match a.kind {
        AxisKind::Linear => format!(
            "linear axis: {:.8} mm a {} along {:.6} {:.6} {:.6} (camera frame)",
            a.pitch,
            a.unit.name(),
            d.x,
            d.y,
            d.z
        ),
        AxisKind::Turntable => format!(
            "turntable: {:.8} degrees a {} about {:.6} {:.6} {:.6} through {:.4} {:.4} {:.4} mm (camera frame)",
            a.pitch.to_degrees(),
            a.unit.name(),
            d.x,
            d.y,
            d.z,
            p.x,
            p.y,
            p.z
        ),
    };
    finish(&args.station, &c.calibration, &c.page, &text, &args.keep, console)
}
