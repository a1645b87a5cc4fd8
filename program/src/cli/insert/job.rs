//! In: a station, a robot, a camera, a recipe. Out: the insertion, step by step, each motion shown and confirmed; the
//! job's report.
//! Frame and unit: base frame; poses in the robot's own notation; mm, s.

use super::moving::Moving;
use crate::cli::terminal::console::Console;
use crate::procedure::InsertOrder;
use sheetlight::fault::{Fault, Result};
use sheetlight::station::Settings;
use sheetlight::station::job::{Job, JobReport, Outcome, Phase, Resumes};
use std::path::{Path, PathBuf};

/// Insert a part with a linked robot: touch, scan, find, approach, insert, retract
///
/// Jog the arm until the board is in view, with the component in the gripper. Every motion is shown with its gates;
/// one confirmation allows one motion. Without --allow-motion nothing moves. The state is in --out: after an
/// interruption the same command continues or backs out. Ctrl-C halts the arm.
///
/// Sheetlight is not a safety device: somebody stands at the emergency stop.
#[derive(clap::Args)]
#[command(after_help = "Example, with a simulated cell:
  sheetlight cell simulate --part osc --station cell --robot-port 5007 --camera-port 5017
  sheetlight job --station cell --robot bcap://127.0.0.1:5007 --out job1 --allow-motion --yes \\
      --camera cell://127.0.0.1:5017?rate=-1 --recipe data/recipes/osc.toml
Guide: docs/robots.md")]
pub struct Args {
    #[command(flatten)]
    moving: Moving,
    #[command(flatten)]
    order: InsertOrder,
    /// Folder of the job: state, recordings, scan, report; with --repeat one folder per job
    #[arg(long)]
    out: PathBuf,
    /// Number of jobs in a row; the first that is stopped ends them
    #[arg(long, default_value_t = 1)]
    repeat: u32,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let moving = &args.moving;
    let settings = Settings::load(&moving.station)?;
    let mut guard = moving.guard()?;
    let order = InsertOrder { speed_mm_s: moving.speed, ..args.order.clone() };
    let mut reports = Vec::new();
    for k in 0..args.repeat.max(1) {
        let out = if args.repeat > 1 { args.out.join(format!("job_{k:04}")) } else { args.out.clone() };
        let options = order.options(&moving.station, &settings, PathBuf::from(&order.recipe), out.clone());
        let mut person = moving.person(console);
        let report = Job::open(&options, &mut guard, moving.camera.open(None)?, &mut person)?.run()?;
        let stopped = report.outcome == Outcome::Stopped;
        let (why, next) = (report.why.clone(), report.next());
        let over = report.resumes == Resumes::Over;
        let how = if over { "it wants another --out" } else { "the same command resumes it" };
        reports.push(report);
        if stopped {
            console.result(&reports, &text(&reports));
            return Err(Fault::refused(format!("the job was stopped: {why}"))
                .cause("a condition named above is not met")
                .next(format!("{next}; {how}; {} has the reason", shown(&out))));
        }
    }
    console.result(&reports, &text(&reports));
    Ok(())
}

fn shown(path: &Path) -> String {
    path.join("report.json").display().to_string()
}

fn text(reports: &[JobReport]) -> String {
    let one = |r: &JobReport| {
        let position = r.time_to_position_s.map_or("no position".into(), |s| {
            format!("position confirmed after {s:.1} s and {} confirmations", r.confirmations_to_position.unwrap_or(0))
        });
        let end = if r.outcome == Outcome::Inserted { "inserted".into() } else { format!("stopped: {}", r.why) };
        let step = |(phase, s): (&Phase, &f64)| format!("{} {s:.1} s", format!("{phase:?}").to_lowercase());
        let steps = r.seconds_by_phase.iter().map(step).collect::<Vec<_>>().join(", ");
        format!("{end}; {position}; {:.1} s and {} confirmations in all ({steps})", r.seconds, r.confirmations)
    };
    reports.iter().map(one).collect::<Vec<_>>().join("\n")
}
