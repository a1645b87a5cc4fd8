//! In: a simulated cell with black plastic, a white label and solder; its camera and robot on their wires. Out: whether
//! exposures that are proposed, recorded and scanned show all materials, no less than the best single exposure; what
//! cannot be recorded with several exposures.
//! Frame and unit: base frame, the scene's frame, mm; us.

use super::robot::{Mover, cell};
use super::{json, scan_folder, text};
use crate::common::tries::{judged, tries};
use crate::common::wait::until;
use crate::common::{sheetlight, sheetlight_fails};
use sheetlight::capture::CameraUri;
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::read_cloud;
use sheetlight::simulate::SceneSpec;
use sheetlight_program::cell::Served;
use std::cell::{Cell, RefCell};
use std::collections::HashSet;
use std::path::Path;
use std::process::{Command, Stdio};

const SCENE: &str = include_str!("../../data/scenes/contrast.toml");
/// Where the stripe stands at the poses, y of the scene, mm.
const FROM: f64 = -14.0;
const STEP: f64 = 0.7;
const POSES: usize = 40;
/// Tops of the housing and of the label over the table, and the solder joints'.
const TOPS: [f64; 3] = [4.0, 4.1, 4.6];
/// The camera's exposure before, us.
const BEFORE: &str = "900";

/// A cell with the stripe on the scene alone, in the dark.
fn dark_cell() -> Served {
    // The cell draws other speckle for every picture, also at rest; a real camera at rest sees the same.
    let served = cell(|o| (o.scene, o.rig.sensor.speckle) = (SceneSpec::parse(SCENE).unwrap(), 0.0));
    let arm = sheetlight::arm::open(&served.robot_uri()).unwrap();
    arm.switch().unwrap().put(served.cell.options().outputs.room, false).unwrap();
    served
}

/// Motion of the flange, from where it stood at the beginning, that brings the middle of the picture and the stripe to
/// this y of the scene on the housing's top; mm in the base frame.
fn motion(served: &Served, start: &Rigid<Base, Flange>, station: &Path, y: f64) -> [f64; 3] {
    let sheet = Rig::load(station).unwrap().need_laser_plane().unwrap().value;
    let base_from_scene = served.cell.base_from_scene();
    let scene_from_camera = base_from_scene.inverse() * *start * served.cell.station().flange_from_camera;
    // Where the sheet meets the camera's axis.
    let met = Vec3::new(0.0, 0.0, sheet.offset / sheet.normal.z);
    let by = Vec3::new(0.0, y, TOPS[0]) - scene_from_camera.point(&met);
    (base_from_scene.rotation * by).into()
}

fn exposure(camera: &str) -> f64 {
    let mut camera = camera.parse::<CameraUri>().unwrap().open(None).unwrap();
    let features = camera.features().unwrap();
    features.iter().find(|f| f.name == "ExposureTime").unwrap().value.as_ref().unwrap().to_string().parse().unwrap()
}

/// Cells of half a millimetre of each material (black, label, solder) with a point that lies on it; the rms distance of
/// the label's points from its top, mm.
fn covered(cloud: &Path, served: &Served) -> ([usize; 3], f64) {
    let scene_from_base = served.cell.base_from_scene().inverse();
    let mut cells: [HashSet<[i64; 2]>; 3] = Default::default();
    let mut label = (0.0, 0.0);
    for p in read_cloud(&cloud.join("cloud.ply")).unwrap() {
        let at = scene_from_base.point(&p.at());
        let inside = |[x0, y0, x1, y1]: [f64; 4]| (x0..x1).contains(&at.x) && (y0..y1).contains(&at.y);
        let joint = |x: f64, y: f64| (at.x - x).hypot(at.y - y) < 0.6;
        let on_joint = [5.5, 10.5].iter().any(|x| [-6.0, 0.0, 6.0].iter().any(|y| joint(*x, *y)));
        let material = if on_joint {
            2
        } else if inside([-13.5, -6.5, -2.5, 6.5]) {
            1
        } else if inside([-13.5, -13.0, 3.0, -8.0]) || inside([-13.5, 8.0, 3.0, 13.0]) || inside([-1.0, -8.0, 3.0, 8.0])
        {
            0
        } else {
            continue;
        };
        if (at.z - TOPS[material]).abs() < 0.25 {
            if material == 1 {
                label = (label.0 + 1.0, label.1 + (at.z - TOPS[1]).powi(2));
            }
            cells[material].insert([(2.0 * at.x).floor() as i64, (2.0 * at.y).floor() as i64]);
        }
    }
    (cells.map(|c| c.len()), (label.1 / label.0).sqrt())
}

#[test]
fn exposures_that_tuning_proposes_are_recorded_and_show_all_materials() {
    let served = dark_cell();
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| text(&dir.path().join(name));
    let station = dir.path().join("station");
    std::fs::create_dir_all(&station).unwrap();
    served.cell.station().store(&station).unwrap();
    let (camera, robot) = (format!("cell://{}?rate=20", served.camera), served.robot_uri());
    let (start, mover) = (served.cell.reported(0.0), RefCell::new(Mover::new(&served)));
    sheetlight(&["camera", "set", "ExposureTime", BEFORE, "--camera", &camera]);
    // The stripe across table, black and label: where the black is measurable, the label is not yet saturated.
    mover.borrow_mut().by(motion(&served, &start, &station, 3.0), 20.0);
    let tuned = sheetlight(&["camera", "tune", "--camera", &camera, "--json"]);
    let tuned: serde_json::Value = serde_json::from_str(&tuned).unwrap();
    assert!(tuned["proposal"].is_null() && tuned["exposure_us"].is_number(), "{tuned}");
    assert_eq!(exposure(&camera), tuned["exposure_us"].as_f64().unwrap(), "what was tuned stays set");
    // Across two solder joints too: no single exposure suits, and the refusal names those that do.
    mover.borrow_mut().by(motion(&served, &start, &station, 0.0), 20.0);
    let (_, said) = sheetlight_fails(&["camera", "tune", "--camera", &camera, "--quiet"]);
    println!("{said}");
    let words = said.split("or record with --exposures ").nth(1).expect("a proposal").split_whitespace().next();
    let exposures: Vec<f64> = words.unwrap().split(',').map(|us| us.parse().unwrap()).collect();
    assert!((2..=4).contains(&exposures.len()) && said.contains("% of the stripe is saturated"), "{exposures:?}");
    sheetlight(&["camera", "set", "ExposureTime", BEFORE, "--camera", &camera]);
    let typed = exposures.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let name = Cell::new(0);
    let report = tries(3, || {
        name.set(name.get() + 1);
        let out = at(&format!("rec{}", name.get()));
        let way: Vec<_> = (0..POSES).map(|k| motion(&served, &start, &station, FROM + STEP * k as f64)).collect();
        recorded(&mut mover.borrow_mut(), &way, [&camera, &robot, &typed, &out])
    });
    let recording = dir.path().join(format!("rec{}", name.get()));
    assert_eq!(exposure(&camera).to_string(), BEFORE, "the exposure is set back");
    let opened = Recording::open(&recording).unwrap();
    assert_eq!(opened.meta.exposures_us, exposures, "what the camera says");
    assert_eq!(opened.meta.frames.len(), POSES);
    assert!(opened.meta.frames.iter().all(|f| f.longer.len() == exposures.len() - 1));
    println!("{report}");
    // All of them, and each one alone.
    let scan = |n: usize| {
        let (from, out) = (text(&recording), at(&format!("scan{n}")));
        let number = n.to_string();
        let alone: &[&str] = if n == 0 { &[] } else { &["--exposure", &number] };
        let args =
            ["scan", &from, "--station", &text(&station), "--out", &out, "--on", "cpu", "--overlays", "0", "--quiet"];
        sheetlight(&[&args[..], alone].concat());
        let scan = json(&Path::new(&out).join("scan.json"));
        (covered(Path::new(&out), &served), scan)
    };
    let ((merged, rms), figures) = scan(0);
    let alone: Vec<([usize; 3], f64)> = (1..=exposures.len()).map(|n| scan(n).0).collect();
    println!("cells of black, label and solder, rms on the label: merged {merged:?} {rms:.4}, alone {alone:?}");
    let stated = &figures["exposures"];
    assert_eq!(stated["exposures_us"], serde_json::json!(exposures), "{stated}");
    assert_eq!(stated["pictures"], serde_json::json!(POSES * exposures.len()), "{stated}");
    // On black beside a bright stripe a merged picture has fewer points than the longest exposure: the threshold's
    // window has the mean of light that the longest exposure cuts off (docs/scanning.md, Dark and shiny parts).
    for material in 0..3 {
        let best = alone.iter().map(|(cells, _)| cells[material]).max().unwrap();
        assert!(merged[material] as f64 >= 0.9 * best as f64, "material {material}: {merged:?} {alone:?}");
    }
    // Those that show the label unsaturated do not show all of the black, the longest saturates the label.
    let (shortest, longest) = (&alone[0], &alone[alone.len() - 1]);
    assert!(shortest.0[0] * 2 < merged[0] && merged.iter().all(|n| *n > 10), "{merged:?} {alone:?}");
    assert!(rms < longest.1, "{rms} {alone:?}");
}

/// The robot goes on once a pose is recorded; `way` has its places.
fn recorded(
    mover: &mut Mover,
    way: &[[f64; 3]],
    [camera, robot, exposures, out]: [&str; 4],
) -> Result<serde_json::Value, String> {
    let shots = POSES.to_string();
    mover.by(way[0], 20.0);
    let args = ["record", "--camera", camera, "--pair", "step", "--pose-stream", robot, "--exposures", exposures];
    let rest = ["--shots", &shots, "--seconds", "240", "--out", out, "--json"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
        .args([&args[..], &rest].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = || std::fs::read_to_string(Path::new(out).join("frames.jsonl")).map_or(0, |t| t.lines().count());
    let mut over = false;
    for (k, at) in way.iter().enumerate().skip(1) {
        until(|| {
            over = child.try_wait().unwrap().is_some();
            over || lines() >= k
        });
        if over {
            break;
        }
        mover.by(*at, 20.0);
    }
    let done = child.wait_with_output().unwrap();
    if !done.status.success() {
        return Err(String::from_utf8_lossy(&done.stderr).into_owned());
    }
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    judged(report.clone(), report["shots"] == POSES, report)
}

#[test]
fn what_does_not_stand_still_or_cannot_be_set_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let out = text(&dir.path().join("rec"));
    let refused = |args: &[&str], words: &[&str]| {
        let (code, said) = sheetlight_fails(&[&["record", "--out", &out, "--shots", "2"], args].concat());
        assert!(code == 2 && words.iter().all(|w| said.contains(w)), "{args:?}: {code} {said}");
        assert!(!Path::new(&out).join("meta.json").exists());
    };
    let three = ["--exposures", "300,2000,12000"];
    let with = |camera: &str, pair: &[&str], words: &[&str]| {
        refused(&[&["--camera", camera][..], &three, pair].concat(), words);
    };
    let sim = "sim:1?size=160x120";
    let still = format!("{sim}&still=0.5");
    with(&still, &["--pair", "clock", "--pose-stream", &still], &["--exposures and --pair clock", "stand still"]);
    with(&still, &["--pair", "count", "--counts-per-shot", "3"], &["--exposures and --pair count"]);
    with(&still, &[], &["--exposures and no pairing", "--pair step"]);
    with(sim, &["--pair", "given"], &["never stops", "stops=40"]);
    let play = format!("play:{}", scan_folder().display());
    with(&play, &["--pair", "given"], &["has no ExposureTime to set", "leave --exposures out"]);
    with(&still, &["--pair", "given", "--shows", "room"], &["--exposures is for the stripe"]);
    let exposures = |typed: &str, words: &[&str]| {
        refused(&["--camera", &still, "--pair", "given", "--exposures", typed], words);
    };
    exposures("2000,300", &["300 us after one of 2000 us", "from the shortest"]);
    exposures("300,300", &["300 us after one of 300 us"]);
    exposures("1,2,4,8,16", &["a bracket has 5 exposures, 2 to 4"]);
    exposures("300", &["a bracket has 1 exposures"]);
    exposures("8000,2000000", &["an exposure of 2000000 us, it can do 1 to 1000000 us"]);
    exposures("300,long", &["long"]);
}

/// A simulated station that stops: the pose comes with the picture, and with a stream of poses.
#[test]
fn a_simulated_station_that_stops_is_recorded_with_several_exposures_and_scanned() {
    tries(3, || {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| text(&dir.path().join(name));
        let sim = "sim:1?size=160x120&rate=60&stops=6&rest=1.5&speed=100";
        for (name, pair) in [("given", &["--pair", "given"][..]), ("step", &["--pair", "step", "--pose-stream", sim])] {
            let out = at(name);
            let args = ["record", "--camera", sim, "--exposures", "200,800,3200", "--shots", "3", "--seconds", "60"];
            let report = sheetlight(&[&args[..], pair, &["--out", &out, "--json"]].concat());
            let report: serde_json::Value = serde_json::from_str(&report).unwrap();
            judged((), report["shots"] == 3, &report)?;
            let recording = Recording::open(Path::new(&out)).unwrap();
            assert_eq!(recording.meta.exposures_us, [200.0, 800.0, 3200.0]);
            let poses = recording.poses(None).unwrap();
            let apart = poses.windows(2).map(|p| (p[1].translation - p[0].translation).norm());
            assert!(apart.clone().all(|mm| mm > 1.0), "{:?}", apart.collect::<Vec<_>>());
        }
        Ok(())
    });
}
