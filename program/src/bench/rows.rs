//! In: nothing. Out: the results of a bench run, row by row.
//! Frame and unit: seconds, pixels, bytes; stated at each field.

use super::scenes::Scene;

/// GPU time per shot of one stage, summed over all its dispatches of a batch.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Stage {
    /// The stage's label.
    pub name: String,
    /// Median of five batches, ms.
    pub ms_per_shot: f64,
    /// Number of dispatches in a batch.
    pub dispatches: usize,
}

/// Time from submitting a single shot until its points are available, with nothing else in flight.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Latency {
    /// Median, ms.
    pub p50_ms: f64,
    /// 99th percentile, ms.
    pub p99_ms: f64,
}

/// Memory of the process over a long run.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Soak {
    /// Shots that were run.
    pub shots: usize,
    /// Resident after the first tenth of the run, 1e6 bytes.
    pub early_mb: f64,
    /// Resident at the end, 1e6 bytes.
    pub late_mb: f64,
}

/// Results of one size and scene.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// What the pictures show.
    pub scene: Scene,
    /// Number of shots submitted together.
    pub shots_per_batch: u32,
    /// Number of shots timed.
    pub shots: usize,
    /// Wall time a shot, median over the batches in steady state.
    pub ms_per_shot: f64,
    /// The same with sub-pixel peaks, their sigma, their choice and their points in mm.
    pub full_ms_per_shot: Option<f64>,
    /// Ratio of that time to the time of the skeleton alone, median of alternating runs.
    pub full_over_skeleton: Option<f64>,
    /// Wall time per shot, ms, with the pictures already where the stages read them; results are transferred back.
    pub device_ms_per_shot: f64,
    /// Wall time a shot of the full chain with the pictures already there, ms.
    pub full_device_ms_per_shot: Option<f64>,
    /// Shots a second in steady state, from `ms_per_shot`.
    pub shots_per_s: f64,
    /// 1e6 pixels a second, from `ms_per_shot`.
    pub mpx_per_s: f64,
    /// CPU time of all threads per shot; on a software adapter it includes the GPU's work.
    pub cpu_ms_per_shot: Option<f64>,
    /// Ratio of that time to one thread reading the same bytes once.
    pub cpu_over_plain_read: Option<f64>,
    /// Bytes that the stages move per pixel, from the buffers' sizes and the listed tiles.
    pub bytes_per_px: f64,
    /// Achieved share of the memory bandwidth: that of all threads, or that of the device's dedicated memory with
    /// the pictures already there.
    pub share_of_memory: f64,
    /// Achieved share of the upload bandwidth.
    pub share_of_upload: Option<f64>,
    /// Points found per shot, mean.
    pub points_per_shot: f64,
    /// Share of the tiles that could not be proven dark.
    pub listed: f64,
    /// Latency of single shots.
    pub latency: Latency,
    /// Size of all buffers of the chain, 1e6 bytes.
    pub gpu_memory_mb: f64,
    /// Most memory that the process has held at once so far, 1e6 bytes; `None` if the system does not report it.
    pub host_peak_mb: Option<f64>,
    /// The long run, if one was requested.
    pub soak: Option<Soak>,
    /// GPU times, stage by stage in the order of the chain.
    pub stages: Vec<Stage>,
}
