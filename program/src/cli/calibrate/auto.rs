//! In: a connected robot and camera, a board below them. Out: the station's whole rig, by moves that the program
//! chooses.
//! Frame and unit: mm, mm/s.

use super::joint::finish;
use super::store::{Keep, stale};
use crate::cli::insert::moving::Moving;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::surroundings::in_folder;
use crate::procedure::calibrate::AutoOrder;
use sheetlight::fault::Result;
use sheetlight::rig::Rig;
use sheetlight::station::{ArmCell, Settings, calibrate_auto};
use std::path::PathBuf;

/// Calibrate everything while the program moves the robot
///
/// One board lies below the robot, or is on its flange in front of a fixed camera (--mount eye-to-hand). Jog the arm
/// until the whole board is in the picture. The program makes small moves first. Then it goes to the pose that lowers
/// the expected error of a scanned point most, within the limits of [motion] in station.toml. It ends at --target-mm
/// or when more stops do not help, and checks itself on five further poses. Every move is shown and confirmed.
/// `calibrate joint` on the stored pictures gives the same result. Ctrl-C halts the arm.
///
/// Sheetlight is not a safety device: somebody stands at the emergency stop.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight calibrate auto --station cell3 --robot bcap://192.168.0.1:5007 \\
      --camera gige://first --board board.json --out pictures --target-mm 0.025 --allow-motion
Guide: docs/calibration.md")]
pub struct Args {
    #[command(flatten)]
    moving: Moving,
    #[command(flatten)]
    order: AutoOrder,
    /// Folder for the pictures; new or empty
    #[arg(long)]
    out: PathBuf,
    #[command(flatten)]
    keep: Keep,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let moving = &args.moving;
    let (settings, rig) = (Settings::load(&moving.station)?, Rig::load_camera(&moving.station)?);
    let run = in_folder(&moving.station, console, |at| args.order.run(at, &settings, args.out.clone()))?;
    let camera = moving.camera.open(None)?;
    let mut guard = moving.guard()?;
    let mut person = moving.person(console);
    let outputs = settings.outputs.unwrap_or_default();
    let mut cell = ArmCell::new(&mut guard, camera, outputs, &mut person, moving.speed)?;
    let told =
        |stops: usize, mm: f64| console.say(format!("{stops} stops: expected error of a scanned point {mm:.4} mm"));
    let result = calibrate_auto(&mut cell, &rig, &run, &told).inspect_err(|_| {
        if args.out.join("line/meta.json").is_file() {
            let (out, station) = (args.out.display(), moving.station.display());
            console.warn(format!(
                "the pictures so far are kept: sheetlight calibrate joint {out}/* --station {station} makes of them \
                 what it can"
            ));
        }
    })?;
    drop(cell);
    finish(&moving.station, &result.joint, &args.keep, console)?;
    stale(&moving.station, console);
    Ok(())
}
