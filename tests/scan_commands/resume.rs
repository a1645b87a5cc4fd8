//! In: scans that end in the middle: the device is lost, the disk takes no more, the program is killed. Out: a clear
//! error, nothing under a final name, and a resumed scan with the very points of an undisturbed one.
//! Frame and unit: base frame, mm.

use crate::common::sheetlight;
use crate::common::wait::until;
use sheetlight::fault::Kind;
use sheetlight::gpu::Device;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{
    BadShot, CloudPoint, Extraction, Format, GridOptions, Processor, RecordingSource, Shot, Source, Where, read_cloud,
};
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::station::{ScanOptions, scan_on};
use std::path::{Path, PathBuf};
use std::process::Command;

const SHOTS: usize = 150;

/// A simulated recording of small pictures.
struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Bench {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("sim").to_str().unwrap().to_owned();
        let (shots, rig) = (SHOTS.to_string(), dir.path().join("rig.toml"));
        // Hundreds of hot pixels: what the first shots say of the sensor has to last over a resume.
        let paper = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../data/rigs/paper.toml")).unwrap();
        assert!(paper.contains("[sensor]"));
        std::fs::write(&rig, paper.replace("[sensor]", "[sensor]\nhot_per_million = 5000")).unwrap();
        let rig = rig.to_str().unwrap();
        // Poses that scatter, which the end of a scan takes out of all of its shots.
        let poses = ["--pose-noise-mm", "0.05", "--pose-noise-deg", "0.005"];
        let size = ["--width", "320", "--shots", &shots, "--quiet"];
        sheetlight(&[&["simulate", "--rig", rig, "--out", &out], &size[..], &poses[..]].concat());
        Bench { dir }
    }
    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
    fn command(&self, out: &str, more: &[&str]) -> Vec<String> {
        let [recording, station, out] =
            ["sim/scan", "sim/station", out].map(|n| self.at(n).to_str().unwrap().to_owned());
        let mut args = vec!["scan".to_owned(), recording, "--station".into(), station, "--out".into(), out];
        args.extend(["--overlays", "0", "--on", "cpu", "--quiet"].map(str::to_owned));
        args.extend(more.iter().map(|s| (*s).to_owned()));
        args
    }
    fn whole(&self) -> Vec<CloudPoint> {
        let args = self.command("whole", &[]);
        sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>());
        let report = std::fs::read_to_string(self.at("whole/scan.json")).unwrap();
        let hot = serde_json::from_str::<serde_json::Value>(&report).unwrap()["hot_pixels"].as_u64().unwrap();
        assert!(hot > 50, "{hot} hot pixels found of 384");
        assert!(report.contains("\"taken_out\": true"), "{report}");
        read_cloud(&self.at("whole/cloud.ply")).unwrap()
    }
    fn resumed(&self, out: &str) -> Vec<CloudPoint> {
        let args = self.command(out, &["--resume"]);
        sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>());
        read_cloud(&self.at(out).join("cloud.ply")).unwrap()
    }
    /// Shots that an interrupted scan says are done.
    fn done(&self, out: &str) -> u64 {
        let text = std::fs::read_to_string(self.at(out).join("scan.part/progress.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap()["shots"].as_u64().unwrap()
    }
    fn unfinished(&self, out: &str) {
        for name in ["cloud.ply", "scan.json", "height.tif", "index.html", "cloud.pcd"] {
            assert!(!self.at(out).join(name).exists(), "{name} under its final name");
        }
    }
}

/// Loses the device when a shot is asked for.
struct Losing {
    inner: RecordingSource,
    device: Device,
    at: usize,
}

impl Source for Losing {
    fn format(&self) -> Format {
        self.inner.format()
    }
    fn remaining(&self) -> Option<usize> {
        self.inner.remaining()
    }
    fn next(&mut self) -> Option<Result<Shot, BadShot>> {
        if self.inner.remaining() == Some(SHOTS - self.at) {
            self.device.lose();
        }
        self.inner.next()
    }
}

fn options(out: &Path) -> ScanOptions {
    ScanOptions {
        latency: None,
        out: out.to_owned(),
        place: Where::Gpu,
        extraction: Extraction::default(),
        grid: GridOptions::default(),
        volume: None,
        motion: sheetlight::recording::Motion::default(),
        ambient: None,
        overlays: 0,
        skip_bad: false,
        resume: true,
        stop: Default::default(),
        watch: Default::default(),
    }
}

#[test]
fn a_lost_device_costs_no_finished_shot() {
    let Some(device) = crate::common::device() else { return };
    let b = Bench::new();
    let recording = Recording::open(&b.at("sim/scan")).unwrap();
    let rig = Rig::load(&b.at("sim/station")).unwrap();
    let batch = ChainConfig::new(320, 240, 8).on(&device).shots;
    let run = |out: &str, device: Device, lose: Option<usize>, told: &mut usize| {
        let source = |first| -> sheetlight::fault::Result<Box<dyn Source>> {
            let inner = RecordingSource::open(&recording, None, first)?;
            Ok(match lose {
                Some(at) => Box::new(Losing { inner, device: device.clone(), at }),
                None => Box::new(inner),
            })
        };
        scan_on(
            || Ok(Processor::Gpu(device.clone())),
            "id",
            "test",
            source,
            &rig,
            &options(&b.at(out)),
            |done, _| *told = done,
        )
    };
    let mut told = 0;
    let fault = run("lost", device, Some(140), &mut told).expect_err("the device was lost");
    assert_eq!(fault.kind, Kind::Device, "{fault}");
    assert!(fault.what.contains("lost") && fault.next.contains("again"), "{fault}");
    b.unfinished("lost");
    // What is in flight when it happens is lost with the device: a batch in each of three places. What was said to be
    // done is.
    let done = b.done("lost");
    let least = 140u64.saturating_sub(8 + 4 * u64::from(batch));
    assert!((least..=140).contains(&done) && done == told as u64, "{done} shots done, {told} told");
    run("lost", Device::open().unwrap(), None, &mut told).unwrap();
    run("whole", Device::open().unwrap(), None, &mut told).unwrap();
    let [resumed, whole] = ["lost", "whole"].map(|out| read_cloud(&b.at(out).join("cloud.ply")).unwrap());
    assert!(resumed == whole && whole.len() > 10_000, "{} and {} points", resumed.len(), whole.len());
}

/// The shell lets no file grow beyond some 1 to 2 MB (its block is 512 or 1,024 bytes): as on a full disk, writing
/// fails in the middle of the scan.
#[test]
#[cfg(target_os = "linux")]
fn a_disk_that_fills_up_costs_no_finished_shot() {
    let b = Bench::new();
    let whole = b.whole();
    let bytes = whole.len() * size_of::<CloudPoint>();
    // Between two thirds of a scan and the whole, whichever the block.
    let blocks = (bytes * 9 / 10 / 1024).to_string();
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    let done = Command::new("sh")
        .args(["-c", &script, env!("CARGO_BIN_EXE_sheetlight")])
        .args(b.command("full", &[]))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.code() == Some(1) && text.contains("cloud.ply"), "{text}");
    assert!(text.contains("cannot be written") && text.contains("next step"), "{text}");
    b.unfinished("full");
    assert!(b.done("full") >= 64, "{} shots done", b.done("full"));
    assert!(b.resumed("full") == whole);
}

#[test]
fn a_killed_scan_resumes() {
    let b = Bench::new();
    let whole = b.whole();
    let checkpoint = b.at("killed/scan.part/progress.json");
    // It may end before it is killed: then it is ordered again.
    let killed = (0..10).any(|_| {
        let _ = std::fs::remove_dir_all(b.at("killed"));
        let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(b.command("killed", &[])).spawn().unwrap();
        until(|| checkpoint.exists() || child.try_wait().unwrap().is_some());
        child.kill().unwrap();
        child.wait().unwrap();
        checkpoint.exists() && b.done("killed") < SHOTS as u64
    });
    assert!(killed, "killed after the first checkpoint and before the end");
    b.unfinished("killed");
    assert!(b.resumed("killed") == whole);
}
