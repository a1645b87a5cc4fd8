//! In: a recording and a station. Out: one calibration, stored in the station with its report.
//! Frame and unit: mm, rad, px; each file names its frames.

mod auto;
mod joint;
mod latency;
mod one;
mod profile_hand_eye;
pub(in crate::cli) mod store;

use super::terminal::console::Console;
use crate::procedure::calibrate::{AxisOrder, CameraOrder, HandEyeOrder, LaserPlaneOrder, PointerOrder};
use one::One;
use sheetlight::fault::Result;

#[derive(clap::Subcommand)]
pub enum Command {
    Auto(auto::Args),
    /// Calibrate a linear axis or turntable
    ///
    /// A board of any kind rides on the axis. Each frame has a picture of it in room light and the axis' count.
    /// meta.json states the motion: its kind (linear, turntable), what it carries, and the unit of the counts
    /// (docs/file-formats.md). The axis may also carry the sensor over a fixed board. Use uneven stops, so that counts
    /// of another picture or order are detected. Between neighbouring stops a turntable turns by less than half a
    /// turn. Scans of such recordings need no hand-eye.
    #[command(after_help = "From calibration to cloud:
  sheetlight calibrate camera      recordings/intrinsics --station belt1
  sheetlight calibrate laser-plane recordings/laserplane --station belt1
  sheetlight calibrate axis        recordings/axis       --station belt1
  sheetlight scan recordings/parcel4 --station belt1 --out scans/parcel4
Try it without a belt:
  sheetlight simulate --motion linear --set intrinsics,laserplane,axis,scan --out belt
Guide: docs/scanning.md")]
    Axis(One<AxisOrder>),
    /// Calibrate the camera from pictures of a board
    ///
    /// Take 10 to 20 pictures with the board tilted by 20 to 40 degrees in different directions, reaching into the
    /// picture's corners. The board's description is in the recording's meta.json. Several recordings of the same
    /// camera, also of other boards, are solved together.
    #[command(after_help = "Examples:
  sheetlight calibrate camera recordings/boards --station cell3
  sheetlight calibrate camera recordings/boards recordings/handeye --station cell3
Guide: docs/calibration.md")]
    Camera(One<CameraOrder>),
    /// Calibrate the camera's pose on the flange
    ///
    /// The recording shows one fixed board from many robot poses. Pictures and poses are adjusted together: pixels
    /// are weighted by their noise, poses by the robot's estimated scatter. Pairs that do not belong together are
    /// found and named. The result states the error of a point at the working distance, and each pose is predicted by
    /// the others. With --board-poses no pictures are read: the file holds board poses that another program measured.
    #[command(after_help = "Examples:
  sheetlight calibrate hand-eye recordings/handeye --poses poses_noisy --station cell3
  sheetlight calibrate hand-eye --board-poses boards.csv --poses robot.csv --station cell3
Guide: docs/calibration.md")]
    HandEye(One<HandEyeOrder>),
    Joint(joint::Args),
    /// Calibrate the laser plane from pictures of the stripe on boards
    ///
    /// Each frame has an ambient picture, which gives the board's pose, and a laser picture of the same pose. Room
    /// light in the laser picture is subtracted. The stripe is found as in a scan. Only peaks on the board and away
    /// from the print's edges count. The camera's calibration is fixed, and its uncertainty is propagated.
    #[command(after_help = "Example:
  sheetlight calibrate laser-plane recordings/laserplane --station cell3
Guide: docs/calibration.md")]
    LaserPlane(One<LaserPlaneOrder>),
    Latency(latency::Args),
    /// Calibrate the laser pointer's beam from pictures of its spot on boards
    ///
    /// Each frame has an ambient picture, which gives the board's pose, and a laser picture of the same pose. Room
    /// light in the laser picture is subtracted. The camera's calibration is fixed, and its uncertainty is propagated.
    #[command(after_help = "Example:
  sheetlight calibrate pointer recordings/pointer_cal --station cell3
Guide: docs/calibration.md")]
    Pointer(One<PointerOrder>),
    ProfileHandEye(profile_hand_eye::Args),
}

pub fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::Auto(a) => auto::run(a, console),
        Command::Axis(a) => one::run(a, console),
        Command::Camera(a) => one::run(a, console),
        Command::HandEye(a) => one::run(a, console),
        Command::Joint(a) => joint::run(a, console),
        Command::LaserPlane(a) => one::run(a, console),
        Command::Latency(a) => latency::run(a, console),
        Command::Pointer(a) => one::run(a, console),
        Command::ProfileHandEye(a) => profile_hand_eye::run(a, console),
    }
}
