//! In: this machine. Out: the bandwidth of a plain memory read and of an upload, CPU time, peak memory.
//! Frame and unit: 1e9 bytes a second, seconds, bytes.

use crate::fault::Result;
use crate::gpu::Device;
use std::hint::black_box;
use std::time::Instant;

/// The limits that the chain is compared with.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Ceilings {
    /// One thread summing 12.6 MB, the best of many runs: the upper limit for any chain that reads every pixel.
    pub read_gb_s: f64,
    /// The same on all threads.
    pub read_all_gb_s: f64,
    /// Transfer from the host to the memory that the stages read.
    pub upload_gb_s: Option<f64>,
    /// Transfer from the memory that the stages write to the host.
    pub readback_gb_s: Option<f64>,
    /// Bytes read and written within the device's dedicated memory, if it has one.
    pub device_gb_s: Option<f64>,
}

/// Sum of a slice in wide words; compiles to one vector load and one vector addition per 32 bytes.
fn sum(words: &[u64]) -> u64 {
    let mut lanes = [0u64; 16];
    for chunk in words.chunks_exact(16) {
        for (lane, v) in lanes.iter_mut().zip(chunk) {
            *lane = lane.wrapping_add(*v);
        }
    }
    lanes.iter().fold(0, |a, &b| a.wrapping_add(b))
}

impl Ceilings {
    /// Reads pictures of 12.6 MB out of a set larger than most caches. None is all zeros, because that would occupy
    /// a single page.
    pub fn measure(device: Option<&Device>) -> Result<Ceilings> {
        let frames: Vec<Vec<u64>> = (1..=8).map(|i| vec![i; 4096 * 3072 / 8]).collect();
        let bytes = (4096 * 3072) as f64;
        let once = |f: &Vec<u64>| {
            let start = Instant::now();
            black_box(sum(black_box(f)));
            start.elapsed().as_secs_f64()
        };
        let best = |times: Vec<f64>| times.into_iter().fold(f64::MAX, f64::min);
        let read = best((0..5).flat_map(|_| frames.iter().map(once).collect::<Vec<_>>()).collect());
        use rayon::prelude::*;
        let all = best(
            (0..5)
                .map(|_| {
                    let start = Instant::now();
                    frames.par_iter().for_each(|f| {
                        black_box(sum(black_box(f)));
                    });
                    start.elapsed().as_secs_f64() / frames.len() as f64
                })
                .collect(),
        );
        let rates = device.map(|d| d.measure_rates(4096 * 3072)).transpose()?;
        Ok(Ceilings {
            read_gb_s: bytes / read / 1e9,
            read_all_gb_s: bytes / all / 1e9,
            upload_gb_s: rates.map(|r| r.upload_gb_s),
            readback_gb_s: rates.map(|r| r.readback_gb_s),
            device_gb_s: rates.and_then(|r| r.device_gb_s),
        })
    }
}

/// CPU seconds that all threads of this process have used; `None` if the system does not report them (Linux does).
pub fn cpu_seconds() -> Option<f64> {
    // schedstat counts nanoseconds, /proc/self/stat only hundredths of a second.
    let mut sum = 0u64;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        sum += text.split_whitespace().next()?.parse::<u64>().ok()?;
    }
    Some(sum as f64 * 1e-9)
}

/// Most memory that this process has held at once; `None` if the system does not report it.
pub fn peak_memory_bytes() -> Option<u64> {
    status("VmHWM:")
}

/// Memory that this process holds now; `None` if the system does not report it.
pub fn resident_bytes() -> Option<u64> {
    status("VmRSS:")
}

fn status(key: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with(key))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}
