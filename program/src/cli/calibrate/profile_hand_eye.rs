//! In: profiles of a ball or a plate and robot poses. Out: a line-profile sensor's pose on the flange.
//! Frame and unit: flange_T_sensor; mm, degrees.

use super::store::{Keep, finish};
use crate::cli::terminal::console::Console;
use crate::procedure::calibrate::Solved;
use sheetlight::calibrate::limits::Asked;
use sheetlight::calibrate::profile_sensor::ball::evaluate::Evaluation;
use sheetlight::calibrate::profile_sensor::ball::options::{BallOptions, Side};
use sheetlight::calibrate::profile_sensor::missing::Heights;
use sheetlight::calibrate::profile_sensor::plane::evaluate::PlaneEvaluation;
use sheetlight::calibrate::profile_sensor::plane::options::PlaneOptions;
use sheetlight::fault::Result;
use sheetlight::rig::Volume;
use sheetlight::robot::Convention;
use sheetlight::station::{
    ProfileEvaluation, ProfileTarget, Settings, calibrate_profile_hand_eye, evaluate_profile_hand_eye,
};
use std::path::{Path, PathBuf};

/// Calibrate a line-profile sensor's pose on the flange with a ball or a flat plate
///
/// The sensor measures x along its line and z away from it, both mm; y = z × x. Ball or plate stand still. The side of
/// the profile plane on which a ball's centre lies must follow from the data or be stated. A plate needs profiles at
/// tilts of several sizes about two axes. With --evaluate nothing is calibrated: a given transform is tested.
#[derive(clap::Args)]
#[command(group = clap::ArgGroup::new("target").required(true).args(["ball_diameter_mm", "plane"]))]
#[command(after_help = "Examples:
  sheetlight calibrate profile-hand-eye profiles/ --poses BALL.LS \\
      --ball-diameter-mm 30 --station cell3
  sheetlight calibrate profile-hand-eye profiles/ --poses PLATE.LS --plane --station cell3
  sheetlight calibrate profile-hand-eye profiles/ --poses BALL.LS \\
      --ball-diameter-mm 30 --evaluate theirs.json
Guide: docs/calibration.md, Line-profile sensor")]
pub struct Args {
    /// Folder with one profile per file, or one file with all: CSV (x, z), OpenCV YAML, or plain numbers
    profiles: PathBuf,
    /// Poses in the profiles' order: CSV or JSON as in a recording, or a FANUC listing (.LS)
    #[arg(long)]
    poses: PathBuf,
    /// The target is a ball of this diameter, mm
    #[arg(long, value_name = "MM")]
    ball_diameter_mm: Option<f64>,
    /// The target is a flat plate
    #[arg(long)]
    plane: bool,
    /// Side of the ball's centre: plus (y > 0 of the sensor, y = z × x) or minus [default: from the data]
    #[arg(long, conflicts_with = "plane", value_parser = crate::cli::terminal::arguments::parse::<Side>)]
    side: Option<Side>,
    /// z that means "not measured", mm; values that are not finite are always skipped
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    missing: Option<f64>,
    /// z of the profiles grows towards the sensor: it is negated; scan-profiles needs the same
    #[arg(long)]
    z_up: bool,
    /// Station folder for the result
    #[arg(long, required_unless_present = "evaluate")]
    station: Option<PathBuf>,
    /// Depth (the sensor's z) of the stated error, mm [default: middle of the points]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    working_mm: Option<f64>,
    /// Test a transform: JSON with flange_T_sensor (16 numbers, or a stored profile_hand_eye.json)
    #[arg(long, conflicts_with_all = ["station", "side"])]
    evaluate: Option<PathBuf>,
    #[command(flatten)]
    keep: Keep,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let heights = Heights { missing: args.missing, up: args.z_up };
    let target = match args.ball_diameter_mm {
        Some(d) => ProfileTarget::Ball(BallOptions { side: args.side, heights, ..BallOptions::new(d) }),
        None => ProfileTarget::Plane(PlaneOptions { heights, ..PlaneOptions::default() }),
    };
    if let Some(transform) = &args.evaluate {
        return put_to_the_test(args, transform, &target, console);
    }
    let station = args.station.as_deref().expect("clap: required without --evaluate");
    // The result may be the first content of the station.
    let settings = if station.exists() { Settings::load(station)? } else { Settings::default() };
    let working = args.working_mm.map(|mm| Volume::new(mm, mm, "stated"));
    let asked = Asked { working, tolerance_mm: settings.tolerance_mm };
    let (c, warnings) = calibrate_profile_hand_eye(&args.profiles, &args.poses, &target, &asked)?;
    warnings.iter().for_each(|w| console.warn(w));
    let n = Convention::Denso.write(&c.calibration.value);
    let value = format!(
        "sensor on the flange: {:.4} {:.4} {:.4} mm, RX {:.4} RY {:.4} RZ {:.4} degrees (R = Rz·Ry·Rx)",
        n[0], n[1], n[2], n[3], n[4], n[5]
    );
    finish(station, &Solved::of(c, value), &args.keep, console)
}

fn put_to_the_test(args: &Args, transform: &Path, target: &ProfileTarget, console: &Console) -> Result<()> {
    let (found, warnings) = evaluate_profile_hand_eye(&args.profiles, &args.poses, transform, target)?;
    warnings.iter().for_each(|w| console.warn(w));
    let text = match &found {
        ProfileEvaluation::Ball(ball) => on_ball(ball, args.ball_diameter_mm.unwrap_or(f64::NAN)),
        ProfileEvaluation::Plane(plane) => on_plane(plane),
    };
    console.result(&found, text.trim_end());
    Ok(())
}

fn on_ball(found: &Evaluation, diameter: f64) -> String {
    let mut text = format!(
        "the profiles' points lie on one ball of {diameter:.3} mm to {:.4} mm rms; with the diameter left free on one \
         of {:.3} mm to {:.4} mm\n",
        found.rms, found.free_diameter, found.free_rms
    );
    text += &format!("ball in the base: {:.3} {:.3} {:.3} mm\n", found.ball.x, found.ball.y, found.ball.z);
    for (name, points, rms) in &found.profiles {
        text += &format!("  {name}: {points} points on the ball, {rms:.4} mm rms\n");
    }
    text
}

fn on_plane(found: &PlaneEvaluation) -> String {
    let (n, d) = (found.plane.normal, found.plane.offset);
    let mut text = format!(
        "the profiles' points lie on one plane to {:.4} mm rms; each on its own line to {:.4} mm\n",
        found.rms, found.line_rms
    );
    text += &format!("plane in the base: normal {:.6} {:.6} {:.6}, offset {d:.4} mm\n", n.x, n.y, n.z);
    for (name, points, rms, mean) in &found.profiles {
        text += &format!("  {name}: {points} points on the line, {rms:.4} mm rms, {mean:+.4} mm on average\n");
    }
    for (name, why) in &found.excluded {
        text += &format!("  {name} was excluded: {why}\n");
    }
    text
}
