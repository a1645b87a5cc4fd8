//! In: the rendered part scans with their true calibration, whole and damaged. Out: judgement on the
//! insertion poses: right, or honestly refused; never a wrong pose that passes.
//! Frame and unit: base frame and part axes; mm, degrees.

use crate::common;
use crate::common::pose::{Off, truth};
use sheetlight::find::insert::recipe::InsertionSpec;
use sheetlight::find::{LocateOptions, Recipe, Report, locate, other_scale};
use sheetlight::geometry::{Base, Part, Rigid, Vec3};
use sheetlight::scan::{Along, CloudPoint, Shots};
use sheetlight::station::{lit_cloud_of, shots_of};
use std::path::PathBuf;

const PARTS: [&str; 4] = ["dimm", "led", "osc", "flash"];
/// The issue's limits with the true calibration.
const PLANE_MM: f64 = 0.05;
const HEIGHT_MM: f64 = 0.05;
const ANGLE_DEG: f64 = 0.15;

struct Scanned {
    part: &'static str,
    cloud: Vec<CloudPoint>,
    shots: Shots,
    truth: Rigid<Base, Part>,
    recipe: Recipe,
}

fn recipe(part: &str) -> Recipe {
    Recipe::load(&PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join(format!("data/recipes/{part}.toml")))
        .unwrap()
}

/// Scans every part of every rig with its true calibration, by the program itself.
fn scans(test: &str) -> Vec<Scanned> {
    let Some(reference) = common::reference(test) else { return vec![] };
    let mut out = Vec::new();
    for (inputs, truths) in common::rigs(&reference) {
        let work = tempfile::tempdir().unwrap();
        let station = work.path().join("station");
        let values = truths.join("scan_led/truth.json");
        common::sheetlight(&[
            "--quiet",
            "station",
            "import",
            values.to_str().unwrap(),
            "--station",
            station.to_str().unwrap(),
        ]);
        for part in PARTS {
            let (from, to) = (inputs.join(format!("scan_{part}")), work.path().join(part));
            common::sheetlight(&[
                "--quiet",
                "scan",
                from.to_str().unwrap(),
                "--station",
                station.to_str().unwrap(),
                "--out",
                to.to_str().unwrap(),
                "--overlays",
                "0",
                "--on",
                "cpu",
            ]);
            out.push(Scanned {
                part,
                cloud: lit_cloud_of(&to).unwrap(),
                shots: shots_of(&to).unwrap(),
                truth: truth(&truths.join(format!("scan_{part}"))),
                recipe: recipe(part),
            });
        }
    }
    out
}

/// Error in the plane, along z, and the angle; the half turn counts: the notch tells it.
fn error(report: &Report, truth: &Rigid<Base, Part>) -> (f64, f64, f64) {
    let off = Off::of(&report.base_from_part, truth);
    (off.in_plane(), off.in_height(), off.angle_deg)
}

/// A report that passed must be right within what insertion bears; returns whether it passed.
fn right_or_refused(what: &str, s: &Scanned, cloud: &[CloudPoint], truth: &Rigid<Base, Part>) -> bool {
    match locate(cloud, &s.shots, &s.recipe, None, &LocateOptions::default()) {
        Err(e) => {
            println!("{what} {}: refused: {}", s.part, e.what);
            assert!(!e.cause.is_empty() && !e.next.is_empty());
            false
        }
        Ok(r) => {
            let (plane, height, angle) = error(&r, truth);
            println!(
                "{what} {}: passed {}, {plane:.4} {height:.4} mm {angle:.4} degrees {:?}",
                s.part, r.passed, r.reasons
            );
            assert_eq!(r.passed, r.poses.is_some());
            if r.passed {
                assert!(plane < 0.2 && height < 0.1 && angle < 0.5, "{what} {}: a wrong pose passed", s.part);
            }
            r.passed
        }
    }
}

#[test]
fn the_four_parts_are_found_and_the_damaged_scans_are_never_wrong() {
    for s in scans("insertion poses") {
        let report = locate(&s.cloud, &s.shots, &s.recipe, None, &LocateOptions::default())
            .unwrap_or_else(|e| panic!("{}: {e}", s.part));
        let (plane, height, angle) = error(&report, &s.truth);
        println!(
            "{}: {plane:.4} mm in the plane, {height:.4} mm in height, {angle:.4} degrees; sigma {:.4?} mm {:.4?} \
             degrees; two pins against lattice {:?} mm",
            s.part, report.sigma_mm, report.sigma_deg, report.disagreement_mm
        );
        for n in &report.notes {
            println!("   {n}");
        }
        assert!(report.passed, "{}: {:?}", s.part, report.reasons);
        assert!(plane <= PLANE_MM, "{}: {plane:.4} mm in the plane, limit {PLANE_MM}", s.part);
        assert!(height <= HEIGHT_MM, "{}: {height:.4} mm in height, limit {HEIGHT_MM}", s.part);
        assert!(angle <= ANGLE_DEG, "{}: {angle:.4} degrees, limit {ANGLE_DEG}", s.part);

        // 30 % of the shots are gone.
        for seed in 0..3u32 {
            let kept =
                |p: &&CloudPoint| (p.shot + 1).wrapping_mul(2_654_435_761).wrapping_add(seed * 77_777_777) % 10 >= 3;
            let cloud: Vec<CloudPoint> = s.cloud.iter().filter(kept).copied().collect();
            right_or_refused("30 % of the shots gone", &s, &cloud, &s.truth);
        }
        let part_from_base = s.truth.inverse();
        let local = |p: &CloudPoint| part_from_base.point(&p.at());
        let lifted = |p: &CloudPoint, mm: f64| {
            let up = s.truth.direction(&Vec3::z()) * mm;
            let position: [f32; 3] = std::array::from_fn(|k| p.position[k] + up[k] as f32);
            CloudPoint { position: position.into(), ..*p }
        };
        // Half of the body was not seen, or lies under something that is 4 mm thick.
        for sign in [1.0, -1.0] {
            let cloud: Vec<CloudPoint> = s.cloud.iter().filter(|p| sign * local(p).x > 0.0).copied().collect();
            right_or_refused("half not seen", &s, &cloud, &s.truth);
            let cover =
                |p: &CloudPoint| if sign * local(p).x > 0.0 && local(p).y.abs() < 12.0 { lifted(p, 4.0) } else { *p };
            let cloud: Vec<CloudPoint> = s.cloud.iter().map(cover).collect();
            right_or_refused("half covered", &s, &cloud, &s.truth);
        }
        // A laser plane whose board was stated too small: where nothing is found, the scale is named.
        let nearer = |p: &CloudPoint| {
            let place = s.shots.place(p.shot).unwrap();
            p.moved_to(place.point(&(place.inverse().point(&p.at()) / 1.25)))
        };
        let cloud: Vec<CloudPoint> = s.cloud.iter().map(nearer).collect();
        right_or_refused("distances / 1.25", &s, &cloud, &s.truth);
        if let Err(e) = locate(&cloud, &s.shots, &s.recipe, None, &LocateOptions::default()) {
            let found = other_scale(&cloud, &s.shots, &s.recipe, &LocateOptions::default()).unwrap();
            println!("{}: {}: {found:?}", s.part, e.what);
            let found = found.unwrap_or_else(|| panic!("{}: no scale shows the part", s.part));
            assert!((found.factor / 1.25 - 1.0).abs() < 0.04 && found.score > 0.65, "{}: {found:?}", s.part);
        }
        // The board without the part: what rises from the board there is pressed flat.
        let board = match s.part {
            "dimm" => -9.0,
            "led" => -4.2,
            "osc" => -4.0,
            _ => -4.6,
        };
        let flat = |p: &CloudPoint| {
            let q = local(p);
            if q.x.abs() < 78.0 && q.y.abs() < 11.0 && q.z > board + 0.5 { lifted(p, board - q.z) } else { *p }
        };
        let cloud: Vec<CloudPoint> = s.cloud.iter().map(flat).collect();
        assert!(!right_or_refused("no part", &s, &cloud, &s.truth), "{}: found on an empty board", s.part);
        // The wrong part.
        for other in PARTS.iter().filter(|p| **p != s.part) {
            let wrong =
                Scanned { part: s.part, cloud: vec![], shots: s.shots.clone(), truth: s.truth, recipe: recipe(other) };
            if locate(&s.cloud, &s.shots, &wrong.recipe, None, &LocateOptions::default()).is_err() {
                let scale = other_scale(&s.cloud, &s.shots, &wrong.recipe, &LocateOptions::default()).unwrap();
                assert!(scale.is_none(), "{other} on {}: {scale:?}", s.part);
            }
            assert!(
                !right_or_refused(&format!("recipe {other} on"), &wrong, &s.cloud, &s.truth),
                "{other} found in {}",
                s.part
            );
        }
        // The whole board turned by half: the notch, the cut corner or the key tells.
        let turn: Rigid<Base, Base> = Rigid::from_vectors(&Vec3::new(0.0, 0.0, std::f64::consts::PI), Vec3::zeros());
        let turned = |p: &CloudPoint| {
            let q = turn.point(&p.at());
            CloudPoint { position: [q.x as f32, q.y as f32, q.z as f32].into(), ..*p }
        };
        let cloud: Vec<CloudPoint> = s.cloud.iter().map(turned).collect();
        let last = s.cloud.last().unwrap().shot;
        let places = (0..=last).filter_map(|k| Some((k, turn * *s.shots.place(k)?)));
        let truth = turn * s.truth;
        let s = Scanned { shots: Shots::new(s.shots.along, places), ..s };
        assert!(right_or_refused("turned by half", &s, &cloud, &truth), "{}: the turned part", s.part);
    }
}

#[test]
fn bad_recipes_and_empty_scans_are_refused_with_numbers() {
    let text = std::fs::read_to_string(
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/recipes/osc.toml"),
    )
    .unwrap();
    for (from, to, word) in [
        ("cell_mm = 0.5", "cell_mm = 0.5\ncolour = 3", "colour"),
        ("cell_mm = 0.5", "cell_mm = 50", "0 to 2.55"),
        ("of = [\"pin\"]", "of = [\"pen\"]", "pen"),
        ("grid = { count = [2, 2], pitch = [15.24, 7.62] }", "", "pin"),
        (
            "\"pin[2,2]\"]\n\n[[construction]]\nname = \"middle",
            "\"pin[3,2]\"]\n\n[[construction]]\nname = \"middle",
            "2 x 2",
        ),
        ("two_pin = \"two pins\"", "two_pin = \"three pins\"", "three pins"),
        ("tolerance_mm = 0.25", "tolerance_mm = -1", "tolerance_mm"),
    ] {
        assert!(text.contains(from), "{from}");
        let e = Recipe::parse(&text.replace(from, to)).expect_err(to);
        assert!(e.what.contains(word), "{to}: {}", e.what);
    }
    let lattice_of_one = text.replace("kind = \"lattice\"\nof = [\"pin\"]", "kind = \"lattice\"\nof = [\"body\"]");
    let lattice_of_one = lattice_of_one.replacen("[[shape]]\n", "[[shape]]\nname = \"body\"\n", 1);
    assert!(Recipe::parse(&lattice_of_one).unwrap_err().what.contains("at least 2"));
    let recipe = Recipe::parse(&text).unwrap();
    for n in [0usize, 30] {
        let cloud = vec![CloudPoint::default(); n];
        let e = locate(&cloud, &Shots::unplaced(Along::U), &recipe, None, &LocateOptions::default()).unwrap_err();
        assert!(e.what.contains(&format!("{n} points")) && e.what.contains("500"), "{}", e.what);
    }
}

#[test]
fn the_program_writes_report_and_picture_and_refuses_another_calibration() {
    let Some(reference) = common::reference("the find command") else { return };
    let (inputs, truths) = common::rigs(&reference).remove(0);
    let work = tempfile::tempdir().unwrap();
    let path = |name: &str| work.path().join(name).to_str().unwrap().to_owned();
    let values = truths.join("scan_led/truth.json");
    common::sheetlight(&["--quiet", "station", "import", values.to_str().unwrap(), "--station", &path("station")]);
    let from = inputs.join("scan_osc");
    common::sheetlight(&[
        "--quiet",
        "scan",
        from.to_str().unwrap(),
        "--station",
        &path("station"),
        "--out",
        &path("scan"),
        "--overlays",
        "0",
        "--on",
        "cpu",
    ]);
    let recipe = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/recipes/osc.toml");
    let find = |station: &str| {
        [
            "find",
            &path("scan"),
            "--recipe",
            recipe.to_str().unwrap(),
            "--out",
            &path("osc.json"),
            "--station",
            station,
            "--robot",
            "denso",
        ]
        .map(str::to_owned)
    };
    let said = common::sheetlight(&find(&path("station")).each_ref().map(String::as_str));
    println!("{said}");
    assert!(said.contains("insertion") && said.contains("RX deg") && said.contains("hand-eye"));
    let report: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path("osc.json")).unwrap()).unwrap();
    let pose: Rigid<Base, Part> =
        serde_json::from_value(report["poses"]["insertion"]["base_from_tool"].clone()).unwrap();
    let (angle, shift) = pose.difference(&truth(&truths.join("scan_osc")));
    assert!(shift < 0.07 && angle.to_degrees() < 0.2, "{shift} {angle}");
    assert!(std::fs::metadata(path("osc.png")).unwrap().len() > 1000);
    // The scorer of the reference data says the same.
    let estimate = work.path().join("estimate.json");
    let body = serde_json::json!({"sets": {"scan_osc": {"base_T_part": report["base_from_part"]}}});
    std::fs::write(&estimate, body.to_string()).unwrap();
    if let Some(score) = common::score(&reference, &estimate, &truths) {
        let insertion = ["scan_osc", "insertion", "lateral_mm"];
        assert!(common::figure(&score, &insertion) <= PLANE_MM);
    }
    // A station with other values must not read this scan.
    let mut other: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&values).unwrap()).unwrap();
    other["laser_plane_camera"]["offset_mm"] = serde_json::json!(73.0);
    std::fs::write(path("other.json"), other.to_string()).unwrap();
    common::sheetlight(&["--quiet", "station", "import", &path("other.json"), "--station", &path("another")]);
    let (code, talk) = common::sheetlight_fails(&find(&path("another")).each_ref().map(String::as_str));
    assert!(code == 1 && talk.contains("calibration"), "{talk}");
}

#[test]
fn a_part_is_taught_from_half_millimetre_numbers() {
    use sheetlight::find::insert::teach::{TeachOptions, teach};
    let Some(s) = scans("teaching").into_iter().find(|s| s.part == "osc") else { return };
    let map = sheetlight::scan::grid(&s.cloud, &sheetlight::scan::GridOptions::default()).unwrap();
    let grid_from_part = map.base_from_grid.inverse() * s.truth;
    let rough = |x: f64, y: f64| {
        let q = grid_from_part.point(&Vec3::new(x, y, 0.0));
        [(2.0 * q.x).round() / 2.0, (2.0 * q.y).round() / 2.0]
    };
    let (centre, hole) = (rough(0.0, 0.0), |x, y| rough(x, y));
    let rx = grid_from_part.rotation;
    let around = |hw: f64, hh: f64| [centre[0] - hw, centre[1] - hh, centre[0] + hw, centre[1] + hh];
    let holes = [(-7.62, -3.81), (7.62, -3.81), (-7.62, 3.81), (7.62, 3.81)].map(|(x, y)| hole(x, y));
    let options = TeachOptions {
        name: "taught".into(),
        outline: around(10.0, 6.5),
        angle_deg: rx[(1, 0)].atan2(rx[(0, 0)]).to_degrees().round(),
        windows: vec![around(5.0, 2.0)],
        holes: holes.map(|h| [h[0], h[1], 0.72]).to_vec(),
        insertion: InsertionSpec::at_the_part((0.25, 1.0), 30.0, 60.0),
    };
    let (recipe, proof) = teach(&s.cloud, &s.shots, &map, &options).unwrap();
    let again = Recipe::parse(&toml::to_string(&recipe).unwrap()).unwrap();
    assert_eq!(again, recipe);
    let size = recipe.shape[0].size.unwrap();
    println!(
        "taught body {size:.3?} for 20.4 x 12.8 mm, window {:.3?} for 10.4 x 4.4 mm",
        recipe.shape[1].size.unwrap()
    );
    // As seen: each side about 0.05 mm short of the true one, noise on top.
    assert!((size[0] - 20.3).abs() < 0.12 && (size[1] - 12.7).abs() < 0.12, "{size:?}");
    assert!(proof.passed, "{:?}", proof.reasons);
    let (plane, height, _) = error(&proof, &s.truth);
    assert!(plane < 0.15 && height < 0.05, "{plane} {height}");
    let outside = TeachOptions { outline: [-1.0, 0.0, 5.0, 5.0], ..options };
    assert!(teach(&s.cloud, &s.shots, &map, &outside).unwrap_err().what.contains("outline"));
}

#[test]
fn the_guide_walks_from_the_touched_board_to_the_retract_pose() {
    let work = tempfile::tempdir().unwrap();
    let path = |name: &str| work.path().join(name).to_str().unwrap().to_owned();
    // A relay socket on a board: a body with a window and a notch, seen by a simulated station.
    std::fs::write(path("scene.toml"), SCENE).unwrap();
    std::fs::write(path("relay.toml"), RELAY).unwrap();
    common::sheetlight(&[
        "--quiet",
        "simulate",
        "--out",
        &path("cell"),
        "--set",
        "scan,surface",
        "--scene",
        &path("scene.toml"),
        "--seed",
        "4",
        "--shots",
        "150",
    ]);
    let guide = |touch: &str, yes: bool| {
        let mut a = vec![
            "guide".into(),
            "--station".into(),
            path("cell/station"),
            "--touch".into(),
            path(touch),
            "--scan".into(),
            path("cell/scan"),
            "--recipe".into(),
            path("relay.toml"),
            "--out".into(),
            path("job"),
            "--robot".into(),
            "fanuc".into(),
            "--on".into(),
            "cpu".into(),
        ];
        a.extend(yes.then(|| "--yes".to_owned()));
        a
    };
    let args = guide("cell/surface", true);
    let said = common::sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>());
    println!("{said}");
    for word in
        ["1. touch", "normal", "2. look squarely", "3. scan", "4. find", "5. approach", "6. insert", "7. retract"]
    {
        assert!(said.contains(word), "{word}");
    }
    let log: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(path("job/guide.json")).unwrap()).unwrap();
    let truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(path("cell/scan/truth.json")).unwrap()).unwrap();
    let found: Rigid<Base, Part> = serde_json::from_value(log["report"]["base_from_part"].clone()).unwrap();
    let there: Rigid<Base, Part> = serde_json::from_value(truth["parts"][0]["base_T_part"].clone()).unwrap();
    let d = there.inverse() * found;
    println!("relay: {:.4?} mm, {:.4} degrees off", d.translation.as_slice(), d.rotation_vector().norm().to_degrees());
    assert!(d.translation.xy().norm() < 0.08 && d.translation.z.abs() < 0.05, "{:?}", d.translation);
    assert!(d.rotation_vector().norm().to_degrees() < 0.2);
    // Nobody there to answer: the first question ends it.
    let args = guide("cell/surface", false);
    let (code, talk) = common::sheetlight_fails(&args.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(code == 2 && talk.contains("--yes"), "{talk}");
}

const SCENE: &str = r#"
name = "relay socket on a board"
region_mm = [-30, -18, 30, 18]
focus_height_mm = 3.0
[[solid]]
shape = { block = { size_mm = [190, 104, 1.6] } }
at_mm = [0, 0, 0]
material = { albedo = 0.45 }
[[part]]
name = "relay"
at_mm = [3, -2, 4.2]
turn_deg = 7
[[part.solid]]
shape = { block = { size_mm = [30, 16, 4.2] } }
at_mm = [0, 0, 0]
material = { albedo = 0.5 }
[[part.solid.cut]]
shape = { block = { size_mm = [14, 7, 3] } }
at_mm = [0, 0, 0]
[[part.solid.cut]]
shape = { cylinder = { diameter_mm = 5, depth_mm = 3 } }
at_mm = [-15, 0, 0]
"#;

const RELAY: &str = r#"
format = 1
name = "relay"
cell_mm = 0.6
alike_turns = 2
[[shape]]
kind = "rectangle"
centre = [0, 0]
size = [30, 16]
[[shape]]
kind = "rectangle"
inside = "low"
centre = [0, 0]
size = [14, 7]
[[shape]]
kind = "circle"
inside = "low"
centre = [-15, 0]
radius = 2.5
[insertion]
approach_mm = 25
retract_mm = 50
tolerance_mm = 0.3
tolerance_deg = 0.5
"#;
