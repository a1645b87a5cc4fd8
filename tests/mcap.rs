//! In: simulated scans, their recordings and stations, and ones that do not belong together. Out: whether the MCAP file
//! made of a scan has its numbers, and whether what cannot be written is explained.
//! Frame and unit: base frame; mm in scans, metres in messages.

#[path = "common/mod.rs"]
mod common;
#[path = "mcap/live.rs"]
mod live;
#[path = "mcap/refused.rs"]
mod refused;
#[path = "mcap/wire.rs"]
mod wire;

use common::sheetlight as run;
use mcap::{MessageStream, Summary};
use sheetlight::geometry::{Camera, Rigid, Sensor, Vec3};
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{CloudPoint, read_cloud};
use sheetlight::station::shots_of;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;
use wire::{Wire, points};

/// A simulated recording (`scan`), its station (`station`) and its scan (`done`); all tests read it.
static MADE: LazyLock<TempDir> = LazyLock::new(|| made(40, 3));

fn made(shots: u32, seed: u32) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let [out, scan, station, done] = ["", "scan", "station", "done"].map(|n| text(&dir.path().join(n)));
    let (shots, seed) = (shots.to_string(), seed.to_string());
    run(&["simulate", "--out", &out, "--set", "scan", "--width", "320", "--shots", &shots, "--seed", &seed, "--quiet"]);
    run(&["scan", &scan, "--station", &station, "--out", &done, "--on", "cpu", "--overlays", "0", "--quiet"]);
    dir
}

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

fn at(name: &str) -> PathBuf {
    MADE.path().join(name)
}

/// The file that the program makes of the scan with these options, read whole; what it printed.
fn written(options: &[&str]) -> (Vec<u8>, serde_json::Value) {
    let dir = tempfile::tempdir().unwrap();
    let (done, out) = (text(&at("done")), text(&dir.path().join("scan.mcap")));
    let said = run(&[&["mcap", &done, "--out", &out, "--json"], options].concat());
    let bytes = std::fs::read(&out).unwrap();
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "nothing else is left");
    (bytes, serde_json::from_str(&said).unwrap())
}

struct Message {
    time: u64,
    data: Vec<u8>,
}

/// The messages of a file by topic, in order; schemas, encodings and checksums are looked at on the way.
fn messages(bytes: &[u8]) -> BTreeMap<String, Vec<Message>> {
    let mut all: BTreeMap<String, Vec<Message>> = BTreeMap::new();
    for message in MessageStream::new(bytes).unwrap() {
        let m = message.unwrap();
        let schema = m.channel.schema.as_ref().unwrap();
        assert_eq!((m.channel.message_encoding.as_str(), schema.encoding.as_str()), ("cdr", "ros2msg"));
        assert!(m.channel.metadata["offered_qos_profiles"].starts_with("- history: 1\n"));
        assert_eq!(m.publish_time, m.log_time);
        all.entry(m.channel.topic.clone()).or_default().push(Message { time: m.log_time, data: m.data.into_owned() });
    }
    all
}

/// The record of texts that a file has.
fn told(bytes: &[u8]) -> BTreeMap<String, String> {
    let summary = Summary::read(bytes).unwrap().unwrap();
    let index = summary.metadata_indexes.iter().find(|i| i.name == "sheetlight").unwrap();
    let start = index.offset as usize;
    let record = mcap::parse_record(mcap::records::op::METADATA, &bytes[start + 9..start + index.length as usize]);
    match record.unwrap() {
        mcap::records::Record::Metadata(m) => m.metadata,
        other => panic!("{other:?}"),
    }
}

/// Within one step of f32 of the millimetres in metres.
fn metres(read: f32, mm: f32) -> bool {
    let exact = (f64::from(mm) / 1000.0) as f32;
    read == exact || read == exact.next_up() || read == exact.next_down()
}

fn same(read: &[(CloudPoint, [f32; 4])], scanned: &[CloudPoint]) {
    assert_eq!(read.len(), scanned.len());
    for ((p, m), q) in read.iter().zip(scanned) {
        let mm = [q.position.x, q.position.y, q.position.z, q.sigma_mm];
        assert!(m.iter().zip(mm).all(|(m, mm)| metres(*m, mm)), "{m:?} m is not {mm:?} mm");
        let fields = |p: &CloudPoint| (p.intensity, p.quality, p.u, p.v, p.shot);
        assert_eq!(fields(p), fields(q));
    }
}

#[test]
fn a_scan_alone_becomes_profiles_a_cloud_and_places() {
    let (bytes, said) = written(&[]);
    let (all, cloud) = (messages(&bytes), read_cloud(&at("done/cloud.ply")).unwrap());
    let topics: Vec<&str> = all.keys().map(String::as_str).collect();
    assert_eq!(topics, ["/diagnostics", "/sheetlight/cloud", "/sheetlight/profile", "/tf", "/tf_static"]);
    let summary = Summary::read(&bytes).unwrap().unwrap();
    assert!(summary.stats.unwrap().message_count as usize == all.values().map(Vec::len).sum::<usize>());
    assert_eq!(&bytes[21..25], b"ros2", "the header's profile");

    same(&points(&all["/sheetlight/cloud"][0].data, "base"), &cloud);
    let by_shot: Vec<&[CloudPoint]> = cloud.chunk_by(|a, b| a.shot == b.shot).collect();
    let profiles = &all["/sheetlight/profile"];
    assert!(profiles.len() == by_shot.len() && profiles.len() > 20, "{} profiles", profiles.len());
    profiles.iter().zip(by_shot).for_each(|(m, shot)| same(&points(&m.data, "base"), shot));

    // Nothing states times: 10 shots a second from scan.json's own.
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(at("done/scan.json")).unwrap()).unwrap();
    let created: jiff::Timestamp = report["created"].as_str().unwrap().parse().unwrap();
    let shots = shots_of(&at("done")).unwrap();
    assert_eq!(all["/tf"].len(), shots.places().count());
    for ((shot, place), m) in shots.places().zip(&all["/tf"]) {
        let mut w = Wire::new(&m.data);
        assert_eq!(w.u32(), 1);
        let ns = w.header("base");
        assert_eq!((ns, m.time), (m.time, created.as_nanosecond() as u64 + 100_000_000 * u64::from(shot)));
        assert_eq!(w.string(), "camera");
        let (far, turn) = w.apart(&place);
        assert!(far < 1e-9 && turn < 1e-9, "shot {shot}: {far} mm, {turn} rad");
        w.end();
    }
    let told = told(&bytes);
    assert!(told["times_from"].starts_with("synthetic: no recording was given; shot 0 at "), "{told:?}");
    assert_eq!((told["times"].as_str(), said["times"].as_str()), ("synthetic", Some("synthetic")));
    assert_eq!(told["cloud_sha256"], report["files"]["cloud.ply"]);
}

#[test]
fn the_lasers_frame_lies_on_the_sheet_and_figures_are_those_of_the_scan() {
    let (bytes, _) = written(&["--no-cloud", "--frame", "base=base_link", "--frame", "camera=eye"]);
    let all = messages(&bytes);
    assert!(!all.contains_key("/sheetlight/cloud"));
    let mut w = Wire::new(&all["/tf_static"][0].data);
    assert_eq!(w.u32(), 1);
    w.header("eye");
    assert_eq!(w.string(), "laser");
    let laser: Rigid<Camera, Sensor> = w.rigid();
    let sheet = Rig::load(&at("station")).unwrap().need_laser_plane().unwrap().value;
    for p in [Vec3::zeros(), Vec3::new(90.0, 0.0, 0.0), Vec3::new(0.0, -40.0, 0.0)] {
        assert!(sheet.distance(&laser.point(&p)).abs() < 1e-9);
    }
    assert!(!points(&all["/sheetlight/profile"][0].data, "base_link").is_empty());
    let mut w = Wire::new(&all["/diagnostics"][0].data);
    w.header("");
    assert_eq!((w.u32(), w.u8()), (1, 0));
    assert_eq!(w.string(), "sheetlight: scan");
    let count = read_cloud(&at("done/cloud.ply")).unwrap().len();
    assert_eq!(w.string(), format!("{count} points in 40 shots"));
    w.string();
    let figures: BTreeMap<String, String> = (0..w.u32()).map(|_| (w.string(), w.string())).collect();
    assert_eq!(figures["points"], count.to_string());
    assert!(figures["median_sigma_mm"].parse::<f64>().unwrap() > 0.0);
}

#[test]
fn a_recording_and_a_station_add_pictures_cameras_and_the_flange() {
    let (recording, station) = (text(&at("scan")), text(&at("station")));
    let (bytes, said) = written(&["--recording", &recording, "--station", &station, "--pictures", "--rate", "20"]);
    let (all, opened) = (messages(&bytes), Recording::open(&at("scan")).unwrap());
    let rig = Rig::load(&at("station")).unwrap();
    assert!(said["times_from"].as_str().unwrap().contains("the recording states no times"));
    let pictures = &all["/sheetlight/picture"];
    assert_eq!((pictures.len(), all["/sheetlight/camera_info"].len()), (40, 40));
    for (i, m) in pictures.iter().enumerate() {
        let mut w = Wire::new(&m.data);
        w.header("camera");
        assert_eq!((w.u32(), w.u32(), w.string().as_str(), w.u8(), w.u32()), (240, 320, "mono8", 0, 320));
        let expected = opened.picture(opened.meta.frames[i].laser.as_ref().unwrap()).unwrap();
        assert!(w.bytes() == expected.to_u8(), "picture {i}");
        w.end();
    }
    let k = rig.need_camera().unwrap().value;
    let mut w = Wire::new(&all["/sheetlight/camera_info"][7].data);
    w.header("camera");
    assert_eq!((w.u32(), w.u32(), w.string().as_str()), (240, 320, "plumb_bob"));
    assert_eq!(w.u32(), 5);
    assert_eq!(w.f64s(5), k.distortion.0[..5]);
    assert_eq!(w.f64s(9), [k.fx, k.skew, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0]);
    assert_eq!(w.f64s(9), [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(w.f64s(12), [k.fx, k.skew, k.cx, 0.0, 0.0, k.fy, k.cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    assert_eq!([0; 6].map(|_: u32| w.u32()), [0; 6]);
    assert_eq!(w.u8(), 0);
    w.end();
    // The flange as it was reported, beside the camera as the points were made.
    let poses = opened.poses(None).unwrap();
    for (m, pose) in all["/tf"].iter().zip(&poses) {
        let mut w = Wire::new(&m.data);
        assert_eq!(w.u32(), 2);
        w.header("base");
        w.string();
        w.f64s(7);
        w.header("base");
        assert_eq!(w.string(), "flange");
        let (far, turn) = w.apart(pose);
        assert!(far < 1e-9 && turn < 1e-9);
    }
    let mut w = Wire::new(&all["/tf_static"][0].data);
    assert_eq!(w.u32(), 2);
    w.header("camera");
    w.string();
    w.f64s(7);
    w.header("flange");
    assert_eq!(w.string(), "camera_reported");
    let (far, turn) = w.apart(&rig.need_hand_eye().unwrap().value);
    assert!(far < 1e-9 && turn < 1e-9);
}

/// A copy of the recording whose frames have what a recorder writes.
fn taken(dir: &Path, device: bool) -> String {
    let mut meta: serde_json::Value = serde_json::from_slice(&std::fs::read(at("scan/meta.json")).unwrap()).unwrap();
    for (i, frame) in meta["frames"].as_array_mut().unwrap().iter_mut().enumerate() {
        let (begin, late) = (40_000_000 * i as u64, [900_000, 300_000, 700_000][i % 3]);
        let mut taken = serde_json::json!({"id": i, "host_ns": 1_700_000_000_000_000_000 + begin + late,
            "exposure_ns": 200_000});
        if device {
            taken["device_ns"] = (5_000 + begin).into();
        }
        frame["taken"] = taken;
    }
    for entry in std::fs::read_dir(at("scan")).unwrap().map(|e| e.unwrap()) {
        std::fs::copy(entry.path(), dir.join(entry.file_name())).unwrap();
    }
    std::fs::write(dir.join("meta.json"), meta.to_string()).unwrap();
    text(dir)
}

#[test]
fn times_that_a_recording_states_are_the_messages_times() {
    for device in [true, false] {
        let dir = tempfile::tempdir().unwrap();
        let (bytes, said) = written(&["--recording", &taken(dir.path(), device), "--no-cloud"]);
        let (source, all) = (if device { "exposure" } else { "arrival" }, messages(&bytes));
        assert_eq!(said["times"], source);
        for (i, m) in all["/tf"].iter().enumerate() {
            let begin = 1_700_000_000_000_000_000 + 40_000_000 * i as u64;
            // The quickest picture came 0.1 ms after its exposure of 0.2 ms.
            let late = if device { 100_000 } else { [700_000, 100_000, 500_000][i % 3] };
            assert_eq!(m.time, begin + late, "{source} {i}");
        }
        assert!(told(&bytes)["times_from"].starts_with(source));
    }
}
