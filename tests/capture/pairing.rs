//! In: pictures of a part that is passed to and fro, their times late by a known delay; streams of poses with gaps,
//! jumps, clocks that run backwards and wrong units. Out: the delay found, the cloud as good as the still one;
//! excluded shots listed, never extrapolated.
//! Frame and unit: base frame, mm; ms.

use super::{json, scan_folder, text};
use crate::common::sheetlight;
use crate::common::tries::{judged, tries};
use sheetlight::capture::pair::{Counting, PoseFeed, Sample, Still, Table, Way};
use sheetlight::capture::record::{Recorder, RecorderOptions, record};
use sheetlight::capture::{
    Event, Feed, FeedOptions, Format, Picture, PictureSource, RoundTrip, Stream, Streamed, now_ns,
};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use sheetlight::raster::Image;
use sheetlight::recording::{Motion, Recording, Stand, load_poses, save_poses};
use sheetlight::scan::read_cloud;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

const MS: u64 = 1_000_000;

/// Pictures with the device's times that they are to have; its clock is the host's.
struct Prepared {
    pictures: Vec<(Image, u64)>,
    next: usize,
    /// From the begin of an exposure to the picture's last byte.
    under_way: u64,
}

impl PictureSource for Prepared {
    fn format(&self) -> Format {
        Format::of(&self.pictures[0].0)
    }
    fn next(&mut self, _: Duration) -> Event {
        let Some((image, ns)) = self.pictures.get(self.next).cloned() else { return Event::Ended };
        self.next += 1;
        let (id, device_ns) = (self.next as u64, Some(ns));
        let (host_ns, exposure_ns) = (ns + self.under_way, Some(MS));
        Event::Picture(Box::new(Picture {
            image,
            id,
            device_ns,
            host_ns,
            exposure_ns,
            count: None,
            stand: None,
            profiles: None,
        }))
    }
    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        Ok(Some(RoundTrip { before_ns: BEGUN, there_ns: BEGUN, after_ns: BEGUN }))
    }
    fn waits(&self) -> bool {
        true
    }
    fn name(&self) -> String {
        "prepared".into()
    }
}

const BEGUN: u64 = 1_700_000_000_000_000_000;

fn stream(pictures: Vec<(Image, u64)>, way: Way) -> Stream {
    arriving(pictures, 3 * MS, way)
}

fn arriving(pictures: Vec<(Image, u64)>, under_way: u64, way: Way) -> Stream {
    let source = Prepared { pictures, next: 0, under_way };
    Stream::new(Feed::start(Box::new(source), FeedOptions::default()).unwrap(), way)
}

fn plain(n: u64, step_ns: u64) -> Vec<(Image, u64)> {
    (0..n).map(|k| (Image::from_u8(4, 4, vec![9; 16]), BEGUN + k * step_ns)).collect()
}

/// What comes of each picture: paired, or why not.
fn outcomes(mut stream: Stream) -> (Vec<u64>, Vec<(u64, String)>) {
    let mut paired = Vec::new();
    loop {
        match stream.next(Duration::from_millis(500)) {
            Streamed::Shot(shot) => {
                stream.fate(sheetlight::capture::Fate::Used);
                paired.push(shot.picture.id);
            }
            Streamed::Quiet => {}
            Streamed::Ended(_) => break,
        }
    }
    assert_eq!(stream.account().unexplained(), 0, "{}", stream.account());
    (paired, stream.left_out().iter().map(|l| (l.id, l.why.clone())).collect())
}

fn pose(x: f64) -> Stand {
    Stand::Robot(Rigid::from_vectors(&Vec3::new(3.1, 0.0, 0.0), Vec3::new(400.0 + x, 10.0, 300.0)))
}

/// 20 mm/s, every 8 ms for 2 s, changed by `change`.
fn samples(change: impl Fn(u64, &mut Sample) -> bool) -> Vec<Sample> {
    let sample = |k: u64| Sample { ns: BEGUN + k * 8 * MS, sigma_ns: 0.0, stand: pose(0.16 * k as f64) };
    (0..250).filter_map(|k| Some((k, sample(k))).and_then(|(k, mut s)| change(k, &mut s).then_some(s))).collect()
}

fn by_clock(samples: Vec<Sample>) -> (Vec<u64>, Vec<(u64, String)>) {
    let way = Way::Clock { poses: PoseFeed::of(samples), delay_ns: 0.0, delay_sigma_ns: 0.0 };
    outcomes(stream(plain(100, 20 * MS), way))
}

#[test]
fn nothing_is_extrapolated_over_gaps_jumps_and_clocks_that_run_backwards() {
    // Pictures 1 to 100 begin at 0, 20, 40 ... ms and are exposed for 1 ms; poses reach from 0 to 1992 ms.
    let (paired, left) = by_clock(samples(|_, _| true));
    assert_eq!((paired.len(), left.len()), (100, 0), "{left:?}");
    let (paired, left) = by_clock(samples(|k, _| !(100..=125).contains(&k) && k < 200));
    // Poses are missing between 792 and 1008 ms, and after 1592 ms.
    let gap: Vec<u64> = (41..=51).collect();
    let late: Vec<u64> = (81..=100).collect();
    let out: Vec<u64> = left.iter().map(|l| l.0).collect();
    assert_eq!(out, [gap.clone(), late].concat());
    assert!(left[0].1.contains("a gap of 216.0 ms") && left.last().unwrap().1.contains("extrapolated"), "{left:?}");
    assert_eq!(paired.len() + left.len(), 100);
    let (_, left) = by_clock(samples(|k, s| {
        if k >= 100 {
            s.stand = pose(0.16 * k as f64 + 4.0);
        }
        true
    }));
    // The step from 792 to 800 ms: no picture's middle (0.5 ms after 780, 800) lies in it.
    assert!(left.is_empty(), "{left:?}");
    let (_, left) = by_clock(samples(|k, s| {
        if k >= 101 {
            s.stand = pose(0.16 * k as f64 + 4.0);
        }
        true
    }));
    assert!(left.len() == 1 && left[0].0 == 41 && left[0].1.contains("jump by"), "{left:?}");
    let (paired, left) = by_clock(samples(|k, s| {
        if k >= 125 {
            s.ns -= 50 * MS;
        }
        true
    }));
    assert!(
        !left.is_empty() && left.iter().all(|l| l.1.contains("backwards") || l.1.contains("extrapolated")),
        "{left:?}"
    );
    assert_eq!(paired.len() + left.len(), 100);
}

/// Sends poses every 8 ms, on a line each, until so many lines stand in a file; then closes in the middle of a line.
fn send(listener: &std::net::TcpListener, head: &str, scales: [f64; 2], until: (&Path, usize)) {
    let (mut to, _) = listener.accept().unwrap();
    to.write_all(head.as_bytes()).unwrap();
    let begun = std::time::Instant::now();
    let written = || std::fs::read_to_string(until.0).map_or(0, |frames| frames.lines().count());
    while written() < until.1 {
        let t = begun.elapsed().as_nanos() as f64;
        let [scale, t_scale] = scales;
        let x = (400.0 + 20e-9 * t) * scale;
        let line = format!("{} {x:.6} {} {} 180 0 90\n", (t * t_scale) as u64, 10.0 * scale, 300.0 * scale);
        if to.write_all(line.as_bytes()).is_err() {
            return;
        }
        std::thread::sleep(Duration::from_millis(8));
    }
    let _ = to.write_all(b"99999999999 400.1");
}

#[test]
fn lines_on_a_socket_are_read_and_wrong_units_end_the_run() {
    for (head, scales, says) in [
        ("# convention: denso\n# clock: own\n", [1.0, 1.0], ""),
        ("# convention: denso\n# clock: own\n", [1e-3, 1.0], "metres"),
        ("# convention: denso\n# clock: own\n", [1.0, 1e-6], "milliseconds"),
    ] {
        // Poses that a machine which stands still sends or takes late tell little.
        tries(5, || {
            let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
            let poses = format!("tcp://{}", listener.local_addr().unwrap());
            let dir = tempfile::tempdir().unwrap();
            let out = dir.path().join("rec");
            let frames = out.join("frames.jsonl");
            let sender = std::thread::spawn(move || send(&listener, head, scales, (&frames, 12)));
            let camera = format!("play:{}?rate=20&loops=1000", text(&scan_folder()));
            // More pictures than are recorded until the poses end.
            let run = std::process::Command::new(env!("CARGO_BIN_EXE_sheetlight"))
                .args(["record", "--camera", &camera, "--pair", "clock", "--pose-stream", &poses])
                .args(["--shots", "50", "--out", &text(&out)])
                .output()
                .unwrap();
            sender.join().unwrap();
            let said = String::from_utf8_lossy(&run.stderr).into_owned();
            if !says.is_empty() {
                return judged((), !run.status.success() && said.contains(says), format!("{says}: {said}"));
            }
            judged((), run.status.success() && said.contains("in the middle of a line"), &said)?;
            let (recording, left) = (Recording::open(&out).unwrap(), json(&out.join("left_out.json")));
            let extrapolated = |l: &serde_json::Value| l["why"].as_str().unwrap().contains("extrapolated");
            let shots = recording.meta.frames.len();
            let some = shots > 10 && left.as_array().unwrap().iter().any(extrapolated);
            judged((), some, format!("{shots} shots\n{said}\n{left}"))?;
            let taken = recording.meta.frames[5].taken.as_ref().unwrap();
            judged((), taken.time_sigma_ns.unwrap() < 5e6 && taken.rate.is_some(), format!("{taken:?}"))
        });
    }
}

#[test]
fn still_is_still_and_numbers_are_not_made_up() {
    let moving = Way::Step(PoseFeed::of(samples(|_, _| true)), Still::default());
    let (paired, left) = outcomes(stream(plain(50, 20 * MS), moving));
    assert!(paired.is_empty() && left[5].1.contains("moved by"), "{left:?}");
    let still = Way::Step(
        PoseFeed::of(samples(|_, s| {
            s.stand = pose(0.0);
            true
        })),
        Still::default(),
    );
    // The first two have no pose before them.
    assert_eq!(outcomes(stream(plain(50, 20 * MS), still)).0, (3..=50).collect::<Vec<_>>());
    // It moves from 1000 ms on. Pictures that are long under way were exposed before.
    let moves_on = Way::Step(
        PoseFeed::of(samples(|k, s| {
            s.stand = pose(0.16 * k.saturating_sub(125) as f64);
            true
        })),
        Still::default(),
    );
    assert_eq!(outcomes(arriving(plain(90, 20 * MS), 80 * MS, moves_on)).0, (3..=49).collect::<Vec<_>>());
    let table = Table::Rows((0..30).map(|k| (k != 7).then(|| pose(f64::from(k)))).collect());
    let (paired, left) = outcomes(stream(plain(32, 20 * MS), Way::Count(Counting::new(table))));
    assert_eq!((paired.len(), left.iter().map(|l| l.0).collect::<Vec<_>>()), (29, vec![8, 31, 32]));
    assert!(left[0].1.contains("nothing is known of number 7") && left[1].1.contains("end at 30"), "{left:?}");
}

/// Five pictures, an outage, five more: its numbers begin anew, and where it had no power its clock and its counter do.
struct Cut {
    power: bool,
    taken: u64,
    gone: bool,
}

impl Cut {
    fn clock_ns(&self) -> u64 {
        let begun_ns = if self.gone && !self.power { 3_600_000 * MS } else { 0 };
        now_ns() - BEGUN - begun_ns
    }
}

impl PictureSource for Cut {
    fn format(&self) -> Format {
        Format { width: 1, height: 1, bits: 8 }
    }
    fn next(&mut self, _: Duration) -> Event {
        if self.taken == 5 && !self.gone {
            return Event::Lost(Fault::input("the cable is out").next("plug it in"));
        }
        if self.taken == 10 {
            return Event::Ended;
        }
        let k = self.taken;
        self.taken += 1;
        let id = 1 + k % 5;
        let count = Some(if self.power { 100 + 20 * k } else { 20 * (k % 5) } as i64);
        let (device_ns, host_ns) = (Some(self.clock_ns()), now_ns());
        let image = Image::from_u8(1, 1, vec![k as u8]);
        Event::Picture(Box::new(Picture {
            image,
            id,
            device_ns,
            host_ns,
            exposure_ns: None,
            count,
            stand: None,
            profiles: None,
        }))
    }
    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        let before_ns = now_ns();
        Ok(Some(RoundTrip { before_ns, there_ns: self.clock_ns(), after_ns: now_ns() }))
    }
    fn waits(&self) -> bool {
        true
    }
    fn reopens(&self) -> bool {
        true
    }
    fn reopen(&mut self) -> Result<()> {
        self.gone = true;
        Ok(())
    }
    fn name(&self) -> String {
        "cut".into()
    }
}

#[test]
fn after_an_outage_numbers_pair_nothing_and_a_counter_only_where_it_had_power() {
    let rows = || Table::Rows((0..30).map(|k| Some(pose(f64::from(k)))).collect());
    for (table, power, used) in [
        (rows(), true, 5),
        (Table::Pulses(20.0), true, 5),
        (Table::Chunk, true, 10),
        (rows(), false, 5),
        (Table::Pulses(20.0), false, 5),
        (Table::Chunk, false, 5),
    ] {
        let feed = Feed::start(Box::new(Cut { power, taken: 0, gone: false }), FeedOptions::default()).unwrap();
        let mut stream = Stream::new(feed, Way::Count(Counting::new(table.clone())));
        let (mut said, mut shots) = (Vec::new(), Vec::new());
        loop {
            match stream.next(Duration::from_millis(500)) {
                Streamed::Shot(shot) => {
                    stream.fate(sheetlight::capture::Fate::Used);
                    shots.push((shot.picture.image.get(0, 0), shot.stand.unwrap()));
                }
                Streamed::Quiet => {}
                Streamed::Ended(fault) => break assert!(fault.is_none()),
            }
            said.extend(stream.news());
        }
        said.extend(stream.news());
        let a = stream.account();
        assert_eq!((a.used, a.unpaired, a.outages, a.unexplained()), (used, 10 - used, 1, 0), "{table:?}: {a}");
        for (k, stand) in shots {
            let k = f64::from(k);
            let want = match table {
                Table::Rows(_) => pose(k),
                Table::Pulses(_) => Stand::Count(20.0 * k),
                Table::Chunk if power => Stand::Count(100.0 + 20.0 * k),
                Table::Chunk => Stand::Count(20.0 * k),
            };
            assert_eq!(stand, want, "{table:?}, picture {k}");
        }
        let left = said.iter().filter(|s| s.contains("are excluded")).count();
        assert_eq!(left, usize::from(used < 10), "{table:?}: {said:?}");
    }
}

/// A block with a wedge, rising along the motion and falling across it.
const SCENE: &str = "name = 'wedges'\nregion_mm = [-15, -9, 15, 9]\n\
    [[solid]]\nshape = { block = { size_mm = [60, 60, 5] } }\nat_mm = [0, 0, 0]\n\
    [[solid]]\nshape = { wedge = { size_mm = [12, 12, 9], drop_mm = 7 } }\nat_mm = [-6, 0, 7]\nturn_deg = 70\n\
    [[solid]]\nshape = { wedge = { size_mm = [12, 12, 9], drop_mm = 7 } }\nat_mm = [7, 0, 7]\nturn_deg = 250\n";

#[test]
fn a_delay_of_the_camera_is_found_stored_and_applied() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("wedges.toml"), SCENE).unwrap();
    let scene = text(&at("wedges.toml"));
    let first = text(&at("first"));
    let common = ["--width", "320", "--scene", &scene, "--seed", "4", "--quiet"];
    sheetlight(&[&["simulate", "--out", &first, "--shots", "2"][..], &common].concat());
    let ends = load_poses(&at("first/scan/poses.json")).unwrap().poses;
    // There and back at 20 mm/s, a picture every 12 ms, half a step apart.
    let way = ends[1].translation - ends[0].translation;
    let pose_at = |s: f64| -> Rigid<Base, Flange> { Rigid::new(ends[0].rotation, ends[0].translation + way * s) };
    let length = way.norm();
    let seconds = length / 20.0;
    let place = |t: f64| pose_at(if t < seconds { t / seconds } else { (2.0 - t / seconds).max(0.0) });
    let period = 0.012;
    let shots = (2.0 * seconds / period) as u64;
    let times: Vec<f64> = (0..shots).map(|k| (k as f64 + 0.3) * period).collect();
    save_poses(&at("passed.json"), &times.iter().map(|t| place(*t)).collect::<Vec<_>>()).unwrap();
    let (made, passed) = (text(&at("made")), text(&at("passed.json")));
    sheetlight(&[&["simulate", "--out", &made, "--poses", &passed][..], &common].concat());
    // What the camera says comes 3.7 ms late; poses are told every 8 ms, as they are.
    let still = Recording::open(&at("made/scan")).unwrap();
    let late = 3_700_000u64;
    let middle = |t: f64| BEGUN + ((0.1 + t) * 1e9) as u64;
    let names = still.meta.frames.iter().filter_map(|f| f.laser.clone());
    let pictures: Vec<_> =
        names.zip(&times).map(|(n, t)| (still.picture(&n).unwrap(), middle(*t) - MS / 2 + late)).collect();
    let told = (-10..(2.0 * seconds / 0.008) as i64 + 10).map(|k| {
        let t = k as f64 * 0.008;
        Sample { ns: middle(t), sigma_ns: 0.0, stand: Stand::Robot(place(t.max(0.0))) }
    });
    let way = Way::Clock { poses: PoseFeed::of(told), delay_ns: 0.0, delay_sigma_ns: 0.0 };
    let mut stream = stream(pictures, way);
    let options = RecorderOptions { set: "scan".into(), motion: Some(Motion::default()), ..RecorderOptions::default() };
    let recorder = Recorder::create(&at("live"), stream.format(), options).unwrap();
    let report = record(&mut stream, recorder, None, |_, _| {}).unwrap();
    assert!(report.shots as u64 >= shots - 3, "{} of {shots}: {:?}", report.shots, report.left_out);
    let (live, station) = (text(&at("live")), text(&at("made/station")));
    let found: serde_json::Value = serde_json::from_str(&sheetlight(&[
        "calibrate",
        "latency",
        &live,
        "--station",
        &station,
        "--on",
        "cpu",
        "--json",
    ]))
    .unwrap();
    let (delay, sigma) =
        (found["latency"]["delay_ms"].as_f64().unwrap(), found["latency"]["sigma_ms"].as_f64().unwrap());
    println!("a delay of 3.7 ms at 20 mm/s: {delay:.4} ms, sigma {sigma:.4} ms, {} shots", report.shots);
    assert!((delay - 3.7).abs() < 0.1, "{delay} {sigma}");
    assert!((delay - 3.7).abs() < 4.0 * sigma, "{delay} {sigma}");
    // Applied, the cloud is as good as the still one; without, it is not.
    let scan = |recording: &str, out: &str, station: &str| {
        let out = at(out);
        let (from, to) = (text(&at(recording)), text(&out));
        let truth = text(&at("made/scan/truth.json"));
        let args = ["scan", &from, "--station", station, "--out", &to, "--on", "cpu", "--overlays", "0"];
        sheetlight(&[&args[..], &["--truth", &truth, "--quiet"]].concat());
        let cloud = read_cloud(&out.join("cloud.ply")).unwrap();
        (json(&out.join("errors.json")), cloud)
    };
    let rms = |errors: &serde_json::Value| errors["cloud"]["rms_without_outliers_mm"].as_f64().unwrap();
    let (want, _) = scan("made/scan", "still scan", &station);
    let (is, cloud) = scan("live", "live scan", &station);
    std::fs::remove_file(at("made/station/calibration/latency.json")).unwrap();
    let (without, before) = scan("live", "late scan", &station);
    println!("rms: still {:.4} mm, delay applied {:.4} mm, not applied {:.4} mm", rms(&want), rms(&is), rms(&without));
    assert!(rms(&is) < 1.05 * rms(&want), "{} {}", rms(&is), rms(&want));
    assert!(rms(&without) > 1.05 * rms(&want), "the delay shows: {} {}", rms(&without), rms(&want));
    // What is not known of the delay is in every point's sigma: 20 mm/s times sigma.
    let sigma_of =
        |c: &[sheetlight::scan::CloudPoint]| c.iter().map(|p| f64::from(p.sigma_mm)).fold(f64::MAX, f64::min);
    assert!(sigma_of(&cloud) > 0.9 * 20.0 * 1e-3 * sigma && sigma_of(&before) > 0.0);
}
