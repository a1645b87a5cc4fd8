//! In: pipes, folders, ffmpeg, a simulated station. Out: whether their pictures come as they are, and what is said
//! where they do not.
//! Frame and unit: pixels, pictures.

use super::{scan_folder, text};
use crate::common::tries::{judged, tries};
use crate::common::wait::until;
use crate::common::{sheetlight, sheetlight_fails};
use sheetlight::capture::{CameraUri, Event, Fate, Fed, Feed, FeedOptions, Mode, PictureSource};
use sheetlight::raster::Image;
use sheetlight::recording::Recording;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn open(uri: &str) -> sheetlight::fault::Result<Box<dyn PictureSource>> {
    uri.parse::<CameraUri>().expect("a source").open(None)
}

/// The laser pictures of the simulated recording, in order.
fn pictures() -> Vec<Image> {
    let recording = Recording::open(&scan_folder()).unwrap();
    let names = recording.meta.frames.iter().filter_map(|f| f.laser.clone());
    names.map(|n| recording.picture(&n).unwrap()).collect()
}

fn all(mut source: Box<dyn PictureSource>, most: usize) -> Vec<Image> {
    let mut images = Vec::new();
    let begun = Instant::now();
    while images.len() < most && begun.elapsed() < Duration::from_secs(120) {
        match source.next(Duration::from_millis(200)) {
            Event::Picture(p) => images.push(p.image),
            Event::Ended => break,
            Event::Lost(fault) => panic!("{fault}"),
            _ => {}
        }
    }
    images
}

#[test]
fn raw_frames_on_a_pipe_are_recorded_as_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("piped");
    let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
        .args(["record", "--camera", "-", "--raw", "320x240:gray8", "--out", &text(&out), "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pipe = child.stdin.take().unwrap();
    let sent = pictures();
    sent.iter().for_each(|p| pipe.write_all(&p.to_u8()).unwrap());
    // It ends inside a frame: that is said, and what came is kept.
    pipe.write_all(&[0; 100]).unwrap();
    drop(pipe);
    let done = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(said.contains("100 of 76800 bytes") && said.contains("24 shots, whole"), "{said}");
    let recording = Recording::open(&out).unwrap();
    let names: Vec<_> = recording.meta.frames.iter().map(|f| f.laser.clone().unwrap()).collect();
    assert!(names.iter().map(|n| recording.picture(n).unwrap()).eq(sent));
}

#[test]
fn a_folder_gives_each_picture_once_it_is_complete() {
    let sent = pictures();
    // What is there before the folder is looked at is none of its pictures, and half a picture is waited for two
    // seconds long.
    tries(5, || {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a000.png"), sheetlight::raster::png(&sent[0])).unwrap();
        let (folder, filling) = (dir.path().to_owned(), sent.clone());
        let fill = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(150));
            for (k, image) in filling.iter().take(6).enumerate() {
                let bytes = sheetlight::raster::png(image);
                let mut file = std::fs::File::create(folder.join(format!("b{k}.png"))).unwrap();
                let (first, rest) = bytes.split_at(bytes.len() / 2);
                file.write_all(first).unwrap();
                // Longer than a size takes to settle: half a picture does not decode, so it is waited for.
                std::thread::sleep(Duration::from_millis(90));
                file.write_all(rest).unwrap();
            }
            std::fs::write(folder.join("b6.png"), [0x89, b'P', b'N', b'G', 0, 0]).unwrap();
            std::fs::write(folder.join("b7.png"), sheetlight::raster::png(&filling[6])).unwrap();
            std::fs::write(folder.join("notes.txt"), "no picture").unwrap();
            // The same picture in another format is no further one; a picture that is not read is one.
            std::fs::write(folder.join("b7.webp"), "RIFF").unwrap();
            std::fs::write(folder.join("b8.gif"), "GIF8").unwrap();
        });
        let Ok(mut source) = open(&format!("folder:{}?wait=5", text(dir.path()))) else {
            fill.join().unwrap();
            return Err("all were there before".into());
        };
        let (mut came, mut spoilt, begun) = (Vec::new(), Vec::new(), Instant::now());
        while (came.len() < 7 || spoilt.len() < 2) && begun.elapsed() < Duration::from_secs(20) {
            match source.next(Duration::from_millis(100)) {
                Event::Picture(p) => came.push(p.image),
                Event::Incomplete { why, .. } => spoilt.push(why),
                _ => {}
            }
        }
        fill.join().unwrap();
        let named = spoilt.len() == 2 && spoilt[0].contains("b6.png") && spoilt[1].contains("b8.gif");
        let right = came.iter().eq(&sent[..7]) && named;
        judged((), right, format!("{} pictures, spoilt {spoilt:?}", came.len()))
    });
    let none = tempfile::tempdir().unwrap();
    let fault = open(&format!("folder:{}?wait=0.1", text(none.path()))).err().unwrap();
    assert!(fault.what.contains("no new picture"), "{fault}");
}

#[test]
fn ffmpeg_gives_the_frames_of_what_it_opens_and_its_errors_in_our_words() {
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        assert!(std::env::var("CI").is_err(), "ffmpeg is not installed");
        eprintln!("SKIPPED: ffmpeg is not installed");
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let video = text(&dir.path().join("shots.mkv"));
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-framerate", "25", "-i", &text(&scan_folder().join("laser_%04d.png"))])
        .args(["-c:v", "ffv1", "-pix_fmt", "gray", &video])
        .status()
        .unwrap();
    assert!(made.success());
    assert!(all(open(&format!("ffmpeg:{video}")).unwrap(), 100).iter().eq(&pictures()));
    let deep = all(open("ffmpeg:-f lavfi -i testsrc2=size=64x48:rate=25:duration=0.2?bits=12").unwrap(), 100);
    assert_eq!((deep.len(), deep[0].bits, deep[0].width), (5, 12, 64));
    // A file shorter than what a camera may have in flight gives its last picture.
    let (one, shown) = (text(&dir.path().join("one.png")), text(&dir.path().join("shown.png")));
    std::fs::write(&one, sheetlight::raster::png(&pictures()[0])).unwrap();
    sheetlight(&["camera", "snap", &shown, "--camera", &format!("ffmpeg:-i {one}")]);
    assert_eq!(sheetlight::raster::load(shown.as_ref(), Default::default(), 8).unwrap(), pictures()[0]);
    let fault = open("ffmpeg:-i /dev/none").err().unwrap();
    assert!(fault.what.contains("No such file") && fault.next.contains("ffmpeg"), "{fault}");
}

#[test]
fn the_newest_picture_is_never_old_and_the_others_are_counted() {
    let period = 50.0;
    tries(5, || {
        let source = open(&format!("play:{}?rate=20&loops=2", text(&scan_folder()))).unwrap();
        let options = FeedOptions { mode: Mode::Newest, ..FeedOptions::default() };
        let feed = Feed::start(source, options).unwrap();
        let mut oldest: f64 = 0.0;
        loop {
            match feed.next(Duration::from_secs(60)) {
                Fed::Picture(p, _) => {
                    // After the last one no newer comes.
                    if p.id < 47 {
                        oldest = oldest.max((sheetlight::capture::now_ns() - p.host_ns) as f64 * 1e-6);
                    }
                    feed.fate(Fate::Used);
                    // Ten times too slow.
                    std::thread::sleep(Duration::from_millis(10 * period as u64));
                }
                Fed::Quiet => panic!("nothing comes"),
                Fed::Ended(fault) => break assert!(fault.is_none()),
            }
        }
        let a = feed.account();
        println!("newest of 20 a second, a consumer of 2: {a}; the oldest was {oldest:.1} ms old");
        assert_eq!((a.sent, a.unexplained()), (48, 0), "{a}");
        judged((), a.dropped_processing > 35 && oldest < 2.0 * period, format!("{a}, {oldest} ms"))
    });
}

#[test]
fn a_simulated_station_shows_what_is_there_now() {
    let dir = tempfile::tempdir().unwrap();
    let out = text(&dir.path().join("sim"));
    let args = [
        "record",
        "--camera",
        "sim:3?rate=20&size=160x120",
        "--pair",
        "given",
        "--out",
        &out,
        "--shots",
        "4",
        "--json",
    ];
    let report: serde_json::Value = serde_json::from_str(&sheetlight(&args)).unwrap();
    assert_eq!(report["shots"], 4);
    let recording = Recording::open(dir.path().join("sim").as_path()).unwrap();
    let poses = recording.poses(None).unwrap();
    let frames = &recording.meta.frames;
    let taken = |k: usize| frames[k].taken.as_ref().unwrap();
    // 20 mm/s, or slower near the ends of the way.
    let seconds = (taken(3).device_ns.unwrap() - taken(0).device_ns.unwrap()) as f64 * 1e-9;
    let way = (poses[3].translation - poses[0].translation).norm();
    assert!(way <= 20.0 * seconds + 1e-6, "{way} mm in {seconds} s");
    assert!(taken(0).exposure_ns == Some(1_000_000));
}

#[test]
fn words_that_name_nothing_are_answered() {
    for (args, says) in [
        (vec!["record", "--out", "x"], "no camera is named"),
        (vec!["record", "--camera", "-", "--out", "x"], "--raw"),
        (vec!["record", "--camera", "usb0", "--out", "x"], "names no camera"),
        (vec!["record", "--camera", "cell://127.0.0.1:9", "--out", "x"], "no cell answers"),
        (vec!["record", "--camera", "sim:1", "--pair", "clock", "--out", "x"], "--pose-stream"),
        (vec!["record", "--camera", "sim:1", "--pair", "count", "--out", "x"], "--counts-per-shot"),
        (vec!["record", "--camera", "sim:1?size=10x10", "--out", "x"], "64 to 8192"),
    ] {
        let (_, said) = sheetlight_fails(&args);
        assert!(said.contains(says), "{args:?}: {said}");
    }
}

/// The last child of a process; none while it has none.
fn child_of(pid: u32) -> Option<u32> {
    let of = |entry: std::fs::DirEntry| {
        let stat = std::fs::read_to_string(entry.path().join("stat")).ok()?;
        let parent: u32 = stat.rsplit(')').next()?.split_whitespace().nth(1)?.parse().ok()?;
        (parent == pid && stat.contains("(ffmpeg)")).then(|| entry.file_name().to_string_lossy().parse().ok())?
    };
    std::fs::read_dir("/proc").ok()?.flatten().find_map(of)
}

#[test]
fn what_ends_a_run_is_said_with_the_next_step_and_what_was_recorded_stays() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sheetlight"));
        command.args(args).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let said = |mut command: Command| String::from_utf8(command.output().unwrap().stderr).unwrap();
    let out = text(&dir.path().join("out"));
    let mut missing = run(&["record", "--camera", "ffmpeg:video.mkv", "--out", &out]);
    missing.env("PATH", "/nowhere");
    let missing = said(missing);
    assert!(missing.contains("ffmpeg cannot be started") && missing.contains("install it"), "{missing}");
    // Pictures of another shape than the station's camera.
    for command in ["scan", "live"] {
        let mut args = vec![command, "--camera", "sim:1?size=200x200&rate=20"];
        let (station, scan) = (super::station(), text(&dir.path().join("scan")));
        args.extend(["--station", &station]);
        if command == "scan" {
            args.extend(["--pair", "given", "--out", &scan]);
        }
        let other = said(run(&args));
        assert!(
            other.contains("pictures are 200x200") && other.contains("calibrated at 320x240"),
            "{command}: {other}"
        );
    }
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        eprintln!("SKIPPED: ffmpeg is not installed");
        return;
    }
    let endless = "ffmpeg:-f lavfi -i testsrc2=size=64x48:rate=25";
    let ended = run(&["record", "--camera", endless, "--out", &out]).spawn().unwrap();
    let recorded = || Recording::open(dir.path().join("out").as_path()).map_or(0, |r| r.meta.frames.len());
    assert!(until(|| recorded() >= 20), "it does not begin");
    let ffmpeg = child_of(ended.id()).expect("ffmpeg is its child").to_string();
    assert!(Command::new("kill").args(["-9", &ffmpeg]).status().unwrap().success());
    let done = ended.wait_with_output().unwrap();
    let why = String::from_utf8_lossy(&done.stderr);
    assert!(!done.status.success() && why.contains("ffmpeg ended (signal: 9") && why.contains("shots, whole"), "{why}");
    assert!(recorded() >= 20);
}

#[test]
fn an_exposure_is_found_at_which_the_stripe_stands_right() {
    // Places all along the way: where a glint shines none is right, and it is the brightest that saturates nothing.
    let mut remarked = 0;
    for (at, exposure) in
        [0, 7, 11, 15, 16, 19, 23, 28, 32].into_iter().flat_map(|k| [60, 20000].map(|e| (f64::from(k) / 32.0, e)))
    {
        let camera = format!("sim:2?rate=20&still={at}&size=160x120&exposure_us={exposure}");
        let tuned: serde_json::Value =
            serde_json::from_str(&sheetlight(&["camera", "tune", "--camera", &camera, "--json", "--quiet"])).unwrap();
        let stripe = &tuned["look"]["stripe"];
        let peak = stripe["peak"].as_f64().unwrap();
        let remark = tuned["remark"].as_str();
        println!("at {at} from {exposure} us: {} us, peaks at {peak:.3}; {remark:?}", tuned["exposure_us"]);
        assert!(remark.map_or(0.70, |_| 0.5) <= peak && peak <= 0.85, "{tuned}");
        assert!(stripe["saturated"].as_f64().unwrap() <= 0.005, "{tuned}");
        remarked += u32::from(remark.is_some());
    }
    assert!((1..=4).contains(&remarked), "{remarked} of 18 are not right");
    // Nor does a folder: said before it waits for a picture.
    let said = sheetlight_fails(&["camera", "tune", "--camera", &format!("folder:{}", text(&scan_folder()))]).1;
    assert!(said.contains("has no ExposureTime"), "{said}");
    let said = sheetlight_fails(&["camera", "tune", "--camera", &format!("play:{}", text(&scan_folder()))]).1;
    assert!(said.contains("no ExposureTime"), "{said}");
}
