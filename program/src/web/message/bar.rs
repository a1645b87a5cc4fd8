//! In: nothing. Out: the content of the bar that every page shows.
//! Frame and unit: counts of frames; ms, days, mm, GB as the names say.

use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use ts_rs::TS;

/// Source of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, TS, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// A running camera.
    Live,
    /// Recordings on disk.
    Replay,
    /// A simulated station.
    Simulated,
}

/// What the robot may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, TS, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RobotState {
    /// No robot is configured, or it does not answer.
    NoLink,
    /// Its state is read; it is never moved.
    ReadOnly,
    /// It is armed for motions, each of which is confirmed.
    Armed,
    /// It moves.
    Moving,
}

/// Frames of the running scan, or of the last one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, TS, JsonSchema)]
pub struct Frames {
    /// Passed to the processing stages.
    #[ts(type = "number")]
    pub seen: u64,
    /// With at least one point.
    #[ts(type = "number")]
    pub measured: u64,
    /// Frames without a result, by cause.
    #[ts(type = "Record<string, number>")]
    pub dropped: BTreeMap<String, u64>,
}

/// Age of the rig's oldest calibration, and the error expected from all of them.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct CalibrationAge {
    /// Days since the oldest record was measured.
    pub days: f64,
    /// The worst verdict of all records.
    pub verdict: String,
    /// The record with that verdict.
    pub worst: String,
    /// Root sum of squares of the errors that the records expect at the working distance, mm; null if one does not
    /// state it.
    pub expected_mm: Option<f64>,
}

/// The tab that may operate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, TS, JsonSchema)]
pub struct Lease {
    /// A short name of the tab that holds the lease; null: no tab holds it.
    pub holder: Option<String>,
    /// Seconds until the lease expires.
    pub seconds_left: f64,
}

/// The bar.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Bar {
    /// Source of the pictures.
    pub mode: Mode,
    /// Name of the station.
    pub station: String,
    /// A camera is configured.
    pub camera: bool,
    /// What the robot may do.
    pub robot: RobotState,
    /// Line or pointer is on, by the controller's outputs; null if no link reports it.
    pub laser: Option<bool>,
    /// Frames of the running scan, or of the last one.
    pub frames: Frames,
    /// Time from a picture to its points, p50 and p99, ms; null if not measured yet.
    pub delay_ms: Option<[f64; 2]>,
    /// Adapter or processor that runs the stages.
    pub adapter: String,
    /// The adapter is software on this machine's cores.
    pub adapter_is_software: bool,
    /// Null without a camera, a laser plane, or the calibration of the motion that carries them.
    pub calibration: Option<CalibrationAge>,
    /// Free space on the disk that holds the jobs, GB; null if the system does not report it.
    pub disk_left_gb: Option<f64>,
    /// Memory of the program, now and at its peak, MB; null if the system does not report it.
    pub memory_mb: Option<[f64; 2]>,
    /// What the operator must know now, one sentence each.
    pub alarms: Vec<String>,
    /// The tab that may operate.
    pub lease: Lease,
    /// The running job; null: none runs.
    pub running: Option<String>,
    /// Number of connected browsers.
    pub viewers: usize,
}
