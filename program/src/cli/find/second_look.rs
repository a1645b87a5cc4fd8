//! In: a finished scan of a part, its recording's poses, a recipe, a station. Out: the robot poses of a
//! verification scan of the same part from another side, and which errors of which calibration both scans together
//! can show.
//! Frame and unit: base frame; mm, degrees.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use sheetlight::fault::Result;
use sheetlight::find::{LookPlan, Recipe};
use sheetlight::recording::{Recording, save_poses};
use sheetlight::robot::Convention;
use sheetlight::station::{Settings, second_look};
use std::path::PathBuf;

/// Plan a verification scan of a part from another side
///
/// An error of calibration, delay, convention or robot moves the part differently in a scan from another side. The
/// second scan is the first one turned about the part's normal and tilted, because a turn alone cannot show an error
/// along the approach. Check every pose for reach and collision before the robot goes there.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight second-look scans/b7 --recording recordings/b7 --recipe led.toml --station cell3 \\
      --out second.json
  (scan along the poses in second.json, then)
  sheetlight find scans/b7 scans/b7again --recipe led.toml --station cell3 --out led.json
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    /// Folder from sheetlight scan --out
    scan: PathBuf,
    /// Recording of that scan; its poses are turned
    #[arg(long)]
    recording: PathBuf,
    /// Pose file of the recording [default: the one in meta.json]
    #[arg(long)]
    poses: Option<String>,
    /// Recipe of the part (TOML)
    #[arg(long)]
    recipe: PathBuf,
    /// Station of the scan
    #[arg(long)]
    station: PathBuf,
    /// Turn about the part's normal, degrees, 60 to 300
    #[arg(long, default_value_t = 180.0)]
    turn: f64,
    /// Tilt about the part's x, degrees, 10 to 45 to either side
    #[arg(long, default_value_t = 20.0, allow_hyphen_values = true)]
    tilt: f64,
    /// File for the flange poses, one per shot of the first scan (JSON, base_T_flange)
    #[arg(long)]
    out: PathBuf,
}

/// The output of --json.
#[derive(serde::Serialize)]
struct Planned<'a> {
    turn_deg: f64,
    tilt_deg: f64,
    shots: usize,
    shown: &'a [sheetlight::find::Shown],
    hidden: Vec<String>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let inputs = Inputs { files: &[&args.recipe], scans: &[&args.scan], station: Some(&args.station) };
    outputs::check(&[&args.out], &inputs)?;
    let recipe = Recipe::load(&args.recipe)?;
    let poses = Recording::open(&args.recording)?.poses(args.poses.as_deref())?;
    let look = second_look(&args.scan, &poses, &recipe, &args.station, args.turn, args.tilt)?;
    save_poses(&args.out, &look.flanges)?;
    let robot = Settings::load(&args.station)?.robot.unwrap_or(Convention::Matrix);
    let planned = Planned {
        turn_deg: args.turn,
        tilt_deg: args.tilt,
        shots: look.flanges.len(),
        shown: &look.plan.shown,
        hidden: look.plan.hidden(),
    };
    console.result(&planned, &summary(&look.plan, &look.flanges, robot));
    console.say(format!("see {}; check reach and collisions before the robot goes there", args.out.display()));
    Ok(())
}

fn summary(
    plan: &LookPlan,
    flanges: &[sheetlight::geometry::Rigid<sheetlight::geometry::Base, sheetlight::geometry::Flange>],
    robot: Convention,
) -> String {
    let mut s = format!("{} shots; flange poses ({}: {})\n", flanges.len(), robot.name(), robot.labels().join(", "));
    for (name, pose) in [("first", flanges.first()), ("last", flanges.last())] {
        if let Some(pose) = pose {
            let numbers: Vec<String> = robot.write(pose).iter().map(|v| format!("{v:.4}")).collect();
            s += &format!("{name:12} {}\n", numbers.join(" "));
        }
    }
    s += "share of each parameter's pose error that shows as a difference between the scans\n";
    for shown in &plan.shown {
        s += &format!("  {:12} {:10} {:4.0} %\n", shown.calibration, shown.parameter, 100.0 * shown.share);
    }
    match plan.hidden().as_slice() {
        [] => s + "nothing stays hidden\n",
        hidden => s + &format!("hidden: {}\n", hidden.join("; ")),
    }
}
