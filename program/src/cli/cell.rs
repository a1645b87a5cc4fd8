//! In: a scene and a seed. Out: a simulated robot cell that answers on this machine's ports until Ctrl-C:
//! controller, camera, gripper's camera; its events, judged by its truth.
//! Frame and unit: base frame, mm, degrees; s of the cell.

use crate::cell::{Cell, CellOptions, Event, Served};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use crate::web::station_for;
use sheetlight::fault::Result;
use sheetlight::recording::BoardSpec;
use sheetlight::simulate::{DEFAULT_SCENE, RigSpec, SceneSpec};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

#[derive(clap::Subcommand)]
pub enum Command {
    Simulate(Box<Args>),
}

/// Simulate a robot cell: b-CAP controller, camera, lasers, gripper
///
/// Programs talk to it as to a real cell (docs/cell.md): a Denso VS-060 that moves in real time or --speed times as
/// fast, and a camera that sees what the arm's true pose sees. The truth judges a component that the gripper
/// releases. It runs until Ctrl-C and prints the URIs on stdout.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight cell simulate --part led --seed 3 --speed 5 --station cell
Guide: docs/cell.md")]
pub struct Args {
    /// Scene file (TOML, docs/file-formats.md) [default: a circuit board with parts]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Design of the sensor (TOML; see data/rigs) [default: paper.toml]
    #[arg(long)]
    rig: Option<PathBuf>,
    /// Part of the scene under the arm; its component is in the gripper [default: the first with holes]
    #[arg(long)]
    part: Option<String>,
    /// Calibration board beside the scene (JSON from sheetlight board)
    #[arg(long)]
    board: Option<PathBuf>,
    /// Start the arm over the board instead of the part, for `calibrate auto`
    #[arg(long, requires = "board")]
    over_board: bool,
    /// The sensor is fixed and the flange carries the board, for `calibrate auto --mount eye-to-hand`
    #[arg(long, requires = "board", conflicts_with = "over_board")]
    eye_to_hand: bool,
    /// Random seed for sensor, gripper, poses and noise; 0 is the design itself
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Simulation speed factor, 0.1 to 1000
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// Repeatability of the arm, 1 sigma an axis, mm
    #[arg(long, value_name = "MM", default_value_t = 0.02)]
    noise_mm: f64,
    /// The same, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.004)]
    noise_deg: f64,
    /// Largest error of the arm's lengths, mm
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    arm_error_mm: f64,
    /// Largest error of the joints' zeros, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0)]
    arm_error_deg: f64,
    /// Largest tilt of the scene, degrees
    #[arg(long, value_name = "DEG", default_value_t = 2.0)]
    tilt_deg: f64,
    /// Delay of the camera's stated picture times, ms
    #[arg(long, value_name = "MS", default_value_t = 0.0, allow_negative_numbers = true)]
    camera_delay_ms: f64,
    /// Port of the controller, TCP and UDP; 0: any
    #[arg(long, value_name = "PORT", default_value_t = 5007)]
    robot_port: u16,
    /// Port of the camera; 0: any. The gripper's camera has the next port
    #[arg(long, value_name = "PORT", default_value_t = 5017)]
    camera_port: u16,
    /// Make a station folder: the sensor's true calibration, workspace, tool
    #[arg(long)]
    station: Option<PathBuf>,
    /// Write every event as a line of JSON
    #[arg(long)]
    log: Option<PathBuf>,
}

pub fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::Simulate(args) => simulate(args, console),
    }
}

fn simulate(args: &Args, console: &Console) -> Result<()> {
    let scene = match &args.scene {
        Some(path) => SceneSpec::load(path)?,
        None => SceneSpec::parse(DEFAULT_SCENE)?,
    };
    let board = args.board.as_deref().map(BoardSpec::load).transpose()?;
    let options = CellOptions {
        board,
        over_board: args.over_board,
        eye_to_hand: args.eye_to_hand,
        rig: args.rig.as_ref().map_or_else(|| Ok(RigSpec::paper()), |p| RigSpec::load(p))?,
        speed: args.speed,
        noise_mm: args.noise_mm,
        noise_deg: args.noise_deg,
        arm_error_mm: args.arm_error_mm,
        arm_error_deg: args.arm_error_deg,
        tilt_deg: args.tilt_deg,
        camera_delay_ms: args.camera_delay_ms,
        holds: args.part.clone(),
        ..CellOptions::of(scene, args.seed)
    };
    let cell = Cell::new(options)?;
    if !args.over_board {
        cell.jog_over_its_part()?;
    }
    if let Some(folder) = &args.station {
        station_for(&cell, folder, "simulated cell", None)?;
    }
    let at = |port: u16| format!("127.0.0.1:{port}");
    let gripper_port = if args.camera_port == 0 { 0 } else { args.camera_port.saturating_add(1) };
    let served = Served::start(cell, &at(args.robot_port), &at(args.camera_port), &at(gripper_port))?;
    // The state in which an operator leaves a cell: motor on, no errors.
    served.controller.set_motor(true);
    let (robot, camera, gripper) =
        (served.robot_uri(), served.camera_uri(), format!("cell://{}", served.gripper_camera));
    console.result(
        &serde_json::json!({ "robot": robot, "camera": camera, "gripper_camera": gripper }),
        &format!("robot {robot}\ncamera {camera}\ngripper camera {gripper}"),
    );
    follow(&served, args, console)
}

/// Reports events until the program is asked to end.
fn follow(served: &Served, args: &Args, console: &Console) -> Result<()> {
    let (stop, mut said) = (interrupt::asked_for(), 0);
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(100));
        let log = served.cell.log();
        for entry in &log[said..] {
            if let Some(path) = &args.log {
                sheetlight::files::append_line(path, &serde_json::to_string(entry).expect("plain data"))?;
            }
            match &entry.event {
                Event::Released(i) => console.say(format!(
                    "{:.1} s: released, {}: {:.3} mm aside, {:.3} degrees, {:.3} mm high, {:.3} degrees tilted",
                    entry.t_s,
                    if i.inserted { "inserted" } else { "NOT inserted" },
                    i.lateral_mm,
                    i.turn_deg,
                    i.height_mm,
                    i.tilt_deg
                )),
                Event::Collision { depth_mm, .. } => {
                    console.say(format!("{:.1} s: COLLISION, {depth_mm:.1} mm deep", entry.t_s))
                }
                Event::Refused { code } => console.say(format!("{:.1} s: a motion was refused, {code:08X}", entry.t_s)),
                _ => {}
            }
        }
        said = log.len();
    }
    Ok(())
}
