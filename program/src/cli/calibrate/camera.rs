//! In: a recording of a board and a station. Out: the station's camera calibration and a report page.
//! Frame and unit: camera frame; pixels, mm.

use super::store::{Keep, finish};
use crate::cli::terminal::console::Console;
use sheetlight::calibrate::camera::intrinsics::{Boards, SolveOptions};
use sheetlight::calibrate::camera::lens::Lens;
use sheetlight::calibrate::camera::procedure::{CameraOptions, CameraResult, calibrate};
use sheetlight::calibrate::camera::report::page;
use sheetlight::camera::NAMES;
use sheetlight::fault::Result;
use sheetlight::raster::Channel;
use sheetlight::recording::Recording;
use sheetlight::station::Settings;
use sheetlight::station::volume::asked;
use std::path::PathBuf;

/// Calibrate the camera from pictures of a board
///
/// Take 10 to 20 pictures with the board tilted by 20 to 40 degrees in different directions, reaching into the
/// picture's corners. The board's description is in the recording's meta.json. Several recordings of the same camera,
/// also of other boards, are solved together.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight calibrate camera recordings/boards --station cell3
  sheetlight calibrate camera recordings/boards recordings/handeye --station cell3
Guide: docs/calibration.md")]
pub struct Args {
    /// Recording folders with meta.json
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Station folder for the result
    #[arg(long)]
    station: PathBuf,
    /// Lens terms: evidence (what the pictures determine), none, one (k1), four (k1 k2 p1 p2), five (k3 too),
    /// rational (and k4 k5 k6), prism (five and s1..s4), scheimpflug (k1 k2 k3 and tilt), all (OpenCV's 14)
    #[arg(long, default_value = "evidence", value_parser = crate::cli::terminal::arguments::parse::<Lens>)]
    lens: Lens,
    /// Estimate the skew too; sensors with square rows have none
    #[arg(long)]
    skew: bool,
    /// Shape of the board: evidence (estimated if 8 or more pictures determine it), drawn (as drawn), shaped (always
    /// estimated)
    #[arg(long, default_value = "evidence", value_parser = crate::cli::terminal::arguments::parse::<Boards>)]
    board: Boards,
    /// Distance at which the expected error is judged, mm [default: middle of the working volume, else of the boards]
    #[arg(long, value_name = "MM")]
    working_mm: Option<f64>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = crate::cli::terminal::arguments::parse::<Channel>)]
    channel: Channel,
    #[command(flatten)]
    keep: Keep,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let settings = Settings::load(&args.station)?;
    let mut recordings = args.recordings.iter().map(|r| Recording::open(r)).collect::<Result<Vec<_>>>()?;
    recordings.iter_mut().for_each(|r| r.channel = args.channel);
    let options = CameraOptions {
        solve: SolveOptions { lens: args.lens, skew: args.skew, boards: args.board, ..SolveOptions::default() },
        asked: asked(&settings, args.working_mm.map(|mm| [mm, mm])),
        ..CameraOptions::default()
    };
    let pictures: usize = recordings.iter().map(|r| r.meta.frames.len()).sum();
    let bar = console.bar("finding boards", pictures as u64);
    let result = calibrate(&recordings, &options, &|done, _| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    let page = page(&result, &format!("Camera calibration of {}", settings.name));
    finish(&args.station, &result.calibration, &page, &parameters(&result), &args.keep, console)?;
    if !result.left_out.is_empty() {
        let all = result.left_out.len() + result.used.len();
        console.warn(format!(
            "{} of {all} pictures were excluded; the reasons stand above. Compare your scans with the excluded \
             pictures: if the scans look like these, the calibration is wrong for them",
            result.left_out.len()
        ));
    }
    Ok(())
}

/// The parameters with their standard deviations, and the expected error.
fn parameters(result: &CameraResult) -> String {
    let (c, k) = (&result.calibration, result.calibration.value.parameters());
    let mut text = String::from("camera");
    let stated = |name: &str| c.covariance.parameters.iter().any(|p| p == name);
    for (name, value) in NAMES.iter().zip(k.iter()).filter(|(name, _)| stated(name)) {
        text += &format!("\n  {name:9} {value:12.6} +- {:.6}", c.covariance.sigma(name).unwrap_or(f64::NAN));
    }
    let figure = |name: &str| c.quality.figures.get(name).copied().unwrap_or(f64::NAN);
    let px = figure("expected_ray_error_where_seen_px");
    let mm = figure("expected_error_at_working_distance_mm");
    text += &match px.is_finite() && mm.is_finite() {
        true => format!(
            "\nexpected error of the viewing rays where boards were seen {px:.4} px, {mm:.4} mm at {:.0} mm",
            figure("working_distance_mm"),
        ),
        false => "\nexpected error of the viewing rays: unknown, the pictures do not determine all parameters".into(),
    };
    text
}
