//! In: this machine. Out: its adapters, every stage compared with its CPU counterpart, transfer rates, the time of
//! a shot, and a verdict; each is printed as soon as it is known.
//! Frame and unit: words that differ, or the stage's own measure; GB/s, ms.

use super::trial;
use super::trial::{Event, Limits, StageFinding};
use crate::bench::WayTime;
use crate::cli::terminal::console::Console;
use sheetlight::fault::{Fault, Result};
use sheetlight::gpu::{AdapterInfo, Rates, adapters};

/// Check this machine: GPU, every stage against its CPU twin, transfer rates
///
/// Exit code 0 if the GPU chain can be trusted, or if there is no GPU (everything then runs on the processor). Exit
/// code 1 if a stage differs from its twin, or its driver takes too long or too much memory to compile it.
#[derive(clap::Args)]
pub struct Args {
    /// Skip the transfer rates and the times of a shot, which take some seconds
    #[arg(long)]
    no_rates: bool,
    /// Processor time that one stage may take, s
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    stage_seconds: f64,
    /// Memory that the stages may take, MiB
    #[arg(long, value_name = "MIB", default_value_t = 2048)]
    stage_mib: u64,
    /// For doctor itself: run the stages from this one on, and tell of each as a line of JSON
    #[arg(long, hide = true)]
    from_stage: Option<usize>,
}

#[derive(serde::Serialize)]
struct Findings {
    program: String,
    adapters: Vec<AdapterInfo>,
    used: Option<String>,
    /// The adapter's stages read arrays as texels.
    reads_texels: bool,
    no_device_because: Option<String>,
    stages: Vec<StageFinding>,
    rates: Option<Rates>,
    /// Times of the whole chain on this machine's processor and on the adapter.
    ways: Vec<WayTime>,
    verdict: String,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    if let Some(from) = args.from_stage {
        return trial::run(from, !args.no_rates, console);
    }
    let limits = Limits { seconds: args.stage_seconds, mib: args.stage_mib };
    limits.check()?;
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
    console.part(&format!("{}\n{}", findings.program, findings.adapters.iter().map(adapter).collect::<String>()));
    trial::watch(&limits, !args.no_rates, &mut |event| findings.take(event, console))?;
    let wrong: Vec<&str> = findings.stages.iter().filter(|s| !s.passed()).map(|s| s.stage.as_str()).collect();
    findings.verdict = verdict(findings.used.as_deref(), &wrong);
    console.result(&findings, &findings.verdict);
    if wrong.is_empty() {
        return Ok(());
    }
    Err(Fault::device(format!("{} of {} stages fail: {}", wrong.len(), findings.stages.len(), wrong.join(", ")))
        .cause("a driver bug, failing hardware, or a driver that cannot compile them in time")
        .next("update the driver, choose another adapter with SHEETLIGHT_ADAPTER, or scan with --on cpu"))
}

impl Findings {
    /// Stores the result of a trial and reports it.
    fn take(&mut self, event: Event, console: &Console) {
        match event {
            Event::Device { name, reads_texels } if self.used.is_none() => {
                if reads_texels {
                    console.part(
                        "stages read arrays as texels of images on the same memory, which is faster on a software \
                         adapter",
                    );
                }
                (self.used, self.reads_texels) = (Some(name), reads_texels);
            }
            Event::Device { .. } | Event::Begin { .. } => {}
            Event::NoDevice { why } => {
                console.part(&format!("no device: {why}"));
                self.no_device_because = Some(why);
            }
            Event::Stage(stage) => {
                console.part(&line(&stage));
                self.stages.push(stage);
            }
            Event::Rates(r) => {
                console.part(&format!(
                    "upload {:.1} GB/s, readback {:.1} GB/s in pieces of a 12-megapixel shot",
                    r.upload_gb_s, r.readback_gb_s
                ));
                self.rates = Some(r);
            }
            Event::Ways(ways) => {
                console.part(&ways.iter().map(way).collect::<String>());
                self.ways = ways;
            }
        }
    }
}

fn verdict(used: Option<&str>, wrong: &[&str]) -> String {
    match (used, wrong.is_empty()) {
        (None, _) => {
            "no GPU: everything runs on this machine's processor, with the same results but for rounding".into()
        }
        (Some(name), true) => format!("good: every stage on {name} agrees with its CPU twin"),
        (Some(_), false) => format!("do not use this GPU: {} failed; scan with --on cpu", wrong.join(", ")),
    }
}

fn adapter(a: &AdapterInfo) -> String {
    format!(
        "adapter {} ({}, {}), driver {}\n  binds {} MiB, {} buffers a stage, workgroups of {}, {}timestamps, {} \
         memory\n",
        a.name,
        a.kind,
        a.backend,
        a.driver,
        a.max_binding_bytes >> 20,
        a.storage_buffers_per_stage,
        a.max_workgroup,
        if a.timestamps { "" } else { "no " },
        if a.unified_memory { "unified" } else { "separate" }
    )
}

fn way(w: &WayTime) -> String {
    let cpu = w.cpu_ms_per_shot.map_or(String::new(), |c| format!(", {c:.2} ms of CPU time"));
    format!("full chain, {}x{}: {:.2} ms a shot{cpu} on {}\n", w.width, w.height, w.ms_per_shot, w.on)
}

fn line(s: &StageFinding) -> String {
    match (&s.failed, s.passed()) {
        (Some(why), _) => format!("FAIL {:20} {why}", s.stage),
        (None, passed) => format!(
            "{} {:20} {:3} cases, largest difference {} (limit {}: {})",
            if passed { "ok  " } else { "FAIL" },
            s.stage,
            s.cases,
            s.largest_difference,
            s.limit,
            s.reason
        ),
    }
}
