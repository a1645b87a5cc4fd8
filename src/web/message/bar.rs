//! In: nothing. Out: what the bar that never leaves shows.
//! Frame and unit: frames counted, ms, days, mm, GB as the names say.

use serde::Serialize;
use std::collections::BTreeMap;
use ts_rs::TS;

/// Where what is shown comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, TS)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// A camera that runs.
    Live,
    /// Recordings on disk.
    Replay,
    /// A simulated station.
    Simulated,
}

/// What the robot may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, TS)]
#[serde(rename_all = "snake_case")]
pub enum RobotState {
    /// No robot was named, or it does not answer.
    NoLink,
    /// Its state is read, it is never moved.
    ReadOnly,
    /// It was taken for motions, each of which is confirmed.
    Armed,
    /// It moves.
    Moving,
}

/// Frames of the scan that runs, or of the last one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, TS)]
pub struct Frames {
    /// Handed to the stages.
    #[ts(type = "number")]
    pub seen: u64,
    /// With at least one point.
    #[ts(type = "number")]
    pub measured: u64,
    /// Left out, by cause.
    #[ts(type = "Record<string, number>")]
    pub dropped: BTreeMap<String, u64>,
}

/// How old the oldest calibration of the rig is, and what all of them make expect.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct CalibrationAge {
    /// Days since the oldest record was measured.
    pub days: f64,
    /// The worst verdict of all records.
    pub verdict: String,
    /// Which record has it.
    pub worst: String,
    /// Root of the sum of squares of what each expects at the working distance, mm; null where one does not say.
    pub expected_mm: Option<f64>,
}

/// Who may operate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, TS)]
pub struct Lease {
    /// A short name of the tab that holds it; null: nobody.
    pub holder: Option<String>,
    /// Seconds until it falls free.
    pub seconds_left: f64,
}

/// The bar.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Bar {
    /// Where pictures come from.
    pub mode: Mode,
    /// Name of the station.
    pub station: String,
    /// A camera was named.
    pub camera: bool,
    /// What the robot may do.
    pub robot: RobotState,
    /// Line or pointer is on, by the controller's outputs; null without a link that can say.
    pub laser: Option<bool>,
    /// Of the running scan.
    pub frames: Frames,
    /// From a picture to its points, p50 and p99, ms; null where none was measured yet.
    pub delay_ms: Option<[f64; 2]>,
    /// What the stages run on.
    pub adapter: String,
    /// It is software on this machine's cores.
    pub adapter_is_software: bool,
    /// Null without camera, laser plane or what carries them.
    pub calibration: Option<CalibrationAge>,
    /// On the disk that holds the jobs, GB; null where the system does not say.
    pub disk_left_gb: Option<f64>,
    /// Memory of the program, now and at its most, MB; null where the system does not say.
    pub memory_mb: Option<[f64; 2]>,
    /// What an operator must know now, one sentence each.
    pub alarms: Vec<String>,
    /// Who operates.
    pub lease: Lease,
    /// The job that runs.
    pub running: Option<String>,
    /// Browsers that look on.
    pub viewers: usize,
}
