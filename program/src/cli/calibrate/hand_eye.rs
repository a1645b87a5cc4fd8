//! In: a recording of a board with robot poses. Out: the camera on the flange (or in the base).
//! Frame and unit: flange_T_camera or base_T_camera; mm, degrees.

use super::mount;
use super::store::{Keep, finish};
use crate::cli::terminal::console::Console;
use sheetlight::calibrate::hand_eye::options::HandEyeOptions;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Frame, Rigid};
use sheetlight::recording::{Recording, load_poses};
use sheetlight::rig::Rig;
use sheetlight::robot::Convention;
use sheetlight::station::volume::asked;
use sheetlight::station::{
    HandEyeResult, HandEyeRun, PosePairs, Settings, calibrate_hand_eye, calibrate_hand_eye_from_poses,
};
use std::path::{Path, PathBuf};

/// Calibrate the camera's pose on the flange
///
/// The recording shows one fixed board from many robot poses. Pictures and poses are adjusted together: pixels are
/// weighted by their noise, poses by the robot's estimated scatter. Pairs that do not belong together are found and
/// named. The result states the error of a point at the working distance, and each pose is predicted by the others.
/// With --board-poses no pictures are read: the file holds board poses that another program measured.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight calibrate hand-eye recordings/handeye --poses poses_noisy --station cell3
  sheetlight calibrate hand-eye --board-poses boards.csv --poses robot.csv --station cell3
Guide: docs/calibration.md")]
pub struct Args {
    /// Recording of one fixed board, with a picture and a pose per frame
    #[arg(required_unless_present = "board_poses", conflicts_with = "board_poses")]
    recording: Option<PathBuf>,
    /// Station folder with the camera's calibration
    #[arg(long)]
    station: PathBuf,
    /// Pose file of the recording, without extension [default: the one in meta.json]; with --board-poses a path
    #[arg(long)]
    poses: Option<String>,
    /// Board poses (camera_T_board, docs/file-formats.md) instead of pictures
    #[arg(long, value_name = "FILE", requires = "poses")]
    board_poses: Option<PathBuf>,
    /// Sigma of the board poses' position per axis, mm [default: included in the robot's]
    #[arg(long, value_name = "MM", requires = "board_poses", requires = "board_sigma_deg")]
    board_sigma_mm: Option<f64>,
    /// Sigma of the board poses' orientation per axis, degrees
    #[arg(long, value_name = "DEG", requires = "board_poses", requires = "board_sigma_mm")]
    board_sigma_deg: Option<f64>,
    #[command(flatten)]
    mount: mount::Where,
    /// Sigma of the robot's position per axis, mm [default: estimated]
    #[arg(long, value_name = "MM")]
    robot_sigma_mm: Option<f64>,
    /// Sigma of the robot's orientation per axis, degrees [default: estimated]
    #[arg(long, value_name = "DEG")]
    robot_sigma_deg: Option<f64>,
    /// Distance at which the expected error is stated, mm [default: middle of the working volume, else of the boards]
    #[arg(long, value_name = "MM")]
    working_mm: Option<f64>,
    #[command(flatten)]
    keep: Keep,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let (settings, rig) = (Settings::load(&args.station)?, Rig::load_to_calibrate(&args.station)?);
    let run = HandEyeRun {
        poses: args.poses.clone(),
        mount: args.mount.of(&args.station, &settings, console)?,
        solver: HandEyeOptions {
            robot_sigma_mm: args.robot_sigma_mm,
            robot_sigma_deg: args.robot_sigma_deg,
            ..HandEyeOptions::default()
        },
        asked: asked(&settings, args.working_mm.map(|mm| [mm, mm])),
    };
    let result = match (&args.recording, &args.board_poses) {
        (Some(recording), _) => from_pictures(args, recording, &rig, &run, console)?,
        (None, Some(boards)) => {
            let robot = PathBuf::from(args.poses.as_deref().expect("clap: required beside --board-poses"));
            load_poses(&robot)?.warnings.iter().for_each(|w| console.warn(w));
            let board_sigma = args.board_sigma_mm.zip(args.board_sigma_deg).map(|(mm, deg)| [mm, deg.to_radians()]);
            if let Some([mm, rad]) = board_sigma.filter(|s| !s.iter().all(|s| *s > 0.0 && s.is_finite())) {
                let deg = rad.to_degrees();
                return Err(Fault::usage(format!("board sigmas of {mm} mm and {deg} degrees, above 0 is allowed"))
                    .next("state the scatter of the other program's poses, or omit both options"));
            }
            calibrate_hand_eye_from_poses(&PosePairs { robot, boards: boards.clone(), board_sigma }, &rig, &run)?
        }
        (None, None) => unreachable!("clap: one of them is required"),
    };
    match result {
        HandEyeResult::OnFlange(c) => {
            let text = described("camera on the flange", &c.calibration.value);
            finish(&args.station, &c.calibration, &c.page, &text, &args.keep, console)
        }
        HandEyeResult::InBase(c) => {
            let text = described("camera in the base", &c.calibration.value);
            finish(&args.station, &c.calibration, &c.page, &text, &args.keep, console)
        }
    }
}

fn from_pictures(
    args: &Args,
    recording: &Path,
    rig: &Rig,
    run: &HandEyeRun,
    console: &Console,
) -> Result<HandEyeResult> {
    let recording = Recording::open(recording)?;
    recording.pose_file(args.poses.as_deref())?.warnings.iter().for_each(|w| console.warn(w));
    let bar = console.bar("boards", 0);
    let progress = |done: usize, all: usize| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    };
    let result = calibrate_hand_eye(&recording, rig, run, &progress)?;
    bar.finish_and_clear();
    Ok(result)
}

fn described<A: Frame, B: Frame>(what: &str, pose: &Rigid<A, B>) -> String {
    let n = Convention::Denso.write(pose);
    format!(
        "{what}: {:.4} {:.4} {:.4} mm, RX {:.4} RY {:.4} RZ {:.4} degrees (R = Rz·Ry·Rx)",
        n[0], n[1], n[2], n[3], n[4], n[5]
    )
}
