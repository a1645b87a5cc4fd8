//! In: a recording of a board with robot poses, or poses of both. Out: the camera on the flange (or in the base).
//! Frame and unit: flange_T_camera or base_T_camera; mm, degrees.

use super::super::at::{At, Remark};
use super::super::word;
use super::{Calibration, OfBoards, Progress, Solved, open_one};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::calibrate::hand_eye::options::{HandEyeOptions, Mount};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Frame, Rigid};
use sheetlight::raster::Channel;
use sheetlight::recording::load_poses;
use sheetlight::rig::Rig;
use sheetlight::robot::Convention;
use sheetlight::station::volume::asked;
use sheetlight::station::{
    HandEyeResult, HandEyeRun, PosePairs, Settings, calibrate_hand_eye, calibrate_hand_eye_from_poses, mount_of,
};
use ts_rs::TS;

/// Inputs of the calibration of the camera's pose.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct HandEyeOrder {
    /// Recording of one board that stands still, or is carried by the flange, with a picture and a pose per frame
    #[arg(required_unless_present = "board_poses", conflicts_with = "board_poses")]
    pub recording: Option<String>,
    /// Frames that are not used, counted from 0
    #[arg(long, value_name = "N,N,...", value_delimiter = ',')]
    #[serde(default)]
    pub leave_out: Vec<usize>,
    /// Pose file of the recording, without extension [default: the one in meta.json]; with board poses a path
    #[arg(long)]
    pub poses: Option<String>,
    /// Board poses (camera_T_board, docs/file-formats.md) instead of pictures
    #[arg(long, value_name = "FILE", requires = "poses")]
    pub board_poses: Option<String>,
    /// Sigma of the board poses' position per axis, mm [default: included in the robot's]
    #[arg(long, value_name = "MM", requires = "board_poses", requires = "board_sigma_deg")]
    pub board_sigma_mm: Option<f64>,
    /// Sigma of the board poses' orientation per axis, degrees
    #[arg(long, value_name = "DEG", requires = "board_poses", requires = "board_sigma_mm")]
    pub board_sigma_deg: Option<f64>,
    /// Where the camera is: eye-in-hand (on the flange) or eye-to-hand (fixed) [default: the station's, else
    /// eye-in-hand with a note]
    #[arg(long, value_parser = word::parse::<Mount>)]
    #[schemars(schema_with = "word::schema::<Mount>")]
    #[ts(as = "Option<String>")]
    pub mount: Option<Mount>,
    /// Sigma of the robot's position per axis, mm [default: estimated]
    #[arg(long, value_name = "MM")]
    pub robot_sigma_mm: Option<f64>,
    /// Sigma of the robot's orientation per axis, degrees [default: estimated]
    #[arg(long, value_name = "DEG")]
    pub robot_sigma_deg: Option<f64>,
    /// Distance at which the expected error is stated, mm [default: middle of the working volume, else of the boards]
    #[arg(long, value_name = "MM")]
    pub working_mm: Option<f64>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = word::parse::<Channel>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Channel>")]
    #[ts(as = "Option<String>")]
    pub channel: Channel,
}

impl Calibration for HandEyeOrder {
    fn recording(&self) -> &str {
        self.recording.as_deref().unwrap_or_default()
    }

    fn suits(boards: &OfBoards) -> bool {
        boards.beam.is_none()
    }

    fn solve(&self, at: &At, progress: Progress) -> Result<Solved> {
        let (settings, rig) = (Settings::load(at.station)?, Rig::load_to_calibrate(at.station)?);
        let mounted = mount_of(at.station, &settings, self.mount)?;
        mounted.assumed.into_iter().for_each(|why| (at.remark)(Remark::Assumed(why)));
        let run = HandEyeRun {
            poses: self.poses.clone(),
            mount: mounted.mount,
            solver: HandEyeOptions {
                robot_sigma_mm: self.robot_sigma_mm,
                robot_sigma_deg: self.robot_sigma_deg,
                ..HandEyeOptions::default()
            },
            asked: asked(&settings, self.working_mm.map(|mm| [mm, mm])),
        };
        let result = match (&self.recording, &self.board_poses) {
            (Some(_), Some(_)) => {
                return Err(Fault::usage("a recording and board poses are given").next("give one of them"));
            }
            (Some(recording), None) => self.by_pictures(recording, &rig, &run, at, progress)?,
            (None, Some(boards)) => self.by_poses(boards, &rig, &run, at)?,
            (None, None) => {
                return Err(Fault::usage("no recording and no board poses are given").next("give one of them"));
            }
        };
        Ok(match result {
            HandEyeResult::OnFlange(c) => {
                let value = described("camera on the flange", &c.calibration.value);
                Solved::of(c, value)
            }
            HandEyeResult::InBase(c) => {
                let value = described("camera in the base", &c.calibration.value);
                Solved::of(c, value)
            }
        })
    }
}

impl HandEyeOrder {
    fn by_pictures(
        &self,
        recording: &String,
        rig: &Rig,
        run: &HandEyeRun,
        at: &At,
        progress: Progress,
    ) -> Result<HandEyeResult> {
        let mut recording = open_one(at, recording, &self.leave_out)?;
        recording.channel = self.channel;
        at.check(&recording, self.poses.as_deref())?;
        at.doubts(recording.pose_file(self.poses.as_deref())?.warnings);
        calibrate_hand_eye(&recording, rig, run, progress)
    }

    fn by_poses(&self, boards: &str, rig: &Rig, run: &HandEyeRun, at: &At) -> Result<HandEyeResult> {
        let Some(poses) = &self.poses else {
            return Err(Fault::usage("board poses are given, and no robot poses").next("name their file as poses"));
        };
        let robot = at.names.path(poses)?;
        at.doubts(load_poses(&robot)?.warnings);
        let board_sigma = self.board_sigma_mm.zip(self.board_sigma_deg).map(|(mm, deg)| [mm, deg.to_radians()]);
        if let Some([mm, rad]) = board_sigma.filter(|s| !s.iter().all(|s| *s > 0.0 && s.is_finite())) {
            let deg = rad.to_degrees();
            return Err(Fault::usage(format!("board sigmas of {mm} mm and {deg} degrees, above 0 is allowed"))
                .next("state the scatter of the other program's poses, or omit both options"));
        }
        calibrate_hand_eye_from_poses(&PosePairs { robot, boards: at.names.path(boards)?, board_sigma }, rig, run)
    }
}

fn described<A: Frame, B: Frame>(what: &str, pose: &Rigid<A, B>) -> String {
    let n = Convention::Denso.write(pose);
    format!(
        "{what}: {:.4} {:.4} {:.4} mm, RX {:.4} RY {:.4} RZ {:.4} degrees (R = Rz·Ry·Rx)",
        n[0], n[1], n[2], n[3], n[4], n[5]
    )
}
