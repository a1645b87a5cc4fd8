//! Files of public reports by people who do this job, each with the command they would give here and the right answer.

use crate::common::{sheetlight, sheetlight_fails};
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

/// A folder for results, and the names of files in and out of it.
struct Case {
    name: &'static str,
    folder: tempfile::TempDir,
}

impl Case {
    fn new(name: &'static str) -> Case {
        Case { name, folder: tempfile::tempdir().unwrap() }
    }

    fn file(&self, name: &str) -> String {
        let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
            .join("tests/data/statements")
            .join(self.name)
            .join(name);
        path.to_str().unwrap().to_owned()
    }

    fn out(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// What `import-map` says about a file.
    fn imported(&self, name: &str, options: &str) -> Value {
        let (file, out) = (self.file(name), self.out(name));
        let mut args = vec!["import-map", &file, "--out", &out, "--json"];
        args.extend(options.split_whitespace());
        serde_json::from_str(&sheetlight(&args)).unwrap()
    }

    /// What it says when it refuses.
    fn refused(&self, name: &str, options: &str) -> String {
        let (file, out) = (self.file(name), self.out(name));
        let mut args = vec!["import-map", &file, "--out", &out];
        args.extend(options.split_whitespace());
        sheetlight_fails(&args).1
    }

    /// Smallest, median and largest z of the cloud that was imported.
    fn heights(&self, name: &str) -> [f32; 3] {
        let mut z = vec![];
        let cloud = self.folder.path().join(name).join("cloud.ply");
        let points = sheetlight::scan::read_cloud(&cloud).unwrap();
        points.iter().for_each(|p| z.push(p.position.z));
        z.sort_by(f32::total_cmp);
        [z[0], z[z.len() / 2], z[z.len() - 1]]
    }
}

fn notes(report: &Value) -> String {
    report["remarks"].to_string()
}

fn close(seen: f32, wanted: f32, within: f32) {
    assert!((seen - wanted).abs() <= within, "{seen}, wanted {wanted} +- {within}");
}

#[test]
fn a_map_whose_rows_are_stored_from_the_bottom_is_not_mirrored() {
    let case = Case::new("01-tiff-orientation");
    let recipe = case.out("t.toml");
    sheetlight(&[
        "model",
        &case.file("t.dxf"),
        "--name",
        "t",
        "--out",
        &recipe,
        "--tolerance-mm",
        "1",
        "--cell-mm",
        "0.8",
    ]);
    for name in ["top.tif", "bottom.tif"] {
        case.imported(name, "--unit-mm 1 --spacing-mm 0.4,0.4");
        let found = case.out("found.json");
        sheetlight(&["find", &case.out(name), "--recipe", &recipe, "--out", &found]);
        let found: Value = serde_json::from_str(&std::fs::read_to_string(found).unwrap()).unwrap();
        let pose: Vec<f64> = serde_json::from_value(found["poses"]["insertion"]["base_from_tool"].clone()).unwrap();
        let (at, turn) = ([pose[3], pose[7]], pose[4].atan2(pose[0]).to_degrees());
        assert!(
            (at[0] - 22.0).abs() < 0.3 && (at[1] + 31.6).abs() < 0.3 && (turn - 20.0).abs() < 1.0,
            "{name}: {found}"
        );
    }
}

#[test]
fn heights_are_not_turned_round_where_white_is_zero() {
    let case = Case::new("02-float-tiff-white-is-zero");
    for name in ["plain.tif", "white.tif"] {
        let report = case.imported(name, "--unit-mm 1 --spacing-mm 0.5,0.5");
        let [_, middle, most] = case.heights(name);
        close(middle, 5.0, 0.05);
        close(most, 7.03, 0.01);
        assert_eq!(notes(&report).contains("tag 262"), name == "white.tif", "{report}");
    }
    let report = case.imported("white16.tif", "--unit-mm 0.001 --spacing-mm 0.5,0.5 --missing 0");
    close(case.heights("white16.tif")[1], 5.0, 0.05);
    assert!(report["points"].as_u64().unwrap() < 1200, "{report}");
}

#[test]
fn points_at_zero_are_named_and_dropped_where_stated() {
    let case = Case::new("05-zero-points-in-a-cloud");
    let report = case.imported("zero.pcd", "--unit-mm 1");
    assert!(report["points"] == 1200 && notes(&report).contains("60 of 1200"), "{report}");
    assert!(notes(&report).contains("--missing 0"), "{report}");
    assert_eq!(case.imported("zero.pcd", "--unit-mm 1 --missing 0")["points"], 1140);
    assert_eq!(case.imported("zero.ply", "--unit-mm 1 --spacing-mm 0.5,0.5 --missing 0")["points"], 1140);
}

#[test]
fn the_level_that_a_file_names_as_missing_is_missing() {
    let case = Case::new("07-gdal-nodata");
    let report = case.imported("n.tif", "--unit-mm 1 --spacing-mm 0.5,0.5");
    assert!(report["points"] == 1176 && notes(&report).contains("24 pixels"), "{report}");
    assert_eq!(case.imported("n.tif", "--unit-mm 1 --spacing-mm 0.5,0.5 --missing -9999")["points"], 1176);
    let report = case.imported("n.tif", "--unit-mm 1 --spacing-mm 0.5,0.5 --missing none");
    assert!(report["points"] == 1200 && notes(&report).contains("overrules"), "{report}");
}

#[test]
fn transparent_pixels_of_a_template_teach_nothing() {
    let case = Case::new("09-template-with-alpha");
    for template in ["plain.png", "template.png"] {
        let out = case.out("r.json");
        sheetlight(&["match", &case.file(template), &case.file("scene.png"), "--all", "--out", &out]);
        let found: Value = serde_json::from_str(&std::fs::read_to_string(out).unwrap()).unwrap();
        let matches = found["pictures"][0]["matches"].as_array().unwrap().clone();
        let mut places: Vec<[f64; 2]> =
            matches.iter().map(|m| ["x_px", "y_px"].map(|k| m[k].as_f64().unwrap())).collect();
        places.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let wanted = [[80.0, 62.0], [220.0, 192.0], [320.0, 102.0]];
        assert_eq!(places.len(), 3, "{template}: {found}");
        for (p, w) in places.iter().zip(&wanted) {
            assert!((p[0] - w[0]).hypot(p[1] - w[1]) < 0.5, "{template}: {places:?}");
        }
    }
}

#[test]
fn levels_of_four_bits_are_not_stretched() {
    let case = Case::new("10-four-bit-png");
    case.imported("g4.png", "--unit-mm 1 --spacing-mm 0.5,0.5 --missing none");
    let [least, _, most] = case.heights("g4.png");
    assert_eq!([least, most], [1.0, 15.0]);
}

#[test]
fn colours_are_no_heights() {
    let case = Case::new("11-colour-picture-as-heights");
    let said = case.refused("jet.png", "--unit-mm 0.01 --spacing-mm 0.5,0.5 --missing 0");
    assert!(said.contains("colour"), "{said}");
}

#[test]
fn reduced_copies_are_passed_over_and_several_pages_refused() {
    let case = Case::new("13-tiff-of-several-pages");
    let report = case.imported("thumb.tif", "--unit-mm 1 --spacing-mm 0.5,0.5");
    assert!(report["points"] == 1200 && notes(&report).contains("NewSubfileType"), "{report}");
    let said = case.refused("two.tif", "--unit-mm 1 --spacing-mm 0.5,0.5");
    assert!(said.contains("2 pages") && said.contains("--page"), "{said}");
    assert_eq!(case.imported("two.tif", "--unit-mm 1 --spacing-mm 0.5,0.5 --page 2")["imported"]["page"], 2);
    assert!(case.refused("two.tif", "--unit-mm 1 --spacing-mm 0.5,0.5 --page 3").contains("page 3"));
}

#[test]
fn levels_of_a_webcam_come_as_they_are_sent() {
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        assert!(std::env::var("CI").is_err(), "ffmpeg is not installed");
        eprintln!("SKIPPED: ffmpeg is not installed");
        return;
    }
    let case = Case::new("14-yuyv-levels");
    // A ramp of luma 0 to 255 in each row, grey; without and with a tag that says otherwise, and behind a filter.
    let row: Vec<u8> = (0..=255u8).flat_map(|x| [x, 128]).collect();
    std::fs::write(case.out("ramp.yuyv"), row.repeat(3 * 64)).unwrap();
    // The first frame tells the size; the picture is one of those after it.
    let deep: Vec<u8> = (0..64 * 256u16).flat_map(|i| (4 * (i % 256)).to_le_bytes()).collect();
    std::fs::write(case.out("ramp10"), [deep, 512u16.to_le_bytes().repeat(64 * 256)].concat().repeat(3)).unwrap();
    let raw = |kind: &str, more: &str| format!("ffmpeg:-f rawvideo -pix_fmt {kind} -s 256x64 {more}");
    let yuyv = case.out("ramp.yuyv");
    for (camera, bits, factor) in [
        (raw("yuyv422", &format!("-i {yuyv}")), 8, 1),
        (raw("yuyv422", &format!("-color_range tv -i {yuyv}")), 8, 1),
        (raw("yuyv422", &format!("-color_range pc -i {yuyv}")), 8, 1),
        (raw("yuyv422", &format!("-i {yuyv} -vf vflip")), 8, 1),
        (raw("yuv422p10le", &format!("-i {}?bits=10", case.out("ramp10"))), 10, 4),
    ] {
        let out = case.out("o.png");
        sheetlight(&["camera", "snap", "--camera", &camera, &out]);
        let image = sheetlight::raster::load(out.as_ref(), Default::default(), bits).unwrap();
        let wrong: Vec<u32> = (0..256).filter(|x| image.get(*x, 5) != *x as u16 * factor).collect();
        assert!(wrong.is_empty(), "{camera}: levels changed at {wrong:?}");
    }
}

#[test]
fn an_inch_in_the_header_of_a_metric_drawing_is_doubted_and_overruled() {
    let case = Case::new("15-dxf-inch-header-over-mm");
    let model = |unit: &[&str]| {
        let (file, out) = (case.file("inch.dxf"), case.out("p.toml"));
        let args = [&["model", &file, "--name", "p", "--out", &out], unit].concat();
        let done = Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(args).output().unwrap();
        assert!(done.status.success());
        String::from_utf8_lossy(&done.stderr).into_owned()
    };
    let said = model(&[]);
    assert!(said.contains("$MEASUREMENT") && said.contains("--unit mm") && said.contains("762.000"), "{said}");
    let said = model(&["--unit", "mm"]);
    assert!(said.contains("30.000 x 18.000 mm") && said.contains("overrules"), "{said}");
}

#[test]
fn every_kind_of_number_is_read() {
    let case = Case::new("19-tiff-kinds");
    let same = "--unit-mm 1 --spacing-mm 0.5,0.5";
    let in_um = "--unit-mm 0.001 --spacing-mm 0.5,0.5 --missing -32768";
    for (name, options, middle) in
        [("i16.tif", in_um, -0.5), ("big.tif", same, 5.0), ("f16.tif", same, 5.0), ("f64.tif", same, 5.0)]
    {
        let report = case.imported(name, options);
        close(case.heights(name)[1], middle, 0.01);
        assert!(report["points"].as_u64().unwrap() > 1000, "{name}: {report}");
    }
    let said = case.refused("i32.tif", same);
    assert!(said.contains("which level means"), "{said}");
    case.imported("i32.tif", "--unit-mm 0.001 --spacing-mm 0.5,0.5 --missing none");
    close(case.heights("i32.tif")[1], 5.0, 0.1);
}

#[test]
fn fields_that_are_not_needed_are_passed_over() {
    let case = Case::new("20-pcd-64-bit-field");
    assert_eq!(case.imported("u8.pcd", "--unit-mm 1")["points"], 1200);
}

#[test]
fn a_depth_that_stands_for_no_measurement_does_not_judge_the_error() {
    let case = Case::new("27-profile-sentinel-depth");
    let station = case.out("st");
    sheetlight(&["station", "new", "--station", &station, "--robot", "denso"]);
    let (profiles, poses) = (case.file("p"), case.file("poses.csv"));
    let known = ["calibrate", "profile-hand-eye", &profiles, "--poses", &poses, "--ball-diameter-mm", "30"];
    let stored = || -> Value {
        let path = PathBuf::from(&station).join("calibration/profile_hand_eye.json");
        serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
    };
    let mut figures = vec![];
    for missing in [&["--missing", "999.999"][..], &[]] {
        let args = [&known[..], &["--station", &station], missing].concat();
        let done = Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(&args).output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr).into_owned() + &String::from_utf8_lossy(&done.stdout);
        assert!(done.status.success(), "{said}");
        let warned = said.contains("exactly the z 999.999") && said.contains("--missing 999.999");
        assert_eq!(warned, missing.is_empty(), "{said}");
        figures.push(stored()["quality"].clone());
    }
    // As without these points, but for the points that chance picks first.
    let expected = |k: usize| figures[k]["figures"]["expected_error_at_working_distance_mm"].as_f64().unwrap();
    assert!((expected(1) / expected(0) - 1.0).abs() < 0.01 && expected(0) < 0.004, "{figures:?}");
    assert!(figures.iter().all(|f| f["verdict"] == "good" && !f.to_string().contains("541")), "{figures:?}");
}

#[test]
fn the_message_about_depth_names_the_option_of_the_command() {
    let case = Case::new("28-sixteen-bit-match");
    let (plain, deep) = (case.file("plain.png"), case.file("scene16.png"));
    for args in [
        vec!["match", &plain, &deep, "--all"],
        vec!["match", &deep, &plain],
        vec!["teach", &deep, "--name", "p", "--region", "1,1,40,40", "--out", "p.json"],
    ] {
        let (_, said) = sheetlight_fails(&args);
        assert!(said.contains("--bits") && !said.contains("meta.json"), "{said}");
    }
}
