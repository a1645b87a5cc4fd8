//! In: a station folder, recordings, options. Out: the product's procedures from start to end.
//! Frame and unit: millimetres; each file names its frames.

mod backup;
mod batch;
mod calibrate;
mod edit;
mod filter;
mod find;
mod ghost;
mod guide;
mod height_witness;
mod import_map;
pub mod job;
mod judge;
mod output;
mod own_program;
mod range;
mod robot;
mod scan;
mod scan_profiles;
mod settings;
pub mod socket;
mod values;
mod verify;
pub mod volume;

pub use backup::{Backup, back_up_here, backups, settle_restore};
pub use batch::{
    BatchLine, BatchOptions, BatchRow, Entry, FoundAt, Manifest, Placed, Planned, Problem, Repeats, Shard, ShotRow,
    Spread, State, Tally, batch, manifest_of, plan, repeats,
};
#[cfg(feature = "tables")]
pub use batch::{Merged, merge};
pub use calibrate::auto::arm::ArmCell;
pub use calibrate::auto::cell::{Cell, Light, Went};
pub use calibrate::auto::check::SelfCheck;
pub use calibrate::auto::options::AutoRun;
pub use calibrate::auto::procedure::calibrate_auto;
pub use calibrate::auto::result::{AutoResult, Ended};
pub use calibrate::axis::{AxisRun, calibrate_axis};
pub use calibrate::board_views::{Boards, FrameBoard, boards};
pub use calibrate::hand_eye::{
    Calibrated, HandEyeResult, HandEyeRun, PosePairs, calibrate_hand_eye, calibrate_hand_eye_from_poses,
};
pub use calibrate::joint::run::{JointResult, JointRun, accept_joint, calibrate_joint, store_joint};
pub use calibrate::laser_plane::{LaserPlaneRun, calibrate_laser_plane};
pub use calibrate::latency::{LatencyFound, calibrate_latency};
pub use calibrate::mount::{Mounted, mount_of};
pub use calibrate::pointer::{PointerRun, calibrate_pointer};
pub use calibrate::profile_sensor::{
    ProfileEvaluation, ProfileTarget, calibrate_profile_hand_eye, evaluate_profile_hand_eye,
};
pub use edit::{changed, edited, point_added, point_chosen, point_taken_out};
pub use filter::{filter_map, filter_scan, left};
pub use find::{
    Looked, SecondLook, find_part, find_part_held, find_part_in_all, rig_that_scanned, second_look, teach_held,
    teach_part, with_scale,
};
pub use ghost::{Lies, ghost};
pub use guide::{GuideOptions, Guided, Step, guide};
pub use import_map::import_map;
#[cfg(feature = "pages")]
pub use judge::embed::base64;
pub use judge::figures::Judged;
pub use judge::parts::{FoundPart, judge_parts};
pub use judge::points::judge;
pub use output::{LIT, Output, try_output};
pub use own_program::{Profiles, Scan};
pub use range::{Distance, RangeReport, RangeRun, Square, SurfaceFound, measure_range};
pub use robot::{carried, guarded};
pub use scan::held::{HeldScan, scan_held};
pub use scan::options::ScanOptions;
pub use scan::progress::Checkpoint;
pub use scan::recorded::scan_recording;
pub use scan::report::{
    Filtered, HeightMapFigures, Imported, Profiled, ScanReport, Spent, cloud_of, lit_cloud_of, load_report, shots_of,
    whole_scan,
};
pub use scan::run::{scan, scan_on};
pub use scan::scan_folder::of_a_scan;
pub use scan::seen::Seen;
pub use scan::watch::Watch;
pub use scan_profiles::{Moved, ProfileScan, scan_profiles};
pub use settings::{HeadSpec, Settings, ToolSpec, WorkingVolume};
pub use values::{PlaneValue, Sigmas, Values, ValuesFormat, remarks_of_import, written_camera};
pub use verify::{CalibrationCheck, VerifyReport, VerifyRun, verify};
