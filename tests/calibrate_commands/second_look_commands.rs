//! In: a simulated station whose calibrations know their uncertainty, a part seen from where `second-look` sends the
//! robot.
//! Out: `find A B` and `second-look` as a user runs them: exit codes, JSON, and what they say of looks that are none.
//! Frame and unit: base frame, part axes; mm, degrees.

use crate::common::pose::Off;
use crate::common::{figure, sheetlight, sheetlight_fails};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use sheetlight::geometry::{Base, Part, Rigid, Vec3};
use sheetlight::recording::save_poses;
use sheetlight::rig::{Covariance, Rig};
use sheetlight::simulate::{Station, above, base_from_scene};
use std::path::{Path, PathBuf};

/// The LED socket of data/scenes/board.toml on its board, balls at its ends; {x} {y} in scene mm.
fn scene(x: f64, y: f64) -> String {
    let balls: String = [(21.5, -7.0), (22.0, 4.0), (-21.5, -5.0), (-22.0, 6.0)]
        .iter()
        .map(|(x, y)| {
            format!(
                "[[solid]]\nshape = {{ ball = {{ diameter_mm = 9 }} }}\nat_mm = [{x}, {y}, \
                               7]\nmaterial = {{ albedo = 0.6 }}\n"
            )
        })
        .collect();
    format!(
        "name = 'led'\nregion_mm = [-27, -13, 27, 13]\nfocus_height_mm = 2.0\n\
         [[solid]]\nshape = {{ block = {{ size_mm = [190, 104, 1.6] }} }}\nat_mm = [0, 0, 0]\n\
         material = {{ albedo = 0.45 }}\n\
         [[part]]\nname = 'led'\nat_mm = [{x}, {y}, 4.2]\nturn_deg = 3\n\
         [[part.solid]]\nshape = {{ block = {{ size_mm = [30.48, 17.78, 4.2] }} }}\nat_mm = [0, 0, 0]\n\
         material = {{ albedo = 0.5 }}\n\
         [[part.solid.cut]]\nshape = {{ cone = {{ top_mm = 1.44, bottom_mm = 0.84, depth_mm = 2.5 }} }}\n\
         repeat = [12, 2]\npitch_mm = [2.54, 15.24]\n\
         [[part.solid.cut]]\nshape = {{ block = {{ size_mm = [11.04, 12.4, 9] }} }}\nrepeat = [2, 1]\n\
         pitch_mm = [14.24, 0]\n\
         [[part.solid.cut]]\nshape = {{ cylinder = {{ diameter_mm = 3, depth_mm = 9 }} }}\nat_mm = [-15.24, 0, \
         0]\n{balls}"
    )
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// A folder in which one seed's station is simulated, scanned with and asked.
struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Bench {
        let bench = Bench { dir: tempfile::tempdir().unwrap() };
        std::fs::write(bench.at("here.toml"), scene(0.0, 0.0)).unwrap();
        let led = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../data/recipes/led.toml")).unwrap();
        std::fs::write(bench.at("led.toml"), &led).unwrap();
        std::fs::write(bench.at("strict.toml"), led + "\n[gates]\nsecond_look = true\n").unwrap();
        bench
    }
    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
    fn args(&self, args: &str) -> Vec<String> {
        // Names with a slash or a file's ending lie in the folder.
        let here =
            |a: &str| if a.contains(['/', '.']) { self.at(a).to_str().unwrap().to_owned() } else { a.to_owned() };
        ["--quiet"].into_iter().chain(args.split(' ')).map(here).collect()
    }
    fn run(&self, args: &str) -> String {
        let args = self.args(args);
        sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>())
    }
    fn fails(&self, args: &str) -> (i32, String) {
        let args = self.args(args);
        let (code, said) = sheetlight_fails(&args.iter().map(String::as_str).collect::<Vec<_>>());
        println!("{code}: {said}");
        (code, said)
    }
    fn simulate(&self, more: &str) {
        self.run(&format!("simulate --seed 3 {more}"));
    }
    fn scan(&self, recording: &str, out: &str) {
        self.run(&format!("scan {recording} --station ./station --out {out} --overlays 0 --on cpu"));
    }
}

/// What a good calibration knows of itself: laser plane to 0.015 mm and 0.1 mrad, hand-eye to 0.03 mm and 0.15 mrad.
fn state_uncertainty(station: &Path) {
    let mut rig = Rig::load(station).unwrap();
    let names = ["tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"];
    let sigmas = DVector::from_vec(vec![0.03, 0.03, 0.03, 1.5e-4, 1.5e-4, 1.5e-4]);
    rig.hand_eye.as_mut().unwrap().covariance =
        Covariance::new(&names, &DMatrix::from_diagonal(&sigmas.map(|s| s * s)));
    let figures = &mut rig.hand_eye.as_mut().unwrap().quality.figures;
    figures.insert("robot_sigma_mm".into(), 0.005);
    figures.insert("robot_sigma_deg".into(), 0.001);
    let plane = rig.laser_plane.as_mut().unwrap();
    let n = plane.value.normal;
    let tangent = (sheetlight::geometry::Mat3::identity() - n * n.transpose()) * 1e-4;
    let mut j = DMatrix::zeros(4, 4);
    j.view_mut((0, 0), (3, 3)).copy_from(&tangent);
    // The plane turns about the working distance.
    j.view_mut((3, 0), (1, 3)).copy_from(&(Vec3::new(0.0, 0.0, 155.0).transpose() * tangent));
    j[(3, 3)] = 0.015;
    plane.covariance = Covariance::new(&["nx", "ny", "nz", "offset_mm"], &(&j * j.transpose()));
    let beam = DVector::from_vec(vec![0.02, 0.02, 0.02, 1.5e-4, 1.5e-4, 1.5e-4]);
    let names = ["ox_mm", "oy_mm", "oz_mm", "dx", "dy", "dz"];
    rig.pointer.as_mut().unwrap().covariance = Covariance::new(&names, &DMatrix::from_diagonal(&beam.map(|s| s * s)));
    rig.store_all(station).unwrap();
}

/// Where the robot stands for the pointer's spot on plain places of the part's top: between the windows and at the
/// ends.
fn spots(out: &Path) {
    let station = Station::random(3);
    let (ray, turn) = (station.pointer.ray(), 3f64.to_radians());
    let places = [[0.0, 0.0], [13.9, 4.5], [13.9, -4.5], [-13.9, 4.5], [-13.9, -4.5], [-6.0, 8.4]];
    let poses: Vec<_> = places
        .iter()
        .map(|[x, y]| {
            let (x, y) = (turn.cos() * x - turn.sin() * y, turn.sin() * x + turn.cos() * y);
            let far = station.working_distance;
            let spot = ray.at((far - ray.origin.z) / ray.direction.z);
            let camera = base_from_scene(&station) * above(x - spot.x, y + spot.y, 4.2 + far);
            camera * station.flange_from_camera.inverse()
        })
        .collect();
    save_poses(out, &poses).unwrap();
}

fn truth(recording: &Path) -> Rigid<Base, Part> {
    let parts = json(&recording.join("truth.json"));
    serde_json::from_value(parts["parts"][0]["base_T_part"].clone()).unwrap()
}

fn off(report: &Value, truth: &Rigid<Base, Part>) -> Off {
    Off::of(&serde_json::from_value(report["base_from_part"].clone()).unwrap(), truth)
}

#[test]
fn a_second_look_is_planned_taken_and_brought_together() {
    let b = Bench::new();
    b.simulate("--out ./first --scene here.toml --shots 90");
    std::fs::rename(b.at("first/station"), b.at("station")).unwrap();
    state_uncertainty(&b.at("station"));
    b.scan("first/scan", "scans/a");
    let at = "--station ./station --robot denso --json";

    // One look passes and says that it is not cross-checked; a recipe that asks for two refuses it.
    let one: Value =
        serde_json::from_str(&b.run(&format!("find scans/a --recipe led.toml --out one.json {at}"))).unwrap();
    let notes = |r: &Value| r["notes"].to_string();
    assert!(one["passed"] == true && one["looks"].is_null() && notes(&one).contains("not cross-checked"), "{one}");
    let (code, said) = b.fails(&format!("find scans/a --recipe strict.toml --out one.json {at}"));
    assert!(code == 1 && said.contains("number of looks is 1.000, limit 2.000"), "{said}");
    assert!(json(&b.at("one.json"))["poses"].is_null(), "a refused report holds no pose");

    // The plan: where the sensor goes, and what stays hidden.
    let plan = "second-look scans/a --recording first/scan --recipe led.toml --station ./station --out second.json";
    let planned: Value = serde_json::from_str(&b.run(&format!("{plan} --json"))).unwrap();
    assert_eq!(planned["shots"], 90);
    let shown = planned["shown"].as_array().unwrap();
    assert!(shown.iter().any(|s| s["calibration"] == "hand-eye" && s["parameter"] == "tx mm"), "{planned}");
    assert!(planned["hidden"].is_array() && json(&b.at("second.json"))["poses"].as_array().unwrap().len() == 90);
    let (code, said) = b.fails(&format!("{plan} --turn 10"));
    assert!(code == 2 && said.contains("60 to 300"), "{said}");
    let (code, said) = b.fails(&format!("{plan} --tilt 2"));
    assert!(code == 2 && said.contains("10 to 45"), "{said}");

    // The robot goes there; both looks give one pose.
    b.simulate("--out ./again --scene here.toml --poses second.json");
    b.scan("again/scan", "scans/b");
    let find = format!("find scans/a scans/b --recipe strict.toml --out two.json {at}");
    let two: Value = serde_json::from_str(&b.run(&find)).unwrap();
    assert_eq!(two, json(&b.at("two.json")), "what is said and what is kept are the same");
    println!("{}", two["looks"]);
    let looks = |path: &str| figure(&two, &["looks", path]);
    assert!(two["passed"] == true && two["poses"].is_object() && looks("looks") == 2.0, "{}", two["reasons"]);
    assert!((looks("turn_deg") - 180.0).abs() < 1.0 && (looks("tilt_deg") - 20.0).abs() < 1.0, "{}", two["looks"]);
    assert!(looks("ratio") <= 3.0 && !notes(&two).contains("not cross-checked"), "{}", notes(&two));
    let truth = truth(&b.at("first/scan"));
    let (one, both) = (off(&one, &truth), off(&two, &truth));
    println!("one look {one:?}\ntwo looks {both:?}");
    let sigma: [f64; 3] = serde_json::from_value(two["sigma_mm"].clone()).unwrap();
    assert!((0..3).all(|k| both.by[k].abs() < 3.0 * sigma[k]), "{both:?} {sigma:?}");
    assert!(both.in_plane() < 0.05 && both.in_height() < 0.05, "{both:?}");

    // The pointer's distances agree; the spot at the part's edge is left out. One scan with them is checked in its
    // height only.
    spots(&b.at("spots.json"));
    b.simulate("--out ./spots --scene here.toml --set surface --poses spots.json");
    let ranged: Value = serde_json::from_str(&b.run(&format!("{find} --range spots/surface"))).unwrap();
    let witness = |r: &Value, path: &str| figure(r, &["looks", "witness", path]);
    println!("{}", ranged["looks"]["witness"]);
    assert!(witness(&ranged, "places") == 5.0 && witness(&ranged, "ratio") < 3.0, "{}", ranged["looks"]["witness"]);
    assert!(witness(&ranged, "height_mm").abs() < 0.05, "{}", ranged["looks"]["witness"]);
    assert!(notes(&ranged).contains("laser_0005.png: the spot is nearer than 1 mm to an edge"), "{}", notes(&ranged));
    let one_ranged = format!("find scans/a --range spots/surface --out r.json {at} --recipe");
    let alone: Value = serde_json::from_str(&b.run(&format!("{one_ranged} led.toml"))).unwrap();
    assert!(
        notes(&alone).contains("not cross-checked") && notes(&alone).contains("height was cross-checked"),
        "{alone}"
    );
    let (code, said) = b.fails(&format!("{one_ranged} strict.toml"));
    assert!(code == 1 && said.contains("number of looks"), "{said}");
    let (code, said) = b.fails(&format!("{find} --range first/scan"));
    assert!(code == 1 && said.contains("pointer"), "{said}");
    // The same scans as of an object that nobody drew.
    let object = |look: &str| {
        let args = format!("verify --station ./station --object scans/{look}a --object scans/{look}b --json");
        serde_json::from_str::<Value>(&b.run(&args)).unwrap()
    };
    let seen = object("");
    println!("{}", seen["object"]);
    assert!(
        figure(&seen, &["object", "looks", "ratio"]) < 3.0 && !seen["remarks"].to_string().contains("disagree"),
        "{seen}"
    );
    // It did not move; planes continued from pieces millimetres away had it turned by 0.1 degrees.
    let moved =
        |path: &str| seen["object"]["looks"][path].as_array().unwrap().iter().map(|v| v.as_f64().unwrap().abs());
    assert!(
        moved("difference_mm").all(|d| d < 0.04) && moved("difference_deg").all(|d| d < 0.05),
        "{}",
        seen["object"]
    );
    let (code, said) = b.fails("verify --station ./station --object scans/a --object scans/a");
    assert!(code == 2 && said.contains("one scan twice"), "{said}");
    let (code, said) = b.fails("verify --station ./station --object scans/a");
    assert!(code == 2 && said.contains("two or more"), "{said}");

    // What is no second look.
    let refused = |scans: &str, code: i32, words: &[&str]| {
        let (is, said) = b.fails(&format!("find {scans} --recipe led.toml --out no.json {at}"));
        assert!(is == code && words.iter().all(|w| said.contains(w)), "{scans}: {is}, {said}");
    };
    refused("scans/a scans/a", 2, &["one scan twice"]);
    std::fs::create_dir(b.at("scans/copy")).unwrap();
    for name in std::fs::read_dir(b.at("scans/a")).unwrap().map(|e| e.unwrap().file_name()) {
        std::fs::copy(b.at("scans/a").join(&name), b.at("scans/copy").join(&name)).unwrap();
    }
    refused("scans/a scans/copy", 2, &["one scan twice"]);
    let (code, said) = b.fails("find scans/a scans/b --recipe led.toml --out no.json");
    assert!(code == 2 && said.contains("--station"), "{said}");
    assert!(!b.at("no.json").exists(), "a refused comparison leaves no report");

    // The part was moved between the looks.
    std::fs::write(b.at("there.toml"), scene(0.4, -0.3)).unwrap();
    b.simulate("--out ./moved --scene there.toml --poses second.json");
    b.scan("moved/scan", "scans/moved");
    refused("scans/a scans/moved", 1, &["looks' ratio"]);
    assert!(json(&b.at("no.json"))["poses"].is_null());

    // The hand-eye is 1 mm off along the stripe (along the way a delay would do the same): each look passes, both
    // together do not, and it is named among what explains it.
    let mut rig = Rig::load(&b.at("station")).unwrap();
    rig.hand_eye.as_mut().unwrap().value.translation.y += 1.0;
    rig.store_all(&b.at("station")).unwrap();
    refused("scans/a scans/b", 1, &["was scanned with calibration"]);
    b.scan("first/scan", "scans/wrong_a");
    b.scan("again/scan", "scans/wrong_b");
    for look in ["a", "b"] {
        b.run(&format!("find scans/wrong_{look} --recipe led.toml --out alone.json {at}"));
    }
    refused("scans/wrong_a scans/wrong_b", 1, &["looks' ratio"]);
    let by_hand_eye = |looks: &Value| {
        let all = looks["explained_by"].as_array().unwrap();
        all.iter().find(|e| e["name"] == "hand-eye").unwrap()["share"].as_f64().unwrap()
    };
    let looks = &json(&b.at("no.json"))["looks"];
    assert!(by_hand_eye(looks) > 0.9, "{looks}");
    let seen = object("wrong_");
    println!("{}\n{}", seen["object"], seen["remarks"]);
    assert!(figure(&seen, &["object", "looks", "ratio"]) > 3.0, "{}", seen["object"]);
    assert!(by_hand_eye(&seen["object"]["looks"]) > 0.9, "{}", seen["object"]);
    assert!(seen["remarks"].to_string().contains("the scans of the object disagree"), "{}", seen["remarks"]);
    // A scan with another calibration beside one with the present one.
    refused("scans/wrong_a scans/b", 1, &["was scanned with calibration"]);

    // The laser plane is 0.3 mm nearer: two looks hardly show it, the pointer does.
    let mut rig = Rig::load(&b.at("station")).unwrap();
    rig.hand_eye.as_mut().unwrap().value.translation.y -= 1.0;
    rig.laser_plane.as_mut().unwrap().value.offset -= 0.3;
    rig.store_all(&b.at("station")).unwrap();
    b.scan("first/scan", "scans/low_a");
    b.scan("again/scan", "scans/low_b");
    refused("scans/low_a scans/low_b --range spots/surface", 1, &["range's ratio"]);
    let low = json(&b.at("no.json"));
    println!("{}", low["looks"]);
    assert!(witness(&low, "height_mm") < -0.3, "{}", low["looks"]["witness"]);
}
