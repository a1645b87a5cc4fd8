//! In: recordings of pointer and line, a recipe, a station. Out: the insertion procedure step by step, each step
//! with its numbers and, where a person has to decide, a question.
//! Frame and unit: base frame; poses in the robot's own notation.

use crate::cli::terminal::console::Console;
use sheetlight::fault::{Fault, Result};
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::station::{GuideOptions, Settings, Step, guide};
use std::io::{BufRead, IsTerminal};
use std::path::PathBuf;

/// Go through a whole insertion with recordings instead of a robot
///
/// Touch the board with the pointer, look at it squarely, scan, find the part, approach, insert, retract. Every step
/// prints its measurements and asks before the robot would move.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight guide --station cell3 --touch recordings/touch --scan recordings/led \\
      --recipe data/recipes/led.toml --robot denso --out job17 --yes
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    /// Station folder with camera, laser plane, pointer and hand-eye calibrated
    #[arg(long)]
    station: PathBuf,
    /// Recording of the pointer's spot on three or more points of the board
    #[arg(long)]
    touch: PathBuf,
    /// Pose file of that recording, without extension [default: the one in meta.json]
    #[arg(long, value_name = "FILE")]
    touch_poses: Option<String>,
    /// Recording of the line over the part
    #[arg(long)]
    scan: PathBuf,
    /// Pose file of that recording, without extension [default: the one in meta.json]
    #[arg(long, value_name = "FILE")]
    scan_poses: Option<String>,
    /// Recipe (TOML) of the part
    #[arg(long)]
    recipe: PathBuf,
    /// Folder for the scan, the picture and guide.json
    #[arg(long)]
    out: PathBuf,
    /// Notation of the poses: denso, ur, kuka, ... (docs/conventions.md) [default: the station's, else matrix]
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Convention>)]
    robot: Option<Convention>,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
    /// Distance of the camera from the board in the square view, mm [default: middle of the working volume]
    #[arg(long, value_name = "MM")]
    view_mm: Option<f64>,
    /// Largest angle between the touched board and the found part, degrees
    #[arg(long, value_name = "DEG", default_value_t = 3.0)]
    max_tilt_deg: f64,
    /// Answer every question with yes; recordings and simulated stations only
    #[arg(long)]
    yes: bool,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    sheetlight::files::make_folder(&args.out)?;
    let robot = args.robot.or(Settings::load(&args.station)?.robot).unwrap_or(Convention::Matrix);
    let options = GuideOptions {
        station: args.station.clone(),
        touch: args.touch.clone(),
        touch_poses: args.touch_poses.clone(),
        scan: args.scan.clone(),
        scan_poses: args.scan_poses.clone(),
        recipe: args.recipe.clone(),
        out: args.out.clone(),
        robot,
        place: args.on,
        view_mm: args.view_mm,
        max_tilt_deg: args.max_tilt_deg,
    };
    let mut number = 0;
    let guided = guide(&options, &mut |step| {
        number += 1;
        console.say(described(number, step));
        match &step.asks {
            Some(_) if args.yes => Ok(true),
            Some(question) => ask(question, console),
            None => Ok(true),
        }
    })?;
    let text: Vec<String> = guided.steps.iter().enumerate().map(|(i, s)| described(i + 1, s)).collect();
    console.result(&guided, &text.join("\n"));
    Ok(())
}

fn described(number: usize, step: &Step) -> String {
    let mut s = format!("{number}. {}", step.name);
    for line in &step.says {
        s += &format!("\n   {line}");
    }
    if let Some(pose) = &step.pose {
        s += &format!("\n   pose {}", pose.iter().map(|v| format!("{v:.4}")).collect::<Vec<_>>().join(" "));
    }
    s
}

/// A yes from the terminal; any other answer is a no. Without a terminal the question cannot be answered.
fn ask(question: &str, console: &Console) -> Result<bool> {
    if !std::io::stdin().is_terminal() {
        return Err(Fault::usage(format!("nobody can answer '{question}': standard input is not a terminal"))
            .next("run it in a terminal, or pass --yes for recordings and simulated stations"));
    }
    console.ask(&format!("   {question} [y/N] "));
    let mut line = String::new();
    std::io::stdin()
        .lock()
        .read_line(&mut line)
        .map_err(|e| Fault::input(format!("standard input: {e}")).next("run it in a terminal"))?;
    Ok(matches!(line.trim(), "y" | "Y" | "yes"))
}
