//! In: nothing. Out: what a run of the bench comes to, row by row.
//! Frame and unit: seconds, pixels, bytes; each field says.

use super::scenes::Scene;

/// GPU time of one stage, all its dispatches of a batch together, a shot.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Stage {
    /// The stage's label.
    pub name: String,
    /// Median of five batches, ms.
    pub ms_per_shot: f64,
    /// How many a batch has.
    pub dispatches: usize,
}

/// Time from handing over a single shot until its points are there, nothing else under way.
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
    /// Resident after the first tenth, and at the end.
    pub early_mb: f64,
    /// Resident at the end, 1e6 bytes.
    pub late_mb: f64,
}

/// One size and scene.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// What the pictures show.
    pub scene: Scene,
    /// How many are submitted together.
    pub shots_per_batch: u32,
    /// How many were timed.
    pub shots: usize,
    /// Wall time a shot, median over the batches in steady state.
    pub ms_per_shot: f64,
    /// The same with sub-pixel peaks, their sigma, their choice and their points in mm.
    pub full_ms_per_shot: Option<f64>,
    /// That against the skeleton alone, median of runs in turns.
    pub full_over_skeleton: Option<f64>,
    /// Wall time a shot with the pictures already where the stages read them, results brought back; and of the full
    /// chain.
    pub device_ms_per_shot: f64,
    /// Wall time a shot of the full chain with the pictures already there, ms.
    pub full_device_ms_per_shot: Option<f64>,
    /// In steady state, of `ms_per_shot`.
    pub shots_per_s: f64,
    /// 1e6 pixels a second, of `ms_per_shot`.
    pub mpx_per_s: f64,
    /// CPU time of all threads a shot; on a software adapter the GPU's work is in it.
    pub cpu_ms_per_shot: Option<f64>,
    /// That, against one thread reading the same bytes once.
    pub cpu_over_plain_read: Option<f64>,
    /// Bytes that the stages move a pixel, from the buffers' sizes and the listed tiles.
    pub bytes_per_px: f64,
    /// Share of the memory ceiling that is reached, of all threads, or of the device's own memory with the pictures
    /// there; and of the upload ceiling.
    pub share_of_memory: f64,
    /// Share of the upload ceiling that is reached.
    pub share_of_upload: Option<f64>,
    /// Points found a shot, mean.
    pub points_per_shot: f64,
    /// Share of the tiles that could not be proven dark.
    pub listed: f64,
    /// Of single shots.
    pub latency: Latency,
    /// All buffers of the chain, 1e6 bytes.
    pub gpu_memory_mb: f64,
    /// Most that the process has held at once so far, 1e6 bytes; `None` where the system does not tell.
    pub host_peak_mb: Option<f64>,
    /// The long run, where one was asked for.
    pub soak: Option<Soak>,
    /// GPU times, stage by stage in the order of the chain.
    pub stages: Vec<Stage>,
}
