//! In: a found pose (the JSON of find --out). Out: approach, insertion and retract as a program in a robot's
//! language.
//! Frame and unit: the tool in the robot's base frame; mm, mm/s.

use crate::cli::terminal::console::Console;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Rigid, Tool};
use sheetlight::robot::program::{Insertion, Language, program};
use std::path::PathBuf;

/// Write a found pose as a program for the robot's own controller
///
/// Straight to the approach, down, back up; a comment marks where the gripper opens. The inserting tool has to be
/// selected on the controller. Languages: pacscript (Denso), urscript, krl (KUKA), tp (FANUC, .LS), rapid (ABB).
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight program pose.json --to urscript --out insert.script
Guide: docs/finding-and-inserting.md")]
pub struct Args {
    /// Report from sheetlight find --out
    pose: PathBuf,
    /// Language: pacscript (Denso), urscript, krl (KUKA), tp (FANUC) or rapid (ABB)
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Language>)]
    to: Language,
    /// File of the program
    #[arg(long)]
    out: PathBuf,
    /// Speed of the tool, mm/s, 1 to 250
    #[arg(long, default_value_t = 50.0)]
    speed: f64,
}

#[derive(serde::Deserialize)]
struct Found {
    recipe: String,
    poses: Option<Poses>,
}

#[derive(serde::Deserialize)]
struct Poses {
    approach: Pose,
    insertion: Pose,
    retract: Pose,
}

#[derive(serde::Deserialize)]
struct Pose {
    base_from_tool: Rigid<Base, Tool>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    if !(1.0..=250.0).contains(&args.speed) {
        return Err(
            Fault::usage(format!("the speed is {} mm/s, 1 to 250 are written", args.speed)).next("correct --speed")
        );
    }
    sheetlight::files::not_over(&args.out, [args.pose.as_path()])?;
    let text = sheetlight::files::read_text(&args.pose)?;
    let found: Found = serde_json::from_str(&text).map_err(|e| {
        Fault::input(format!("{}: contains no pose: {e}", args.pose.display()))
            .cause("another file than the one that sheetlight find --out wrote")
            .next("give that file")
    })?;
    let Some(poses) = found.poses else {
        return Err(Fault::refused(format!(
            "{}: '{}' was refused, so there is no pose",
            args.pose.display(),
            found.recipe
        ))
        .cause("a gate of the recipe was not met")
        .next("look at the reasons in the file"));
    };
    let [approach, insertion, retract] = [poses.approach, poses.insertion, poses.retract].map(|p| p.base_from_tool);
    let text = program(args.to, &found.recipe, &Insertion { approach, insertion, retract }, args.speed);
    sheetlight::files::write(&args.out, text.as_bytes())?;
    console.say(format!("{}: {} lines", args.out.display(), text.lines().count()));
    Ok(())
}
