//! In: this machine. Out: its adapters, every stage compared with its CPU twin, transfer rates, and a
//! plain verdict.
//! Frame and unit: words that differ, or the stage's own measure; GB/s.

use super::Console;
use crate::bench::{WayTime, way_times};
use crate::fault::Result;
use crate::gpu::{AdapterInfo, Device, Rates, adapters};
use crate::stages::{self, Verdict};

/// Check this machine: adapters, every stage against its CPU twin, transfer rates, the time of a shot with and without the GPU
///
/// Exit code 0 when the GPU chain can be trusted or when there is no GPU at all (everything then runs
/// on this machine's processor); 1 when a stage differs from its twin.
#[derive(clap::Args)]
pub struct Args {
    /// Leave out the transfer rates and the times of a shot (they take some seconds)
    #[arg(long)]
    no_rates: bool,
}

#[derive(serde::Serialize)]
struct Findings {
    program: String,
    adapters: Vec<AdapterInfo>,
    used: Option<String>,
    /// Its stages read arrays as texels.
    reads_texels: bool,
    no_device_because: Option<String>,
    stages: Vec<Verdict>,
    rates: Option<Rates>,
    /// The whole chain on this machine's processor, and on the adapter.
    ways: Vec<WayTime>,
    verdict: String,
}

/// Bytes of one transfer: a 12-megapixel shot of 8 bits.
const SHOT: u64 = 4096 * 3072;

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let mut findings = Findings {
        program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
        adapters: adapters(),
        used: None,
        reads_texels: false,
        no_device_because: None,
        stages: Vec::new(),
        rates: None,
        ways: Vec::new(),
        verdict: String::new(),
    };
    let device = Device::open();
    if !args.no_rates {
        findings.ways = way_times(device.as_ref().ok())?;
    }
    match device {
        Ok(device) => {
            findings.used = Some(device.info.name.clone());
            findings.reads_texels = device.reads_texels;
            let entries = stages::all();
            let bar = console.bar("checking stages", entries.len() as u64);
            for entry in entries {
                findings.stages.push(entry.verify(&device)?);
                bar.inc(1);
            }
            bar.finish_and_clear();
            if !args.no_rates {
                findings.rates = Some(device.measure_rates(SHOT)?);
            }
        }
        Err(fault) => findings.no_device_because = Some(fault.what),
    }
    let wrong: Vec<&str> = findings.stages.iter().filter(|v| !v.passed()).map(|v| v.stage).collect();
    findings.verdict = match (&findings.used, wrong.is_empty()) {
        (None, _) => {
            "no GPU: everything runs on this machine's processor, with the same results but for rounding".into()
        }
        (Some(name), true) => format!("good: every stage on {name} agrees with its CPU twin"),
        (Some(_), false) => format!("do not trust this GPU: {} differ from their CPU twins", wrong.join(", ")),
    };
    console.result(&findings, &text(&findings));
    if wrong.is_empty() {
        return Ok(());
    }
    Err(crate::fault::Fault::device(format!(
        "{} of {} stages differ from their CPU twins",
        wrong.len(),
        findings.stages.len()
    ))
    .cause("a driver bug, or failing hardware")
    .next("update the driver, choose another adapter with SHEETLIGHT_ADAPTER, or scan with --on cpu"))
}

fn text(f: &Findings) -> String {
    let mut s = format!("{}\n", f.program);
    for a in &f.adapters {
        s += &format!(
            "adapter {} ({}, {}), driver {}\n  binds {} MiB, {} buffers a stage, workgroups of {}, {}timestamps, {} memory\n",
            a.name,
            a.kind,
            a.backend,
            a.driver,
            a.max_binding_bytes >> 20,
            a.storage_buffers_per_stage,
            a.max_workgroup,
            if a.timestamps { "" } else { "no " },
            if a.unified_memory { "unified" } else { "separate" }
        );
    }
    if f.reads_texels {
        s += "stages read arrays as texels of images on the same memory, which is faster on a software adapter\n";
    }
    if let Some(why) = &f.no_device_because {
        s += &format!("no device: {why}\n");
    }
    for v in &f.stages {
        let mark = if v.passed() { "ok  " } else { "FAIL" };
        s += &format!(
            "{mark} {:20} {:3} cases, largest difference {} (limit {}: {})\n",
            v.stage, v.cases, v.largest_difference, v.limit, v.reason
        );
    }
    if let Some(r) = &f.rates {
        s += &format!(
            "upload {:.1} GB/s, readback {:.1} GB/s in pieces of a 12-megapixel shot\n",
            r.upload_gb_s, r.readback_gb_s
        );
    }
    for w in &f.ways {
        let cpu = w.cpu_ms_per_shot.map_or(String::new(), |c| format!(", {c:.2} ms of CPU time"));
        s += &format!("full chain, {}x{}: {:.2} ms a shot{cpu} on {}\n", w.width, w.height, w.ms_per_shot, w.on);
    }
    s + &f.verdict
}
