//! In: a robot and a camera on their wires, a board below them. Out: the station's whole rig, by moves of the program's choice.
//! Frame and unit: mm, mm/s.

use super::joint::finish;
use super::store::{Keep, stale};
use crate::arm::rules::{Guard, MotionLog};
use crate::calibrate::hand_eye::options::Mount;
use crate::capture::CameraUri;
use crate::cli::insert::job::{Person, on_this_machine};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use crate::fault::{Fault, Result};
use crate::recording::BoardSpec;
use crate::rig::Rig;
use crate::scan::Where;
use crate::station::volume::asked;
use crate::station::{ArmCell, AutoRun, JointRun, Settings, calibrate_auto};
use std::path::PathBuf;

/// Calibrate camera, hand-eye, laser plane and pointer by moves that the program chooses
///
/// One board lies below the robot; jog until the whole of it is in the picture. The program makes small moves first, then goes to the
/// pose that lowers the expected error of a scanned point the most, among those that station.toml's [motion] allows, that can be
/// reached, and that keep board and stripe in view; it ends at --target-mm, or where more stops do not help, and checks itself on five
/// poses that no solve saw. Every move is shown and asked for. The pictures are kept in --out: `calibrate joint` on them comes to the
/// same. Ctrl-C halts the arm.
///
/// Sheetlight is no safety device: somebody stands at the emergency stop.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight calibrate auto --station cell3 --robot bcap://192.168.0.1:5007 --camera gige://first \\
      --board board.json --out pictures --target-mm 0.025 --allow-motion")]
pub struct Args {
    /// Station folder that gets the calibrations; its station.toml states [motion] and [outputs]
    #[arg(long)]
    station: PathBuf,
    /// The robot, for example bcap://192.168.0.1:5007
    #[arg(long)]
    robot: String,
    /// The camera (docs/live.md)
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<CameraUri>)]
    camera: CameraUri,
    /// The board's description (docs/boards.md)
    #[arg(long)]
    board: PathBuf,
    /// Folder that the pictures go into; new or empty
    #[arg(long)]
    out: PathBuf,
    /// Expected error of a scanned point at which it is enough, mm rms
    #[arg(long)]
    target_mm: f64,
    /// Stops at most
    #[arg(long, default_value_t = 40)]
    most: usize,
    /// Speed of every motion, mm/s, at most the station's [default: the station's, else 50]
    #[arg(long)]
    speed: Option<f64>,
    /// The arm may move
    #[arg(long)]
    allow_motion: bool,
    /// Say yes to every motion: for simulated cells on this machine alone
    #[arg(long)]
    yes: bool,
    /// Where the stages run: auto (a GPU with processors of its own, else this machine's), gpu, or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
    #[command(flatten)]
    keep: Keep,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    if args.yes && !on_this_machine(&args.robot) {
        return Err(Fault::usage(format!("--yes with the robot {}", args.robot))
            .cause("only a simulated cell on this machine may be moved without a person's yes")
            .next("leave --yes out"));
    }
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load_camera(&args.station)?);
    let run = AutoRun {
        joint: JointRun::new(Mount::EyeInHand, asked(&settings, None), &settings.extraction, args.on),
        board: BoardSpec::load(&args.board)?,
        out: args.out.clone(),
        target_mm: args.target_mm,
        most: args.most,
        working: settings.volume().map(|v| [v.near_mm, v.far_mm]),
        candidates: 150,
        seed: 1,
    };
    run.check()?;
    let camera = args.camera.open(None)?;
    let log = MotionLog::file(&args.station.join("motions.jsonl"));
    let mut guard = Guard::new(crate::arm::open(&args.robot)?, settings.motion.clone(), log);
    guard.stop_button().listen(interrupt::asked_for());
    guard.arm(args.allow_motion)?;
    let mut person = Person { console, yes: args.yes };
    let outputs = settings.outputs.unwrap_or_default();
    let mut cell = ArmCell::new(&mut guard, camera, outputs, &mut person, args.speed);
    let told = |stops: usize, mm: f64| console.say(format!("{stops} stops: a scanned point is expected to {mm:.4} mm"));
    let result = calibrate_auto(&mut cell, &rig, &run, &told).inspect_err(|_| {
        if args.out.join("line/meta.json").is_file() {
            let (out, station) = (args.out.display(), args.station.display());
            console.warn(format!(
                "the pictures so far are kept: sheetlight calibrate joint {out}/* --station {station} makes of them what it can"
            ));
        }
    })?;
    drop(cell);
    finish(&args.station, &result.joint, &args.keep, console)?;
    stale(&args.station, console);
    Ok(())
}
