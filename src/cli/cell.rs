//! In: a scene and a seed. Out: a simulated robot cell that answers on this machine's ports until Ctrl-C: controller, camera,
//! gripper's camera; what happened, judged by its truth.
//! Frame and unit: base frame, mm, degrees; s of the cell.

use crate::cell::{Cell, CellOptions, Event, Served};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use crate::fault::Result;
use crate::recording::BoardSpec;
use crate::simulate::{DEFAULT_SCENE, RigSpec, SceneSpec};
use crate::web::station_for;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

#[derive(clap::Subcommand)]
pub enum Command {
    Simulate(Box<Args>),
}

/// Simulate a whole robot cell at its wires: a controller that speaks b-CAP, a camera, lasers and gripper on its outputs
///
/// Programs talk to it as to a real cell (docs/cell.md): a Denso VS-060 that moves in real time or --speed times as fast, a
/// camera that sees what the arm's true pose sees. A component that the gripper lets go is judged by the truth. It runs until
/// Ctrl-C; the URIs are on stdout.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight cell simulate --part led --seed 3 --speed 5 --station cell")]
pub struct Args {
    /// Scene file (TOML, see docs/file-formats.md) [default: a circuit board with parts]
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Design of the sensor (TOML; data/rigs holds some) [default: the paper's]
    #[arg(long)]
    rig: Option<PathBuf>,
    /// Name of the part of the scene whose component is in the gripper, and over which the arm begins
    /// [default: the first with holes]
    #[arg(long)]
    part: Option<String>,
    /// A calibration board beside the scene (JSON as sheetlight board writes it)
    #[arg(long)]
    board: Option<PathBuf>,
    /// The arm begins over the board, as an operator jogs it there for `calibrate auto`; else over the part
    #[arg(long, requires = "board")]
    over_board: bool,
    /// The sensor stands still and the flange carries the board before it, for `calibrate auto --mount eye-to-hand`
    #[arg(long, requires = "board", conflicts_with = "over_board")]
    eye_to_hand: bool,
    /// Another specimen of sensor, gripper and places, other noise, for every seed; 0 is the design itself
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Seconds of the cell in one of ours, 0.1 to 1000
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// Repeatability of the arm, 1 sigma an axis, mm
    #[arg(long, default_value_t = 0.02)]
    noise_mm: f64,
    /// The same, degrees
    #[arg(long, default_value_t = 0.004)]
    noise_deg: f64,
    /// Largest error of the arm's lengths, mm
    #[arg(long, default_value_t = 0.0)]
    arm_error_mm: f64,
    /// Largest error of the joints' zeros, degrees
    #[arg(long, default_value_t = 0.0)]
    arm_error_deg: f64,
    /// Largest tilt of the scene, degrees
    #[arg(long, default_value_t = 2.0)]
    tilt_deg: f64,
    /// What the camera says of its pictures' times is late by so much, ms
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    camera_delay_ms: f64,
    /// Port of the controller, TCP and UDP; 0: any
    #[arg(long, default_value_t = 5007)]
    robot_port: u16,
    /// Port of the camera; 0: any. The gripper's camera has the next one
    #[arg(long, default_value_t = 5017)]
    camera_port: u16,
    /// Make a station folder for it: the sensor's true calibration, workspace, tool
    #[arg(long)]
    station: Option<PathBuf>,
    /// Write what happened, a line of JSON each
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
    // As the operator leaves it: motor on, nothing pending.
    served.controller.set_motor(true);
    let (robot, camera, gripper) =
        (served.robot_uri(), served.camera_uri(), format!("cell://{}", served.gripper_camera));
    console.result(
        &serde_json::json!({ "robot": robot, "camera": camera, "gripper_camera": gripper }),
        &format!("robot {robot}\ncamera {camera}\ngripper camera {gripper}"),
    );
    follow(&served, args, console)
}

/// Says what happens until the program is told to end.
fn follow(served: &Served, args: &Args, console: &Console) -> Result<()> {
    let (stop, mut said) = (interrupt::asked_for(), 0);
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(100));
        let log = served.cell.log();
        for entry in &log[said..] {
            if let Some(path) = &args.log {
                crate::files::append_line(path, &serde_json::to_string(entry).expect("plain data"))?;
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
