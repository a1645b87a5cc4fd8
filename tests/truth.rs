//! In: the rendered recordings, their true calibration put into a station. Out: the scan's clouds judged
//! by the reference data's own scorer; those of turned cameras and of the twins beside them.
//! Frame and unit: base frame, mm.

mod common;

use common::clouds::{Apart, apart};
use common::turned::{self, Step};
use common::{figure, reference, rigs, score, sheetlight};
use sheetlight::geometry::{Base, Plane, Vec3, fit_plane};
use sheetlight::scan::{CloudPoint, read_cloud, write_cloud};
use sheetlight::station::load_report;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

const SETS: [&str; 8] = ["flat", "steps", "shiny", "scan_dimm", "scan_led", "scan_osc", "scan_flash", "scan_led_hires"];

/// Those whose shots lie near enough to each other to show what print does between them.
const PRINTED: [&str; 4] = ["scan_dimm", "scan_led", "scan_osc", "scan_flash"];

/// Their bars: rms and median, mm; share of outliers; completeness, of which the part that is missing may be a quarter
/// larger.
const PRINTED_BARS: [(&str, f64, f64, f64, f64); 4] = [
    ("scan_dimm", 0.0471, 0.0147, 0.00014, 0.957),
    ("scan_led", 0.0385, 0.015, 0.0001, 0.9815),
    ("scan_osc", 0.038, 0.0147, 0.0001, 0.9719),
    ("scan_flash", 0.0365, 0.015, 0.0001, 0.9753),
];

/// Points over columns that hold any, at most: a stripe crosses a column once, but for steps and what stands over the
/// surface; every further fit of the same light has the same error again.
const CROSSINGS: f64 = 1.15;

/// Every figure with its bar: path, least, most. Errors may be a quarter larger than those measured with the rig in the
/// reference data, so that a change that costs a third shows. What is zero but for single points has a floor: 0.5 um
/// for heights, one in ten thousand for shares.
fn bars() -> Vec<(Vec<&'static str>, f64, f64)> {
    let mut bars = Vec::new();
    let mut limit = |path: &[&'static str], least, most| bars.push((path.to_vec(), least, most));
    limit(&["flat", "flat", "own_plane_rms_mm"], 0.0, 0.0205);
    limit(&["flat", "flat", "mean_height_mm"], -0.0005, 0.0005);
    limit(&["flat", "cloud", "outliers_over_1mm"], 0.0, 0.0);
    limit(&["flat", "cloud", "completeness_0.3"], 0.9999, 1.0);
    limit(&["steps", "steps", "tread_noise_rms_mm"], 0.0, 0.0209);
    limit(&["shiny", "cloud", "outliers_over_1mm"], 0.0, 0.0001);
    limit(&["shiny", "cloud", "rms_mm_without_outliers"], 0.0, 0.0448);
    for (set, rms, median, outliers, complete) in PRINTED_BARS {
        limit(&[set, "cloud", "rms_mm_without_outliers"], 0.0, rms);
        // Reported poses that scatter by 0.02 mm would leave 0.018.
        limit(&[set, "cloud", "median_mm"], 0.0, median);
        limit(&[set, "cloud", "outliers_over_1mm"], 0.0, outliers);
        limit(&[set, "cloud", "completeness_0.3"], complete, 1.0);
    }
    limit(&["scan_dimm", "cloud_part", "outliers_over_1mm"], 0.0, 0.0029);
    limit(&["scan_dimm", "cloud_part", "rms_mm_without_outliers"], 0.0, 0.0688);
    limit(&["scan_led_hires", "cloud", "rms_mm_without_outliers"], 0.0, 0.04);
    limit(&["scan_led_hires", "cloud", "median_mm"], 0.0, 0.013);
    limit(&["scan_led_hires", "cloud", "outliers_over_1mm"], 0.0, 0.0001);
    bars
}

/// Figures of noise and completeness: where a camera is turned they are held against those of the unturned one.
fn sizes(path: &[&str]) -> bool {
    ["rms", "completeness"].iter().any(|word| path[2].contains(word))
}

/// Share of a cloud's points beyond three of their standard deviations, at most; of Gaussian errors it would be 0.003.
const BEYOND: f64 = 0.01;
/// Share of the points within one, at least and at most. Of Gaussian errors it would be 0.68; most points lie where the
/// brightness does not change across the sheet as it might.
const WITHIN: [f64; 2] = [0.68, 0.88];

/// One line per cloud whose stated standard deviations are not those of its points.
fn dishonest(reference: &Path, cloud: &Path, mesh: &Path) -> Vec<String> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/common/honest.py");
    let run = Command::new("python3").arg(script).arg(reference.join("rendered")).args([cloud, mesh]).output();
    let done = run.expect("the scorer runs, so Python is there");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let text = String::from_utf8(done.stdout).unwrap();
    let shares: Vec<f64> = text.lines().map(|line| line.parse().unwrap()).collect();
    let [within, beyond] = shares[..] else { panic!("{text}") };
    println!("{}: {within:.3} within one sigma, {beyond:.4} beyond three", cloud.display());
    let mut faults = Vec::new();
    if beyond > BEYOND {
        faults.push(format!("{}: {beyond:.4} beyond three sigma, allowed {BEYOND}", cloud.display()));
    }
    if !(WITHIN[0]..=WITHIN[1]).contains(&within) {
        faults.push(format!("{}: {within:.3} within one sigma, allowed {WITHIN:?}", cloud.display()));
    }
    faults
}

/// One line per figure that is worse than its bar.
fn worse(score: &serde_json::Value, turned: bool) -> Vec<String> {
    let mut faults = Vec::new();
    for (path, least, most) in bars().into_iter().filter(|(path, ..)| !turned || !sizes(path)) {
        let value = figure(score, &path);
        if !(least..=most).contains(&value) {
            faults.push(format!("{} is {value:.5}, allowed {least}..={most}", path.join(" ")));
        }
    }
    for (set, most) in [("steps", 0.0025), ("shiny", 0.0043)] {
        for error in score[set]["steps"]["step_errors_mm"].as_array().expect("step errors") {
            let error = error.as_f64().expect("a number");
            if error.abs() > most {
                faults.push(format!("{set}: a step is wrong by {error:.4} mm, allowed {most}"));
            }
        }
    }
    faults
}

/// One line per figure of noise or completeness that a turn changes by more than 3 %; what is zero but for chance has
/// its bar.
fn changed(score: &serde_json::Value, straight: &serde_json::Value) -> Vec<String> {
    let paths = bars().into_iter().map(|(path, ..)| path);
    let pairs = paths.filter(|path| sizes(path)).map(|path| (figure(score, &path), figure(straight, &path), path));
    let off = pairs.filter(|(turned, straight, _)| (turned / straight - 1.0).abs() > 0.03);
    off.map(|(turned, straight, path)| format!("{} is {turned:.5}, {straight:.5} unturned", path.join(" "))).collect()
}

/// Scans a recording with a station's calibration; gives the cloud.
fn scan(recording: &Path, station: &str, on: &str, out: &Path) -> Vec<CloudPoint> {
    let [from, to] = [recording, out].map(|p| p.to_str().unwrap());
    // Rendered with the calibrated lens on a finer sensor; nothing in its files says so.
    let word: &[&str] = if recording.ends_with("scan_led_hires") { &["--same-view"] } else { &[] };
    let scan = ["scan", from, "--station", station, "--out", to, "--on", on, "--overlays", "0", "--quiet"];
    sheetlight(&[&scan[..], word].concat());
    read_cloud(&out.join("cloud.ply")).unwrap()
}

#[test]
fn scans_with_the_true_calibration_meet_their_bars() {
    let Some(reference) = reference("scan accuracy") else { return };
    for (inputs, truth) in rigs(&reference) {
        let dir = tempfile::tempdir().unwrap();
        let station = dir.path().join("station").to_str().unwrap().to_owned();
        let known = truth.join("flat/truth.json");
        sheetlight(&["station", "import", known.to_str().unwrap(), "--station", &station]);
        let mut sets = serde_json::Map::new();
        for set in SETS {
            let cloud = scan(&inputs.join(set), &station, "auto", &dir.path().join(set));
            let columns: BTreeSet<(u32, u32)> = cloud.iter().map(|p| (p.shot, (p.u + 0.5) as u32)).collect();
            let crossings = cloud.len() as f64 / columns.len() as f64;
            println!("{set}: {} points, {crossings:.3} a column", cloud.len());
            assert!(crossings <= CROSSINGS, "{set}: {} points in {} columns", cloud.len(), columns.len());
            sets.insert(set.into(), serde_json::json!({"cloud": format!("{set}/cloud.ply")}));
        }
        let estimate = dir.path().join("estimate.json");
        std::fs::write(&estimate, serde_json::json!({ "sets": sets }).to_string()).unwrap();
        let Some(score) = score(&reference, &estimate, &truth) else { return };
        let mut faults = worse(&score, false);
        for set in SETS {
            let [cloud, mesh] = [dir.path().join(set).join("cloud.ply"), truth.join(set).join("mesh.ply")];
            faults.extend(dishonest(&reference, &cloud, &mesh));
        }
        assert!(faults.is_empty(), "{}:\n{}", inputs.display(), faults.join("\n"));
    }
}

/// A rig whose stripe is slanted by 42 degrees: bars as those of the other, but for the rms, and how far aside a part's
/// pose may be, mm. Without the judgement of a line's ends the rms of two of them is 0.041 and 0.046.
const SLANTED_BARS: [(&str, f64, f64, f64, f64, f64); 3] = [
    ("scan_led", 0.04, 0.0187, 0.0002, 0.974, 0.025),
    ("scan_osc", 0.04, 0.018, 0.0001, 0.985, 0.015),
    ("scan_flash", 0.04, 0.0181, 0.0001, 0.98, 0.02),
];

/// Flanks of columns lie beside a slanted stripe's middle: with them these scans had 1.7 times the rms, four times the
/// outliers, a part was refused and another lay 0.05 mm aside.
#[test]
fn scans_under_a_slanted_stripe_meet_their_bars() {
    let Some(reference) = reference("slanted stripe") else { return };
    let [inputs, truth] = ["inputs", "truth"].map(|part| reference.join("rendered_slanted").join(part).join("slanted"));
    let dir = tempfile::tempdir().unwrap();
    let station = dir.path().join("station").to_str().unwrap().to_owned();
    sheetlight(&["station", "import", truth.join("flat/truth.json").to_str().unwrap(), "--station", &station]);
    let (mut sets, mut faults) = (serde_json::Map::new(), Vec::new());
    for (set, .., aside) in SLANTED_BARS {
        let out = dir.path().join(set);
        scan(&inputs.join(set), &station, "auto", &out);
        sets.insert(set.into(), serde_json::json!({"cloud": format!("{set}/cloud.ply")}));
        let recipe = format!(
            "{}/data/recipes/{}.toml",
            concat!(env!("CARGO_MANIFEST_DIR"), "/.."),
            set.trim_start_matches("scan_")
        );
        let [from, report] = [out.clone(), out.with_extension("json")].map(|p| p.to_str().unwrap().to_owned());
        sheetlight(&["find", &from, "--recipe", &recipe, "--station", &station, "--out", &report, "--quiet"]);
        let json =
            |path: &Path| -> serde_json::Value { serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap() };
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        let known = json(&truth.join(set).join("truth.json"))["base_T_part"].clone();
        let found = json(Path::new(&report))["poses"]["insertion"]["base_from_tool"].clone();
        let off = Vec3::from_fn(|i, _| number(&found[4 * i + 3]) - number(&known[4 * i + 3]));
        let along = |axis: usize| (0..3).map(|i| number(&known[4 * i + axis]) * off[i]).sum::<f64>();
        let is = along(0).hypot(along(1));
        println!("{set}: {is:.4} mm aside");
        if is > aside {
            faults.push(format!("{set}: the part is {is:.4} mm aside, allowed {aside}"));
        }
    }
    let estimate = dir.path().join("estimate.json");
    std::fs::write(&estimate, serde_json::json!({ "sets": sets }).to_string()).unwrap();
    let Some(score) = score(&reference, &estimate, &truth) else { return };
    for (set, rms, median, outliers, complete, _) in SLANTED_BARS {
        let [cloud, mesh] = [dir.path().join(set).join("cloud.ply"), truth.join(set).join("mesh.ply")];
        faults.extend(dishonest(&reference, &cloud, &mesh));
        for (name, least, most) in [
            ("rms_mm_without_outliers", 0.0, rms),
            ("median_mm", 0.0, median),
            ("outliers_over_1mm", 0.0, outliers),
            ("completeness_0.3", complete, 1.0),
        ] {
            let value = figure(&score, &[set, "cloud", name]);
            println!("{set} {name} {value:.5}");
            if !(least..=most).contains(&value) {
                faults.push(format!("{set} {name} is {value:.5}, allowed {least}..={most}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Print on the parts pulls points off their surfaces, as a sheet as thick as the rendered one does: without that the
/// rms is a twentieth less at least.
#[test]
fn what_the_sheets_thickness_does_is_taken_out() {
    let Some(reference) = reference("sheet thickness") else { return };
    for (inputs, truth) in rigs(&reference) {
        let dir = tempfile::tempdir().unwrap();
        let mut estimates = Vec::new();
        for thick_sheet in ["false", "true"] {
            let at = |name: &str| dir.path().join(thick_sheet).join(name);
            let (station, known) = (at("station"), truth.join("flat/truth.json"));
            sheetlight(&["station", "import", known.to_str().unwrap(), "--station", station.to_str().unwrap()]);
            let settings = std::fs::read_to_string(station.join("station.toml")).unwrap();
            assert!(settings.contains("thick_sheet = true"), "{settings}");
            let settings = settings.replace("thick_sheet = true", &format!("thick_sheet = {thick_sheet}"));
            std::fs::write(station.join("station.toml"), settings).unwrap();
            let mut sets = serde_json::Map::new();
            for set in PRINTED {
                scan(&inputs.join(set), station.to_str().unwrap(), "auto", &at(set));
                sets.insert(set.into(), serde_json::json!({"cloud": format!("{set}/cloud.ply")}));
                let found = load_report(&at(set)).unwrap().sheet;
                let Some(found) = found else {
                    assert!(thick_sheet == "false", "{set}: no thickness is found");
                    continue;
                };
                let known: serde_json::Value =
                    serde_json::from_slice(&std::fs::read(truth.join(set).join("truth.json")).unwrap()).unwrap();
                let is = figure(&known, &["laser_full_width_1_e2_at_waist_mm"]) / 4.0;
                println!("{set}: {found}; rendered with {is:.3} mm at the waist");
                assert!(thick_sheet == "true" && (0.75..1.3).contains(&(found.thickness_mm / is)), "{set}: {found:?}");
            }
            std::fs::write(at("estimate.json"), serde_json::json!({ "sets": sets }).to_string()).unwrap();
            let Some(score) = score(&reference, &at("estimate.json"), &truth) else { return };
            estimates.push(score);
        }
        for set in PRINTED {
            let [without, with] = [0, 1].map(|k| figure(&estimates[k], &[set, "cloud", "rms_mm_without_outliers"]));
            println!("{set}: rms {without:.4} -> {with:.4} mm");
            assert!(with < if set == "scan_flash" { 0.97 } else { 0.95 } * without, "{set}: {without} -> {with} mm");
        }
    }
}

/// The same points in the base frame of the recording that was not turned.
fn turned_back(mut cloud: Vec<CloudPoint>, steps: &[Step]) -> Vec<CloudPoint> {
    let m = turned::base_axes(steps).transpose();
    for p in &mut cloud {
        let turned: [f64; 3] = (m * p.at()).into();
        p.position = turned.map(|x| x as f32).into();
    }
    cloud
}

/// A camera that is turned sees the same: on the twins every turn, on the GPU one, which has to be the twins' cloud.
#[test]
fn a_turned_camera_sees_the_same_plate_on_both_processors() {
    let Some(reference) = reference("turned cameras") else { return };
    let (inputs, truth) = rigs(&reference).remove(0);
    let truth: serde_json::Value =
        serde_json::from_slice(&std::fs::read(truth.join("flat/truth.json")).unwrap()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let cloud = |steps: &[Step], on: &str| {
        let name = format!("{steps:?} {on}");
        let at = |part: &str| dir.path().join(format!("{name} {part}"));
        std::fs::write(at("known.json"), turned::calibration(&truth, steps).to_string()).unwrap();
        let station = at("station").to_str().unwrap().to_owned();
        sheetlight(&["station", "import", at("known.json").to_str().unwrap(), "--station", &station]);
        turned::recording(&inputs.join("flat"), &at("pictures"), steps, Some(18..28));
        turned_back(scan(&at("pictures"), &station, on, &at(on)), steps)
    };
    let known = &truth["plane_base"];
    let normal = Vec3::from_fn(|i, _| known["normal"][i].as_f64().unwrap());
    let known = Plane::<Base>::new(normal, known["offset_mm"].as_f64().unwrap()).unwrap();
    // The plate without the table beside it.
    let own_plane = |cloud: &[CloudPoint]| {
        let points = cloud.iter().map(|p| p.at());
        fit_plane::<Base>(&points.filter(|p| known.distance(p).abs() < 1.0).collect::<Vec<_>>()).expect("a plate")
    };
    let straight = cloud(&[], "cpu");
    let (plane, rms) = own_plane(&straight);
    let quarter = [Step::Quarter; 3];
    for steps in [&quarter[..1], &quarter[..2], &quarter, &[Step::Mirror], &[Step::Mirror, Step::Quarter]] {
        let twins = cloud(steps, "cpu");
        let (own, own_rms) = own_plane(&twins);
        let middle = straight[straight.len() / 2].at();
        let height = own.distance(&middle) * own.normal.dot(&plane.normal).signum() - plane.distance(&middle);
        let angle = plane.normal.cross(&own.normal).norm();
        println!(
            "{steps:?}: {} of {} points, rms {own_rms:.5} of {rms:.5} mm, {height:.5} mm off",
            twins.len(),
            straight.len()
        );
        assert!(twins.len().abs_diff(straight.len()) * 200 < straight.len(), "{steps:?}: {} points", twins.len());
        assert!((own_rms / rms - 1.0).abs() < 0.03, "{steps:?}: {own_rms} mm rms, unturned {rms}");
        assert!(height.abs() < 0.001 && angle < 1e-4, "{steps:?}: {height} mm and {angle} rad off");
        if steps.len() == 1 && common::device().is_some() {
            same(&format!("{steps:?}"), &cloud(steps, "gpu"), &twins);
        }
    }
}

/// One in twenty thousand may fall on the other side of a limit that it lies on.
fn same(name: &str, gpu: &[CloudPoint], twins: &[CloudPoint]) {
    let Apart { alone, worst_mm, equal } = apart(gpu, twins);
    println!(
        "{name}: {} points on the GPU, {equal} equal, {alone} without a twin, {worst_mm:.6} mm apart at most",
        gpu.len()
    );
    assert!(alone * 20_000 <= twins.len(), "{name}: {alone} of {} points have no twin", twins.len());
    assert!(worst_mm < 0.001, "{name}: GPU and twins are {worst_mm} mm apart");
}

/// Every recording, every turn, both processors, every figure: the long form.
#[test]
fn turned_cameras_meet_the_bars_and_the_unturned_figures() {
    if std::env::var_os("SHEETLIGHT_LONG").is_none() {
        return;
    }
    let Some(reference) = reference("turned cameras") else { return };
    let quarter = [Step::Quarter; 3];
    let turns: [&[Step]; 5] = [&[], &quarter[..1], &quarter[..2], &quarter, &[Step::Mirror]];
    for (inputs, truth) in rigs(&reference) {
        let known = serde_json::from_slice(&std::fs::read(truth.join("flat/truth.json")).unwrap()).unwrap();
        let mut straight = None;
        for steps in turns {
            let dir = tempfile::tempdir().unwrap();
            let at = |part: &str| dir.path().join(part);
            std::fs::write(at("known.json"), turned::calibration(&known, steps).to_string()).unwrap();
            let station = at("station").to_str().unwrap().to_owned();
            sheetlight(&["station", "import", at("known.json").to_str().unwrap(), "--station", &station]);
            let mut sets = serde_json::Map::new();
            for set in SETS {
                turned::recording(&inputs.join(set), &at("pictures"), steps, None);
                let [gpu, cpu] = ["gpu", "cpu"].map(|on| scan(&at("pictures"), &station, on, &at(on)));
                same(&format!("{steps:?}, {set}"), &gpu, &cpu);
                write_cloud(&at(&format!("{set}.ply")), &turned_back(gpu, steps)).unwrap();
                sets.insert(set.into(), serde_json::json!({"cloud": format!("{set}.ply")}));
                for used in ["pictures", "gpu", "cpu"] {
                    std::fs::remove_dir_all(at(used)).unwrap();
                }
            }
            let estimate = at("estimate.json");
            std::fs::write(&estimate, serde_json::json!({ "sets": sets }).to_string()).unwrap();
            let Some(score) = score(&reference, &estimate, &truth) else { return };
            let straight = straight.get_or_insert_with(|| score.clone());
            let faults = [worse(&score, !steps.is_empty()), changed(&score, straight)].concat();
            assert!(faults.is_empty(), "{}, {steps:?}:\n{}", inputs.display(), faults.join("\n"));
        }
    }
}
