//! In: a station that works for half a day: a part every half minute is scanned and found, in one process. Out: memory, open files and threads
//! are at the end what they were after the first tenth.
//! Frame and unit: counts, MB. SHEETLIGHT_LONG runs all of 12 hours' scans, else a sixtieth.
#![cfg(target_os = "linux")]

use sheetlight::find::{LocateOptions, Recipe};
use sheetlight::gpu::Device;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{Extraction, GridOptions, RecordingSource, Where};
use sheetlight::simulate::{RigSpec, Set, SimulateOptions, simulate};
use sheetlight::station::{ScanOptions, find_part, scan};
use std::path::Path;

/// A part every half minute for 12 hours.
const SCANS: usize = 12 * 3600 / 30;
/// Pictures of this width stand for the camera's, and of a scan's shots there are so many: what is kept too long shows by the scan.
const WIDTH: u32 = 160;
/// Every so many scans the part is found, too, and every so many run on the GPU, where one is: each compiles its stages anew.
const FIND_EVERY: usize = 20;
const GPU_EVERY: usize = 24;

#[derive(Clone, Copy, Debug)]
struct Held {
    mb: f64,
    files: usize,
    threads: usize,
}

fn held() -> Held {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let number = |key: &str| {
        let line = status.lines().find_map(|l| l.strip_prefix(key)).unwrap();
        line.split_whitespace().next().unwrap().parse::<f64>().unwrap()
    };
    let files = std::fs::read_dir("/proc/self/fd").unwrap().count();
    Held { mb: number("VmRSS:") / 1024.0, files, threads: number("Threads:") as usize }
}

fn options(out: &Path, place: Where) -> ScanOptions {
    ScanOptions {
        out: out.to_owned(),
        place,
        extraction: Extraction::default(),
        grid: GridOptions::default(),
        volume: None,
        ambient: None,
        overlays: 2,
        skip_bad: false,
        resume: false,
        stop: Default::default(),
    }
}

#[test]
fn twelve_hours_of_scans_hold_no_more_than_the_first() {
    let share = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 1 } else { 60 };
    let dir = tempfile::tempdir().unwrap();
    let rig = RigSpec::paper();
    let recipe = Recipe::parse(&rig.recipe(60)).unwrap();
    let small = SimulateOptions {
        width: WIDTH,
        height: WIDTH * 3 / 4,
        shots: 60,
        sets: vec![Set::Scan],
        ..SimulateOptions::of(rig)
    };
    let made = simulate(dir.path(), &small, &|_, _| {}).unwrap();
    let rig = Rig::load(&made.station).unwrap();
    let recording = Recording::open(&made.recordings[0].1).unwrap();
    let gpu = Device::open().is_ok();
    let out = dir.path().join("out");
    let (scans, mut found, mut warm, mut most) = (SCANS / share, 0, None, 0.0f64);
    for i in 0..scans {
        let place = if gpu && i % GPU_EVERY == 0 { Where::Gpu } else { Where::Cpu };
        let open = |first| Ok(Box::new(RecordingSource::open(&recording, None, first)?) as Box<_>);
        let report = scan("soak", "soak", open, &rig, &options(&out, place), |_, _| {}).unwrap();
        assert!(report.points > 1000, "{} points", report.points);
        if i % FIND_EVERY == 0 {
            found += usize::from(find_part(&out, &recipe, Some(&made.station), &LocateOptions::default()).is_ok());
        }
        if i == scans / 10 + GPU_EVERY.min(scans / 2) {
            warm = Some(held());
        }
        most = most.max(if warm.is_some() { held().mb } else { 0.0 });
    }
    let (warm, end) = (warm.unwrap(), held());
    println!(
        "{scans} scans, {found} parts found: {warm:?} after the first tenth, {end:?} at the end, at most {most:.0} MB between"
    );
    assert!(found > 0);
    assert!(end.files <= warm.files && end.threads <= warm.threads + 1, "{warm:?} became {end:?}");
    // What allocators and drivers keep for the next time comes and goes; a scan that kept its cloud of 0.1 MB would be 130 MB.
    assert!(end.mb < warm.mb + 24.0, "{warm:?} became {end:?}");
}
