//! In: commands that are killed, or whose disk fills up, at each of their file operations, and scans that are told to
//! stop.
//! Out: the old result whole, or the new one, or the same bytes after --resume.
//! Frame and unit: none. SHEETLIGHT_LONG tries every operation; else every some are tried.

use super::bench::{Bench, VALUES, refused, run, snapshot};
use sheetlight::recording::Recording;
use sheetlight::rig::{Rig, Volume};
use sheetlight::scan::{Extraction, GridOptions, RecordingSource, Where};
use sheetlight::station::{ScanOptions, cloud_of, load_report, scan};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub fn long() -> bool {
    std::env::var_os("SHEETLIGHT_LONG").is_some()
}

/// Runs with a variable of `sheetlight::files::moment` set; whether it succeeded.
pub fn cut_off(args: &[String], variable: &str, at: u64) -> bool {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sheetlight"));
    command.args(args).env(variable, at.to_string()).stdout(Stdio::null()).stderr(Stdio::piped());
    let done = command.output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(!said.contains("panicked"), "{variable}={at}: {said}");
    assert!(done.status.success() || variable != "SHEETLIGHT_FULL_AT" || said.contains("next step"), "{at}: {said}");
    done.status.success()
}

/// What a scan gives, whatever the clock said meanwhile.
fn results(out: &Path) -> Vec<(String, Vec<u8>)> {
    ["cloud.ply", "shots.jsonl", "height.tif", "sigma.tif", "height.json", "cloud.pcd"]
        .map(|name| (name.to_owned(), std::fs::read(out.join(name)).unwrap_or_default()))
        .to_vec()
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "only debug builds can be stopped at a file operation")]
fn an_import_that_is_stopped_anywhere_is_old_or_new() {
    let b = Bench::new(1);
    let other = VALUES.replace("305.8", "310.5").replace("\"offset_mm\": 72", "\"offset_mm\": 73");
    std::fs::write(b.at("other.json"), other).unwrap();
    let import = |name: &str| ["station", "import", &b.text(name), "--station", &b.text("station")].map(str::to_owned);
    let print = || Rig::load(&b.at("station")).and_then(|r| r.belong_together().map(|()| r.fingerprint())).unwrap();
    let old = print();
    run(&import("other.json"));
    let new = print();
    let mut tried = 0;
    for variable in ["SHEETLIGHT_DIE_AT", "SHEETLIGHT_FULL_AT"] {
        let (mut seen_old, mut seen_new) = (0, 0);
        for at in 1.. {
            run(&import("values.json"));
            let done = cut_off(&import("other.json"), variable, at);
            let is = print();
            assert!(is == old || is == new, "{variable}={at}");
            assert!(!done || is == new);
            if done {
                break;
            }
            tried += 1;
            if is == old { seen_old += 1 } else { seen_new += 1 }
        }
        assert!(seen_old > 5 && seen_new > 2, "{variable}: {seen_old} old, {seen_new} new");
    }
    println!("{tried} moments of an import");
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "only debug builds can be stopped at a file operation")]
fn a_scan_that_is_stopped_anywhere_is_resumed_to_the_same_bytes() {
    let b = Bench::new(24);
    b.record("former", 90);
    run(&b.scan("recording", "whole", &[]));
    run(&b.scan("former", "old", &[]));
    // With cloud and shots that are written twice.
    let places = load_report(&b.at("whole")).unwrap().places;
    assert!(places.is_some_and(|p| p.taken_out), "{places:?}");
    let (whole, old) = (results(&b.at("whole")), results(&b.at("old")));
    assert!(whole != old && whole.iter().all(|(_, bytes)| !bytes.is_empty()));
    let mut tried = 0;
    for (variable, first) in [("SHEETLIGHT_DIE_AT", 2), ("SHEETLIGHT_FULL_AT", 5)] {
        let mut at = first;
        loop {
            let out = format!("{variable} {at}");
            // Over a former scan by turns, and into a new folder.
            let over = at % 2 == 0;
            if over {
                run(&b.scan("former", &out, &[]));
            }
            let done = cut_off(&b.scan("recording", &out, &[]), variable, at);
            // Whoever reads the folder now finds one scan or none.
            match cloud_of(&b.at(&out)) {
                Ok(_) => {
                    let is = results(&b.at(&out));
                    assert!(is == whole || (over && is == old), "{out}: two scans in one folder");
                }
                Err(fault) => assert!(!over && !done, "{out}: {fault}"),
            }
            if done {
                break;
            }
            run(&b.scan("recording", &out, &["--resume"]));
            assert!(results(&b.at(&out)) == whole, "{out}: resumed to other bytes");
            let left: Vec<_> = snapshot(&b.at(&out))
                .into_keys()
                .filter(|p| p.display().to_string().contains(".sheetlight."))
                .collect();
            assert!(left.is_empty(), "{out}: {left:?} are left");
            tried += 1;
            at += if long() { 1 } else { 13 };
        }
    }
    println!("{tried} moments of a scan");
    assert!(tried >= 4);
}

/// Kills at any moment, not only at file operations.
#[test]
fn a_scan_that_is_killed_at_random_is_resumed_to_the_same_bytes() {
    let b = Bench::new(80);
    let started = std::time::Instant::now();
    run(&b.scan("recording", "whole", &[]));
    let (whole, lasts) = (results(&b.at("whole")), started.elapsed());
    for k in 0..if long() { 200u32 } else { 3 } {
        let out = format!("killed {k}");
        let mut child =
            Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(b.scan("recording", &out, &[])).spawn().unwrap();
        // Spread by the golden section over the scan's duration.
        std::thread::sleep(lasts.mul_f64((f64::from(k) * 0.618_034 + 0.5).fract()));
        child.kill().unwrap();
        child.wait().unwrap();
        run(&b.scan("recording", &out, &["--resume"]));
        assert!(results(&b.at(&out)) == whole, "{out}");
    }
}

/// Sizes of a full disk, kB: 1 kB to 20 MB in 40 steps, or some of them; no two alike.
fn sizes() -> impl Iterator<Item = u32> {
    let steps: u32 = if long() { 40 } else { 3 };
    let size = move |step: u32| 20_000f64.powf(f64::from(step) / f64::from(steps - 1)).round() as u32;
    (0..steps).map(move |step| size(step).max(step + 1))
}

/// The shell lets no file grow beyond a size: as on a disk that is full at that byte.
#[test]
#[cfg(target_os = "linux")]
fn files_that_may_not_grow() {
    let b = Bench::new(3);
    run(&b.scan("recording", "whole", &[]));
    let whole = results(&b.at("whole"));
    for kb in sizes() {
        let out = format!("full {kb}");
        let script = format!("trap '' XFSZ; ulimit -f {kb}; exec \"$0\" \"$@\"");
        let mut command = Command::new("bash");
        command.args(["-c", &script, env!("CARGO_BIN_EXE_sheetlight")]).args(b.scan("recording", &out, &[]));
        let done = command.output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        if !done.status.success() {
            assert!(done.status.code() == Some(1) && said.contains("next step"), "{kb} kB: {said}");
            assert!(cloud_of(&b.at(&out)).is_err());
            run(&b.scan("recording", &out, &["--resume"]));
        }
        assert!(results(&b.at(&out)) == whole, "{kb} kB");
    }
}

/// Disks that are full: a file system of its own of each size, which grows when the scan has failed.
#[test]
#[cfg(target_os = "linux")]
fn full_disks() {
    let mountable = Command::new("unshare").args(["-m", "mount", "-t", "tmpfs", "tmpfs", "/mnt"]).output();
    if !mountable.is_ok_and(|done| done.status.success()) {
        println!("*** SKIPPED: file systems of a few kB can be mounted by root only ***");
        return;
    }
    let b = Bench::new(3);
    run(&b.scan("recording", "whole", &[]));
    let whole = results(&b.at("whole"));
    let (disk, mut full) = (b.at("disk"), 0);
    std::fs::create_dir(&disk).unwrap();
    // In a name space of its own: the disk goes with the shell. $0 is the disk, $1 where the scan is copied to, $2
    // its size.
    let script = "mount -t tmpfs -o size=$2k tmpfs \"$0\" || exit 9; kept=$1; shift 2; \"$@\"; code=$?; \
                  test ! -e \"$0/out/cloud.ply\" || test $code = 0 || exit 8; \
                  if test $code != 0; then mount -o remount,size=64m \"$0\" && \"$@\" --resume || exit 7; fi; \
                  cp -r \"$0/out\" \"$kept\"; exit $code";
    for kb in sizes() {
        let kept = format!("kept {kb}");
        let mut command = Command::new("unshare");
        command.args(["-m", "bash", "-c", script]).arg(&disk).arg(b.at(&kept)).arg(kb.to_string());
        command.arg(env!("CARGO_BIN_EXE_sheetlight")).args(b.scan("recording", "disk/out", &[]));
        let done = command.output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        let code = done.status.code();
        assert!(matches!(code, Some(0 | 1)) && !said.contains("panicked"), "{kb} kB: {code:?}\n{said}");
        assert!(code == Some(0) || (said.contains("No space left") && said.contains("next step")), "{kb} kB: {said}");
        assert!(results(&b.at(&kept)) == whole, "{kb} kB");
        full += u32::from(code == Some(1));
    }
    println!("{full} of {} disks were full", sizes().count());
    assert!(full > 0 && (full as usize) < sizes().count());
}

fn options(out: &Path, stop: &Arc<AtomicBool>, resume: bool) -> ScanOptions {
    ScanOptions {
        latency: None,
        out: out.to_owned(),
        place: Where::Cpu,
        extraction: Extraction::default(),
        grid: GridOptions::default(),
        volume: Some(Volume::new(60.0, 320.0, "a test")),
        motion: sheetlight::recording::Motion::default(),
        ambient: None,
        overlays: 1,
        skip_bad: false,
        resume,
        stop: stop.clone(),
        watch: Default::default(),
    }
}

#[test]
fn a_scan_that_is_told_to_stop_keeps_its_points_and_goes_on_with_its_own_only() {
    let b = Bench::new(24);
    b.record("other", 300);
    let rig = Rig::load(&b.at("station")).unwrap();
    let go = |recording: &str, out: &str, resume: bool, depth: f64, stop_at: usize| {
        let recording = Recording::open(&b.at(recording)).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let mut options = options(&b.at(out), &stop, resume);
        options.volume.as_mut().unwrap().far_mm = depth;
        let open = |first| Ok(Box::new(RecordingSource::open(&recording, None, first)?) as Box<_>);
        scan("id", "test", open, &rig, &options, |done, _| stop.store(done >= stop_at, Ordering::Relaxed))
    };
    go("recording", "whole", false, 320.0, usize::MAX).unwrap();
    let said = go("recording", "stopped", false, 320.0, 9).unwrap_err();
    assert!(said.what.contains("of 24 shots with") && said.what.contains("are kept"), "{said}");
    assert!(said.next.contains("--resume"), "{said}");
    // Not with another recording's pictures, though its poses are the same, nor with another working volume.
    let said = go("other", "stopped", true, 320.0, usize::MAX).unwrap_err();
    assert!(said.what.contains("is not the picture"), "{said}");
    let said = go("recording", "stopped", true, 300.0, usize::MAX).unwrap_err();
    assert!(said.what.contains("working volume"), "{said}");
    go("recording", "stopped", true, 320.0, usize::MAX).unwrap();
    assert!(results(&b.at("stopped")) == results(&b.at("whole")));
}

/// A stream that is stopped by a signal: what came of it is a scan, and the report says that it was stopped.
#[test]
#[cfg(unix)]
fn signals_end_a_stream_with_what_came() {
    use std::io::Write;
    let b = Bench::new(12);
    let recording = Recording::open(&b.at("recording")).unwrap();
    let levels = |i: usize| match recording.picture(&format!("{i}.png")).unwrap().pixels {
        sheetlight::raster::Pixels::U8(p) => p,
        _ => panic!("8 bits"),
    };
    // Under nohup the end of the session is ignored, by the program too.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored =
        status.lines().find_map(|l| l.strip_prefix("SigIgn:")).and_then(|m| u64::from_str_radix(m.trim(), 16).ok());
    let hangup = ignored.is_none_or(|mask| mask & 1 == 0);
    for signal in ["INT", "TERM", "HUP"].into_iter().filter(|s| *s != "HUP" || hangup) {
        let out = format!("by {signal}");
        let mut args =
            b.scan("recording", &out, &["--raw", "320x240:gray8", "--poses", &b.text("recording/poses.json")]);
        args.remove(1);
        let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
            .args(&args)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut pipe = child.stdin.take().unwrap();
        (0..9).for_each(|i| pipe.write_all(&levels(i)).unwrap());
        // Nine frames are more than a pipe holds: most have been read, so the handlers stand.
        let sent = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let _ = pipe.write_all(&levels(9));
        drop(pipe);
        let done = child.wait_with_output().unwrap();
        assert!(done.status.success(), "{signal}: {}", String::from_utf8_lossy(&done.stderr));
        let report = sheetlight::station::load_report(&b.at(&out)).unwrap();
        assert!((6..=10).contains(&report.shots), "{signal}: {} shots", report.shots);
        assert!(report.remarks.iter().any(|r| r.contains("stopped by a signal")), "{:?}", report.remarks);
        cloud_of(&b.at(&out)).unwrap();
    }
    // Fewer frames than poses without a signal are no scan.
    let mut args =
        b.scan("recording", "short", &["--raw", "320x240:gray8", "--poses", &b.text("recording/poses.json")]);
    args.remove(1);
    assert!(refused(&args).contains("gave 0 frames, the pose file has 12 poses"));
}

/// Two scans that are started into one folder at once: one waits or is refused, and the folder holds one of them,
/// whole.
#[test]
fn two_at_once_do_not_mix() {
    let b = Bench::new(20);
    b.record("other", 40);
    for name in ["recording", "other"] {
        run(&b.scan(name, &format!("{name} alone"), &[]));
    }
    let alone = ["recording alone", "other alone"].map(|n| results(&b.at(n)));
    for round in 0..if long() { 20 } else { 3 } {
        let out = format!("both {round}");
        let started = ["recording", "other"].map(|name| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_sheetlight"));
            command.args(b.scan(name, &out, &[])).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
        });
        let ended = started.map(|child| child.wait_with_output().unwrap());
        let is = results(&b.at(&out));
        assert!(alone.contains(&is), "{out} holds two scans");
        cloud_of(&b.at(&out)).unwrap();
        for done in ended.iter().filter(|d| !d.status.success()) {
            let said = String::from_utf8_lossy(&done.stderr);
            assert!(said.contains("another scan writes here"), "{said}");
        }
        assert!(ended.iter().any(|d| d.status.success()));
    }
}
