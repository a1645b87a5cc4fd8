//! In: calibration files, recordings, scan folders and outputs that were edited, mixed or exchanged. Out: each is
//! refused by name with a next step, and nothing of what was there is lost.
//! Frame and unit: base frame, mm.

use super::bench::{Bench, VALUES, refused, run, snapshot, stripe};
use serde_json::{Value, json};
use sheetlight::geometry::Plane;
use sheetlight::raster::Pixels;
use sheetlight::rig::{Rig, sealed};
use sheetlight::station::{cloud_of, load_report};

/// A file of the rig, edited as JSON and sealed anew: what a hostile writer, or another program, could make.
fn forged(b: &Bench, kind: &str, edit: impl Fn(&mut Value)) -> String {
    let path = b.at(&format!("station/calibration/{kind}.json"));
    let whole = std::fs::read_to_string(&path).unwrap();
    let mut value: Value = serde_json::from_str(&whole).unwrap();
    edit(&mut value);
    value.as_object_mut().unwrap().remove("seal");
    std::fs::write(&path, sealed(&value)).unwrap();
    let said = Rig::load(&b.at("station")).and_then(|rig| rig.belong_together());
    std::fs::write(&path, whole).unwrap();
    said.map_or_else(|e| e.to_string(), |()| "passed".into())
}

#[test]
fn calibrations_that_are_none_are_refused() {
    let b = Bench::new(1);
    assert_eq!(forged(&b, "camera", |_| {}), "passed");
    let plane = ["nx", "ny", "nz", "offset_mm"];
    let with =
        |matrix: Value| move |v: &mut Value| v["covariance"] = json!({"parameters": plane, "matrix": matrix.clone()});
    let zero = vec![vec![0.0; 4]; 4];
    assert_eq!(forged(&b, "laser_plane", with(json!(zero))), "passed");
    let scaled = |f: f64| {
        move |v: &mut Value| {
            (0..3).for_each(|i| v["value"]["normal"][i] = json!(f * v["value"]["normal"][i].as_f64().unwrap()))
        }
    };
    let mut negative = zero.clone();
    negative[3][3] = -1e-4;
    let cases: Vec<(&str, &str, String)> = vec![
        ("normal 1.01 long", "long", forged(&b, "laser_plane", scaled(1.01))),
        ("normal 1.002 long", "long", forged(&b, "laser_plane", scaled(1.002))),
        ("offset 0", "passes the camera", forged(&b, "laser_plane", |v| v["value"]["offset_mm"] = json!(0.0))),
        ("negative variance", "below 0", forged(&b, "laser_plane", with(json!(negative)))),
        ("short covariance", "its 4 parameters need 4x4", forged(&b, "laser_plane", with(json!([[0.0]])))),
        ("ragged covariance", "need 4x4", forged(&b, "laser_plane", with(json!([[0.0], [0.0, 0.0], [], [0.0]])))),
        (
            "other parameters",
            "a laser plane has",
            forged(&b, "laser_plane", |v| v["covariance"] = json!({"parameters": ["a"], "matrix": [[1.0]]})),
        ),
        ("covariance as text", "cannot be understood", forged(&b, "camera", |v| v["covariance"] = json!("none"))),
        (
            "no covariance",
            "cannot be understood",
            forged(&b, "camera", |v| drop(v.as_object_mut().unwrap().remove("covariance"))),
        ),
        ("units", "unknown variant `inch`", forged(&b, "laser_plane", |v| v["units"] = json!("inch"))),
        ("frame", "frame", forged(&b, "laser_plane", |v| v["frame"] = json!("base_T_camera"))),
        ("kind", "renamed or swapped", forged(&b, "laser_plane", |v| v["kind"] = json!("pointer"))),
        ("unknown kind", "unknown variant", forged(&b, "laser_plane", |v| v["kind"] = json!("plane"))),
        ("format", "format 3", forged(&b, "laser_plane", |v| v["format"] = json!(3))),
        ("refused verdict", "was refused", forged(&b, "hand_eye", |v| v["quality"]["verdict"] = json!("refused"))),
        (
            "focal length in mm",
            "focal lengths",
            forged(&b, "camera", |v| (v["value"]["fx"], v["value"]["fy"]) = (json!(8.0), json!(8.0))),
        ),
        ("negative focal length", "no camera", forged(&b, "camera", |v| v["value"]["fx"] = json!(-305.0))),
        ("another camera", "measured with another camera", forged(&b, "camera", |v| v["value"]["fx"] = json!(306.0))),
        ("no camera named", "names no camera", forged(&b, "laser_plane", |v| v["rests_on"] = json!({}))),
        ("last row of a transform", "last row", forged(&b, "hand_eye", |v| v["value"][12] = json!(1.0))),
        ("mirrored transform", "", forged(&b, "hand_eye", |v| v["value"][0] = json!(-1.0))),
        ("direction of a pointer", "long", forged(&b, "pointer", |v| v["value"]["direction"][2] = json!(0.9))),
    ];
    let wrong: Vec<_> = cases
        .iter()
        .filter(|(_, want, got)| got == "passed" || !got.contains(want) || !got.contains("next step"))
        .collect();
    assert!(wrong.is_empty(), "case, expected, got: {wrong:#?}");
    // Edited without a new seal, by any number.
    for (kind, from, to) in
        [("laser_plane", "72.0", "73.0"), ("hand_eye", "90.0", "0.09"), ("camera", "305.8", "305.9")]
    {
        let file = format!("station/calibration/{kind}.json");
        let whole = std::fs::read(b.at(&file)).unwrap();
        b.edit(&file, from, to);
        let said = refused(&b.scan("recording", "out", &[]));
        assert!(said.contains("was changed after it was made") && said.contains("station seal"), "{said}");
        std::fs::write(b.at(&file), whole).unwrap();
    }
    run(&b.scan("recording", "out", &[]));
}

/// Every number and text of every file by every hostile one, sealed: refused with a next step, or believed and of use.
#[test]
fn hostile_numbers_are_answered() {
    let b = Bench::new(1);
    fn places(v: &Value, at: String, out: &mut Vec<String>) {
        match v {
            Value::Object(all) => all.iter().for_each(|(k, v)| places(v, format!("{at}/{k}"), out)),
            Value::Array(all) => all.iter().enumerate().for_each(|(k, v)| places(v, format!("{at}/{k}"), out)),
            _ => {}
        }
        out.push(at);
    }
    let (mut refused, mut passed) = (0, 0);
    for kind in ["camera", "laser_plane", "pointer", "hand_eye"] {
        let path = b.at(&format!("station/calibration/{kind}.json"));
        let whole = std::fs::read_to_string(&path).unwrap();
        let mut value: Value = serde_json::from_str(&whole).unwrap();
        value.as_object_mut().unwrap().remove("seal");
        let mut all = Vec::new();
        places(&value, String::new(), &mut all);
        let hostile = [
            json!(0),
            json!(-1.0),
            json!(1e308),
            json!(-1e308),
            json!(5e-324),
            json!(1e10),
            json!(u64::MAX),
            json!(null),
            json!("x"),
            json!([]),
            json!({}),
            json!([[1.0]]),
        ];
        for (place, with) in all.iter().filter(|p| !p.is_empty()).flat_map(|p| hostile.iter().map(move |h| (p, h))) {
            let mut edited = value.clone();
            *edited.pointer_mut(place).unwrap() = with.clone();
            std::fs::write(&path, sealed(&edited)).unwrap();
            match Rig::load(&b.at("station")).and_then(|rig| rig.belong_together().and_then(|()| rig.reaches(None))) {
                Err(fault) => {
                    assert!(!fault.next.is_empty(), "{kind}{place} = {with}: {fault}");
                    refused += 1;
                }
                Ok(()) => passed += 1,
            }
        }
        std::fs::write(&path, whole).unwrap();
    }
    println!("{refused} refused, {passed} believed");
    assert!(refused > 1000 && passed > 0, "{refused} {passed}");
}

#[test]
fn a_person_can_vouch_and_every_report_says_so() {
    let b = Bench::new(1);
    // As a former version wrote it: no seal, another frame's name, neither of the lists.
    let path = b.at("station/calibration/laser_plane.json");
    let mut old: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let object = old.as_object_mut().unwrap();
    ["seal", "rests_on", "remarks"].iter().for_each(|k| drop(object.remove(*k)));
    (old["format"], old["frame"]) = (json!(1), json!("camera"));
    std::fs::write(&path, old.to_string()).unwrap();
    let said = refused(&b.scan("recording", "out", &[]));
    assert!(said.contains("has no seal") && said.contains("station seal --kind laser-plane"), "{said}");
    let seal = |why: &str| {
        ["station", "seal", "--station", &b.text("station"), "--kind", "laser-plane", "--because", why]
            .map(str::to_owned)
    };
    assert!(refused(&seal(" ")).contains("--because says nothing"));
    run(&seal("of version 1, checked on a gauge block"));
    run(&b.scan("recording", "out", &[]));
    let report = load_report(&b.at("out")).unwrap();
    assert!(report.remarks.iter().any(|r| r.contains("checked on a gauge block")), "{:?}", report.remarks);
    assert!(std::fs::read_to_string(b.at("out/index.html")).unwrap().contains("checked on a gauge block"));
    // What is no calibration cannot be vouched for.
    let text = std::fs::read_to_string(&path).unwrap();
    for edit in [
        |v: &mut Value| v["value"]["normal"][0] = json!(0.2),
        |v: &mut Value| v["covariance"]["matrix"] = json!([[1.0]]),
    ] {
        let mut v: Value = serde_json::from_str(&text).unwrap();
        edit(&mut v);
        std::fs::write(&path, v.to_string()).unwrap();
        refused(&seal("I say so"));
    }
}

#[test]
fn an_import_is_all_or_nothing() {
    let b = Bench::new(1);
    let before = snapshot(&b.at("station"));
    let import = |text: &str, more: &[&str]| {
        std::fs::write(b.at("new.json"), text).unwrap();
        let mut args =
            vec!["station".to_owned(), "import".into(), b.text("new.json"), "--station".into(), b.text("station")];
        args.extend(more.iter().map(|s| (*s).to_owned()));
        args
    };
    for (from, to, want) in [
        ("0.883, 0.469", "0.89183, 0.47369", "1.009"),
        ("0.883, 0.469", "0.8848, 0.4699", "1.001"),
        ("0.883, 0.469", "0, 0", "0.000000 long"),
        ("\"offset_mm\": 72", "\"offset_mm\": 0.072", "looks like metres"),
        ("90, 0, 1, 0, 0, 0, 0, 1, 40", "0.09, 0, 1, 0, 0, 0, 0, 1, 0.04", "looks like metres"),
        ("\"fx\": 305.8, \"fy\": 305.8", "\"fx\": 4, \"fy\": 4", "focal lengths"),
        ("\"cx\": 157, \"cy\": 116", "\"cx\": 0.49, \"cy\": 0.5", "principal point"),
        ("[1, 0, 0, 90", "[-1, 0, 0, 90", ""),
        ("[1, 0, 0, 90", "[1, 0.1, 0, 90", "orthonormal"),
        ("-0.6, 0.8", "-0.6, 0.9", "long"),
        ("\"offset_mm\": 72", "\"offset_mm\": \"72\"", "contains no rig values"),
    ] {
        let text = VALUES.replacen(from, to, 1);
        assert_ne!(text, VALUES, "{from}");
        let said = refused(&import(&text, &[]));
        assert!(said.contains(want), "{to}: {want}: {said}");
        assert!(snapshot(&b.at("station")) == before, "{to} changed the station");
    }
    // A new camera alone is let in, and what was measured with the old one is of no use until it is measured again.
    let camera =
        json!({"intrinsics": serde_json::from_str::<Value>(&VALUES.replace("305.8", "310")).unwrap()["intrinsics"]});
    run(&import(&camera.to_string(), &[]));
    let said = refused(&b.scan("recording", "out", &[]));
    assert!(said.contains("measured with another camera") && said.contains("laser-plane, hand-eye"), "{said}");
    run(&import(VALUES, &[]));
    run(&b.scan("recording", "out", &[]));
    // A camera that stands still is asked about its unit as one on the flange is, and is shown.
    let standing = |mm: [f64; 3]| {
        let rows = json!([1, 0, 0, mm[0], 0, -1, 0, mm[1], 0, 0, -1, mm[2], 0, 0, 0, 1]);
        json!({"base_T_camera": rows}).to_string()
    };
    let said = refused(&import(&standing([0.4, 0.1, 0.9]), &[]));
    assert!(said.contains("the camera lies 0.9899 mm from the origin of base, which looks like metres"), "{said}");
    run(&import(&standing([400.0, 100.0, 900.0]), &[]));
    let shown = run(&["station".into(), "show".into(), "--station".into(), b.text("station")]);
    assert!(shown.contains("base camera  400.0000 100.0000 900.0000 mm"), "{shown}");
    std::fs::remove_file(b.at("station/calibration/base_camera.json")).unwrap();
    // Metres that are meant.
    let near = VALUES.replace("\"offset_mm\": 72", "\"offset_mm\": 1.5");
    assert!(refused(&import(&near, &[])).contains("--as-stated"));
    run(&import(&near, &["--as-stated"]));
    let rig = Rig::load(&b.at("station")).unwrap();
    let plane: Plane<_> = rig.laser_plane.unwrap().value;
    assert!((plane.offset - 1.5).abs() < 1e-12);
}

#[test]
fn a_scan_folder_holds_one_scan() {
    let b = Bench::new(3);
    b.record("other", 40);
    run(&b.scan("recording", "a", &[]));
    run(&b.scan("other", "b", &[]));
    // What the first scan left, and what people keep beside it.
    for name in ["errors.json", "error_picture.png", "find_led.json", "overlays/old.png", "pose.json"] {
        std::fs::write(b.at("a").join(name), "of the former scan").unwrap();
    }
    std::fs::write(b.at("a/found.json"), r#"[{"name": "led"}]"#).unwrap();
    run(&b.scan("other", "a", &["--overlays", "0"]));
    let now: Vec<String> = snapshot(&b.at("a")).keys().map(|p| p.display().to_string()).collect();
    assert!(
        !now.iter().any(|n| n.contains("old") || n.contains("error") || n.contains("led") || n.contains("found")),
        "{now:?}"
    );
    assert!(now.contains(&"pose.json".into()) && !now.iter().any(|n| n.contains("overlays/")), "{now:?}");
    assert_eq!(std::fs::read(b.at("a/cloud.ply")).unwrap(), std::fs::read(b.at("b/cloud.ply")).unwrap());
    // The cloud of one beside the report of the other; one byte of a cloud; a report without its cloud.
    run(&b.scan("recording", "a", &[]));
    cloud_of(&b.at("a")).unwrap();
    let whole = std::fs::read(b.at("a/cloud.ply")).unwrap();
    std::fs::copy(b.at("b/cloud.ply"), b.at("a/cloud.ply")).unwrap();
    assert!(cloud_of(&b.at("a")).unwrap_err().what.contains("SHA-256"));
    let mut bent = whole.clone();
    *bent.last_mut().unwrap() ^= 1;
    std::fs::write(b.at("a/cloud.ply"), bent).unwrap();
    assert!(cloud_of(&b.at("a")).unwrap_err().what.contains("SHA-256"));
    std::fs::write(b.at("a/cloud.ply"), whole).unwrap();
    cloud_of(&b.at("a")).unwrap();
    // A scan that fails leaves the former one whole.
    let before = snapshot(&b.at("a"));
    std::fs::write(b.at("other/1.png"), "no picture").unwrap();
    refused(&b.scan("other", "a", &[]));
    let after = snapshot(&b.at("a"));
    assert!(before.iter().all(|(name, bytes)| after.get(name) == Some(bytes)));
}

#[test]
fn what_lies_in_the_way_is_left_alone() {
    let b = Bench::new(2);
    // A lock that another living process is named in, and a checkpoint that is none, stop no new scan.
    std::fs::create_dir_all(b.at("out/scan.part")).unwrap();
    std::fs::write(b.at("out/scan.lock"), "1").unwrap();
    for checkpoint in ["", "{}", "{\"sigma\": [1]}", "\u{0}"] {
        std::fs::create_dir_all(b.at("out/scan.part")).unwrap();
        std::fs::write(b.at("out/scan.part/progress.json"), checkpoint).unwrap();
        assert!(refused(&b.scan("recording", "out", &["--resume"])).contains("without --resume"));
        run(&b.scan("recording", "out", &[]));
    }
    // A scan that a former version left unfinished cannot be gone on with, and is in nobody's way.
    std::fs::write(b.at("out/scan.progress.json"), "{}").unwrap();
    assert!(refused(&b.scan("recording", "out", &["--resume"])).contains("a former version was interrupted here"));
    run(&b.scan("recording", "out", &[]));
    assert!(!b.at("out/scan.progress.json").exists());
    for (folder, file) in [("recording", "meta.json"), ("station", "station.toml")] {
        assert!(refused(&b.scan("recording", folder, &[])).contains(file));
    }
    #[cfg(unix)]
    for link in ["scan.part", "scan.lock"] {
        std::fs::create_dir_all(b.at("elsewhere")).unwrap();
        std::fs::write(b.at("elsewhere/kept"), "kept").unwrap();
        let (out, target) = (format!("to {link}"), if link == "scan.lock" { "elsewhere/kept" } else { "elsewhere" });
        std::fs::create_dir(b.at(&out)).unwrap();
        std::os::unix::fs::symlink(b.at(target), b.at(&out).join(link)).unwrap();
        refused(&b.scan("recording", &out, &[]));
        assert_eq!(std::fs::read_to_string(b.at("elsewhere/kept")).unwrap(), "kept");
        assert_eq!(std::fs::read_dir(b.at("elsewhere")).unwrap().count(), 1);
    }
}

#[test]
fn no_result_replaces_what_it_is_made_from() {
    let b = Bench::new(1);
    run(&b.scan("recording", "scan", &[]));
    std::fs::write(b.at("part.toml"), "recipe").unwrap();
    std::fs::write(b.at("part.dxf"), "drawing").unwrap();
    std::fs::create_dir_all(b.at("recordings/scan")).unwrap();
    std::fs::copy(b.at("recording/meta.json"), b.at("recordings/scan/meta.json")).unwrap();
    let before = snapshot(b.dir.path());
    let t = |name: &str| b.text(name);
    let find = |out: &str| {
        vec![
            "find".to_owned(),
            t("scan"),
            "--recipe".into(),
            t("part.toml"),
            "--station".into(),
            t("station"),
            "--out".into(),
            t(out),
        ]
    };
    let of = |words: &[&str]| words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>();
    for args in [
        find("part.toml"),
        find("scan/../part.toml"),
        find("scan/scan.json"),
        find("scan/cloud.ply"),
        find("scan/height.json"),
        find("station/station.toml"),
        find("station/calibration/camera.json"),
        find("pose.png"),
        of(&["station", "export", "--station", &t("station"), "--out", &t("station/station.toml")]),
        of(&["station", "export", "--station", &t("station"), "--out", &t("station/calibration/camera.json")]),
        of(&["model", &t("part.dxf"), "--name", "a", "--out", &t("part.dxf")]),
        of(&["simulate", "--out", &t("recordings")]),
        of(&["simulate", "--out", &t("recording")]),
        of(&["simulate", "--out", &b.dir.path().display().to_string()]),
        of(&["demo", "--out", &t("scan")]),
        of(&["demo", "--out", &t("recording")]),
    ] {
        refused(&args);
        assert!(snapshot(b.dir.path()) == before, "{args:?} changed something");
    }
}

#[test]
fn pictures_outside_a_recording_are_not_read() {
    let b = Bench::new(2);
    std::fs::copy(b.at("recording/1.png"), b.at("secret.png")).unwrap();
    let whole = std::fs::read_to_string(b.at("recording/meta.json")).unwrap();
    let secret = b.text("secret.png");
    #[cfg(unix)]
    std::os::unix::fs::symlink(&secret, b.at("recording/link.png")).unwrap();
    let mut names = vec!["../secret.png", "./../secret.png", secret.as_str()];
    names.extend(cfg!(unix).then_some("link.png"));
    for name in names {
        b.edit("recording/meta.json", "1.png", name);
        let said = refused(&b.scan("recording", "out", &[]));
        assert!(said.contains("lies outside the recording") && said.contains("--pictures-outside"), "{name}: {said}");
        run(&b.scan("recording", "out", &["--pictures-outside"]));
        std::fs::write(b.at("recording/meta.json"), &whole).unwrap();
    }
    b.edit("recording/meta.json", "\"pose_file\":\"poses\"", "\"pose_file\":\"../recording/poses\"");
    assert!(refused(&b.scan("recording", "out", &[])).contains("lies outside"));
    std::fs::write(b.at("recording/meta.json"), &whole).unwrap();
    b.edit("recording/meta.json", "\"1.png\"", "\"0.png\"");
    assert!(refused(&b.scan("recording", "out", &[])).contains("the same picture 0.png at two poses"));
}

#[test]
fn bent_levels_are_made_linear_and_said() {
    let b = Bench::new(4);
    run(&b.scan("recording", "linear", &[]));
    let height = |out: &str| {
        let cloud = cloud_of(&b.at(out)).unwrap();
        (cloud.len(), cloud.iter().map(|p| f64::from(p.position[2])).sum::<f64>() / cloud.len() as f64)
    };
    let (n, z) = height("linear");
    for (response, bend) in [("\"srgb\"", None), ("2.2", Some(2.2))] {
        for i in 0..4 {
            let Pixels::U8(p) = stripe(115.0 + i as f64 * 0.01, i).pixels else { panic!("8 bits") };
            let level = |v: u8| {
                let light = f64::from(v) / 255.0;
                let srgb = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
                (255.0 * bend.map_or(srgb, |g: f64| light.powf(1.0 / g))).round() as u8
            };
            let picture = image::GrayImage::from_raw(320, 240, p.into_iter().map(level).collect()).unwrap();
            picture.save(b.at(&format!("recording/{i}.bmp"))).unwrap();
        }
        let meta = std::fs::read_to_string(b.at("recording/meta.json")).unwrap();
        let bent = meta.replace(".png", ".bmp").replace("\"linear\"", response);
        std::fs::write(b.at("recording/meta.json"), &bent).unwrap();
        run(&b.scan("recording", "bent", &[]));
        let (m, is) = height("bent");
        // A level of the bent pictures is up to two of the linear ones: 0.02 px at the peak, 0.01 mm here.
        assert!(m.abs_diff(n) * 50 <= n && (is - z).abs() < 0.01, "{response}: {m} of {n} points, {is} against {z} mm");
        let report = load_report(&b.at("bent")).unwrap();
        assert!(
            report.remarks.iter().any(|r| r.contains("made linear")) && report.image.bits == 12,
            "{:?}",
            report.remarks
        );
        // Taken as linear, the same pictures give a wider stripe.
        std::fs::write(b.at("recording/meta.json"), meta.replace(".png", ".bmp")).unwrap();
        run(&b.scan("recording", "as it is", &[]));
        let width = |out: &str| load_report(&b.at(out)).unwrap().stripe.unwrap().width_px;
        assert!(width("as it is") > 1.2 * width("bent"), "{} {}", width("as it is"), width("bent"));
        std::fs::write(b.at("recording/meta.json"), meta).unwrap();
    }
    b.edit("recording/meta.json", "\"linear\"", "\"log\"");
    assert!(refused(&b.scan("recording", "out", &[])).contains("response 'log' is not known"));
}
