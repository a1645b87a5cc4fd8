//! In: nothing. Out: what a run of the bench comes to, row by row.
//! Frame and unit: seconds, pixels, bytes; each field says.

use super::scenes::Scene;

/// GPU time of one stage, all its dispatches of a batch together, a shot.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Stage {
    pub name: String,
    pub ms_per_shot: f64,
    pub dispatches: usize,
}

/// Time from handing over a single shot until its points are there, nothing else under way.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Latency {
    pub p50_ms: f64,
    pub p99_ms: f64,
}

/// Memory of the process over a long run.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Soak {
    pub shots: usize,
    /// Resident after the first tenth, and at the end.
    pub early_mb: f64,
    pub late_mb: f64,
}

/// One size and scene.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    pub width: u32,
    pub height: u32,
    pub scene: Scene,
    pub shots_per_batch: u32,
    pub shots: usize,
    /// Wall time a shot, median over the batches in steady state.
    pub ms_per_shot: f64,
    /// The same with sub-pixel peaks, their sigma, their choice and their points in mm.
    pub full_ms_per_shot: Option<f64>,
    /// That against the skeleton alone, median of runs in turns.
    pub full_over_skeleton: Option<f64>,
    /// Wall time a shot with the pictures already where the stages read them, results brought back; and of the full chain.
    pub device_ms_per_shot: f64,
    pub full_device_ms_per_shot: Option<f64>,
    pub shots_per_s: f64,
    pub mpx_per_s: f64,
    /// CPU time of all threads a shot; on a software adapter the GPU's work is in it.
    pub cpu_ms_per_shot: Option<f64>,
    /// That, against one thread reading the same bytes once.
    pub cpu_over_plain_read: Option<f64>,
    /// Bytes that the stages move a pixel, from the buffers' sizes and the listed tiles.
    pub bytes_per_px: f64,
    /// Share of the memory ceiling that is reached, of all threads, or of the device's own memory with the pictures there; and
    /// of the upload ceiling.
    pub share_of_memory: f64,
    pub share_of_upload: Option<f64>,
    pub points_per_shot: f64,
    /// Share of the tiles that could not be proven dark.
    pub listed: f64,
    pub latency: Latency,
    pub gpu_memory_mb: f64,
    pub host_peak_mb: Option<f64>,
    pub soak: Option<Soak>,
    pub stages: Vec<Stage>,
}
