//! In: this machine. Out: the bandwidth of a plain memory read and of an upload, CPU time, peak memory.
//! Frame and unit: 1e9 bytes a second, seconds, bytes.

use sheetlight::fault::Result;
use sheetlight::gpu::Device;
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

/// CPU seconds of another process, of its threads that have ended, and of its children; hundredths of a second. `None`
/// if the system does not report them.
pub(super) fn cpu_seconds_of(process: u32) -> Option<f64> {
    let of = |pid: u32| -> Option<f64> {
        let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        // The name of the program stands in brackets and may contain spaces.
        let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
        // utime, stime, cutime, cstime: fields 14 to 17 of proc(5). A hundredth of a second is fixed for user space.
        fields.get(11..15)?.iter().map(|f| f.parse::<f64>().ok()).sum::<Option<f64>>().map(|ticks| ticks / 100.0)
    };
    family(process).into_iter().map(of).sum()
}

/// Most memory that another process and its children have held, bytes.
pub(super) fn peak_memory_of(process: u32) -> Option<u64> {
    family(process).into_iter().map(|pid| status(pid, "VmHWM:")).sum()
}

/// A process and its children, in all generations.
fn family(process: u32) -> Vec<u32> {
    let mut all = vec![process];
    let mut next = 0;
    while let Some(&pid) = all.get(next) {
        let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
        let tasks = tasks.map(|t| t.file_name().to_string_lossy().into_owned());
        let children = tasks.filter_map(|t| std::fs::read_to_string(format!("/proc/{pid}/task/{t}/children")).ok());
        let text: String = children.collect();
        all.extend(text.split_whitespace().filter_map(|c| c.parse::<u32>().ok()));
        next += 1;
    }
    all
}

/// Most memory that this process has held at once; `None` if the system does not report it.
pub fn peak_memory_bytes() -> Option<u64> {
    status(std::process::id(), "VmHWM:")
}

/// Memory that this process holds now; `None` if the system does not report it.
pub fn resident_bytes() -> Option<u64> {
    status(std::process::id(), "VmRSS:")
}

fn status(process: u32, key: &str) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find(|l| l.starts_with(key))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_childs_work_counts_for_its_parent() {
        // The shell waits for a second shell that works; `exec` would make them one process.
        let work = "i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done; sleep 5";
        let mut child =
            std::process::Command::new("sh").args(["-c", &format!("sh -c '{work}'; true")]).spawn().unwrap();
        let end = Instant::now() + std::time::Duration::from_secs(20);
        let busy = |pid| cpu_seconds_of(pid).is_some_and(|s| s >= 0.03);
        while !busy(child.id()) && Instant::now() < end {
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        let (cpu, memory, all) = (cpu_seconds_of(child.id()), peak_memory_of(child.id()), family(child.id()));
        let _ = std::process::Command::new("kill").args(all.iter().map(u32::to_string)).status();
        let _ = child.wait();
        assert!(cpu.unwrap() >= 0.03, "{cpu:?} s of {all:?}");
        assert!(memory.unwrap() > 100_000 && all.len() >= 2, "{memory:?} bytes of {all:?}");
        assert_eq!(cpu_seconds_of(u32::MAX), None);
    }
}
