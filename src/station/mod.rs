//! In: a station folder, recordings, options. Out: the product's procedures from top to bottom.
//! Frame and unit: millimetres; each file names its frames.

mod board_views;
mod calibrate_hand_eye;
mod calibrate_laser_plane;
mod calibrate_pointer;
mod calibrate_profile_hand_eye;
mod find;
mod guide;
mod judge;
mod judge_parts;
mod overlays;
mod page;
mod products;
mod progress;
mod range;
mod report;
mod room_light;
mod run;
mod scan_folder;
mod seen;
mod settings;
mod straight;
mod values;
mod verify;
pub mod volume;

pub use board_views::{Boards, FrameBoard, boards};
pub use calibrate_hand_eye::{
    Calibrated, HandEyeResult, HandEyeRun, PosePairs, calibrate_hand_eye, calibrate_hand_eye_from_poses,
};
pub use calibrate_laser_plane::{LaserPlaneRun, calibrate_laser_plane};
pub use calibrate_pointer::{PointerRun, calibrate_pointer};
pub use calibrate_profile_hand_eye::{calibrate_profile_hand_eye, evaluate_profile_hand_eye};
pub use find::{SecondLook, find_part, find_part_in_all, second_look, teach_part};
pub use guide::{GuideOptions, Guided, Step, guide};
pub use judge::{Judged, judge};
pub use judge_parts::{FoundPart, judge_parts};
pub use progress::Checkpoint;
pub use range::{Distance, RangeReport, RangeRun, SurfaceFound, measure_range};
pub use report::{HeightMapFigures, ScanReport, Spent, cloud_of, load_report};
pub use run::{ScanOptions, scan, scan_on};
pub use scan_folder::of_a_scan;
pub use seen::Seen;
pub use settings::{Settings, WorkingVolume};
pub use values::Values;
pub use verify::{CalibrationCheck, VerifyReport, VerifyRun, verify};
