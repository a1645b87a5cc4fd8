//! In: a station, a recipe, optionally a robot that reports its pose. Out: the path of the line over the part, its
//! margins, and matching speed and step; nothing moves.
//! Frame and unit: base frame; poses in the robot's own notation; mm, mm/s, pictures a second.

use crate::cli::terminal::console::Console;
use sheetlight::fault::Result;
use sheetlight::find::Recipe;
use sheetlight::rig::Rig;
use sheetlight::robot::Convention;
use sheetlight::station::job::{JobState, Preview, PreviewOptions, preview};
use sheetlight::station::{Settings, load_report};
use std::path::PathBuf;

/// Show how a job will sweep the line over a part, before anything moves
///
/// The same sweep as in sheetlight job: its length, step and shots, and how far the part may lie off the picture's
/// middle. It also shows the remaining distance to the limits of the working volume and of [motion]. Until a job has
/// touched the board, the board is taken to lie squarely before the camera. Below stands the pace of a scan that does
/// not stop for its pictures (sheetlight scan --camera): speed, step and pictures per second, and whether camera,
/// chain or arm limits them.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight sweep --station cell3 --recipe data/recipes/led.toml --robot bcap://10.0.0.2
  sheetlight sweep --station cell3 --recipe led.toml --camera-rate 60 --scan scans/a --step 0.1
Guide: docs/robots.md")]
pub struct Args {
    /// Station folder; its station.toml may state [motion]
    #[arg(long)]
    station: PathBuf,
    /// Recipe (TOML) of the part
    #[arg(long)]
    recipe: PathBuf,
    /// Robot whose present pose is read: bcap://HOST[:5007], ur://HOST, file:POSES.json
    #[arg(long)]
    robot: Option<String>,
    /// Folder of a job; its touched board is used
    #[arg(long, conflicts_with = "robot")]
    job: Option<PathBuf>,
    /// Distance from the camera to the board along its axis, mm [default: the rig's working distance]
    #[arg(long, conflicts_with = "job")]
    distance: Option<f64>,
    /// Length of the sweep, mm [default: the job's]
    #[arg(long)]
    sweep: Option<f64>,
    /// Step between shots, mm [default: the job's]
    #[arg(long)]
    step: Option<f64>,
    /// Speed, mm/s [default: the fastest that camera, chain and station allow]
    #[arg(long)]
    speed: Option<f64>,
    /// Pictures per second of the camera
    #[arg(long, value_name = "HZ")]
    camera_rate: Option<f64>,
    /// A finished scan of such pictures; its shots per second are used
    #[arg(long)]
    scan: Option<PathBuf>,
    /// Notation in which poses are shown [default: the station's, else matrix]
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Convention>)]
    notation: Option<Convention>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load(&args.station)?);
    let recipe = Recipe::load(&args.recipe)?;
    let start = match &args.robot {
        Some(uri) => Some(sheetlight::arm::open(uri)?.pose()?.base_from_flange),
        None => None,
    };
    let options = PreviewOptions {
        job: args.job.as_deref().map(JobState::load).transpose()?.flatten(),
        start,
        now: None,
        distance_mm: args.distance,
        sweep_mm: args.sweep,
        step_mm: args.step,
        speed_mm_s: args.speed,
        camera_hz: args.camera_rate,
        chain_hz: args.scan.as_deref().map(load_report).transpose()?.map(|r| r.shots_per_second),
    };
    let shown = preview(&settings, &rig, &recipe, &options)?;
    console.result(&shown, &text(&shown, args.notation.or(settings.robot).unwrap_or(Convention::Matrix)));
    Ok(())
}

fn text(p: &Preview, robot: Convention) -> String {
    let mut lines = vec![format!(
        "{}, {}",
        p.recipe,
        if p.touched { "over the board that was touched" } else { "the board taken to lie squarely before the camera" }
    )];
    lines.extend(p.sweep.says());
    lines.push(format!("{:.3} mm from one shot to the next", p.sweep.step_mm));
    for (name, pose) in ["first", "last"].iter().zip(p.flange.iter().flatten()) {
        let numbers: Vec<String> = robot.write(pose).iter().map(|v| format!("{v:.3}")).collect();
        lines.push(format!("flange at the {name} shot: {} ({})", numbers.join(" "), robot.labels().join(", ")));
    }
    match &p.pace {
        Some(pace) => {
            lines.push(format!("without stopping: {}", pace.words()));
            let bears = pace.bears.iter().map(|(name, v)| format!("{name} {v:.1} mm/s"));
            lines.push(format!("at this step: {}", bears.collect::<Vec<_>>().join(", ")));
        }
        None => lines.push("what limits its speed is not known: give --camera-rate, --scan or --speed".into()),
    }
    lines.join("\n")
}
