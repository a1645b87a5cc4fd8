//! In: pictures of brackets with print that differs from one to the next, masks. Out: judgement on the second witness,
//! `--mask` and several examples in `sheetlight match` and `teach --region` run as commands.
//! Frame and unit: pixels, degrees.

use crate::common::{sheetlight, sheetlight_fails};
use crate::shapes::printed;
use serde_json::Value;
use sheetlight::find::Pose;
use sheetlight::raster::{Image, save_png};
use std::path::{Path, PathBuf};

const REGION: &str = "112,88,97,81";

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn pose(x: f64, y: f64, degrees: f64) -> Pose {
    Pose { x, y, angle: degrees.to_radians(), scale: 1.0 }
}

/// A folder with the part alone, three of them on a table, and two further examples.
fn pictures() -> (tempfile::TempDir, [PathBuf; 4]) {
    let dir = tempfile::tempdir().unwrap();
    let three = [pose(70.2, 70.7, 0.0), pose(200.4, 80.1, 41.0), pose(120.6, 190.3, -4.0)];
    let all: [(&str, &[Pose], u64); 4] = [
        ("part.png", &[pose(160.0, 128.0, 0.0)], 1),
        ("table.png", &three, 2),
        ("second.png", &[pose(140.3, 120.8, 30.0)], 3),
        ("third.png", &[pose(171.0, 131.5, -75.0)], 4),
    ];
    let files = all.map(|(name, poses, seed)| {
        let file = dir.path().join(name);
        save_png(&printed(poses, seed, false), &file).unwrap();
        file
    });
    (dir, files)
}

fn list(printed: &str) -> Vec<Value> {
    let said: Value = serde_json::from_str(printed).unwrap();
    said["pictures"][0]["matches"].as_array().unwrap().clone()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} of {value}"))
}

#[test]
fn the_correlation_is_listed_and_decides_below_the_score() {
    let (dir, [part, table, ..]) = pictures();
    let (part, table) = (text(&part), text(&table));
    let search = ["match", part, table, "--template-region", REGION, "--all", "--score", "0.8", "--json"];
    assert!(list(&sheetlight(&search)).is_empty(), "a stated score alone is a limit");
    let out = dir.path().join("found.json");
    let weak = [&search[..], &["--weak-score", "0.4", "--out", text(&out)]].concat();
    let found = list(&sheetlight(&weak));
    assert!(found.len() == 3, "{found:?}");
    assert!(found.iter().all(|m| number(m, "score") < 0.8 && number(m, "correlation") > 0.8), "{found:?}");
    let csv = std::fs::read_to_string(dir.path().join("found.csv")).unwrap();
    let mut lines = csv.lines();
    assert!(lines.next().unwrap().ends_with(",correlation"), "{csv}");
    let last = |line: &str| line.rsplit(',').next().unwrap().parse::<f64>().unwrap();
    assert!(lines.zip(&found).all(|(line, m)| (last(line) - number(m, "correlation")).abs() < 1e-4), "{csv}");
    let shown = sheetlight(&["match", part, table, "--template-region", REGION, "--all"]);
    assert!(shown.matches("correlation 0.").count() == 3, "{shown}");
}

#[test]
fn a_taught_file_holds_the_levels_and_an_older_one_works_without() {
    let (dir, [part, table, ..]) = pictures();
    let file = dir.path().join("taught.json");
    sheetlight(&["teach", text(&part), "--name", "bracket", "--region", REGION, "--out", text(&file)]);
    let search = ["match", text(&file), text(&table), "--all", "--json", "--score", "0.45"];
    let new = list(&sheetlight(&search));
    assert!(new.len() == 3 && new.iter().all(|m| number(m, "correlation") > 0.8), "{new:?}");
    let mut taught: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    assert!(taught.as_object_mut().unwrap().remove("levels").is_some());
    std::fs::write(&file, taught.to_string()).unwrap();
    let old = list(&sheetlight(&search));
    assert!(old.len() == 3 && old.iter().all(|m| m["correlation"].is_null()), "{old:?}");
    assert!(old.iter().zip(&new).all(|(a, b)| a["x_px"] == b["x_px"] && a["score"] == b["score"]));
}

#[test]
fn a_mask_of_the_picture_or_of_its_region_excludes_edges_and_levels() {
    let (dir, [part, table, ..]) = pictures();
    let at = |name: &str| dir.path().join(name);
    let save = |name: &str, w: u32, h: u32, counts: &dyn Fn(u32, u32) -> bool| {
        let pixels = (0..w * h).map(|i| if counts(i % w, i / w) { 255 } else { 0 }).collect();
        save_png(&Image::from_u8(w, h, pixels), &at(name)).unwrap();
        at(name)
    };
    // Of the region the part from column 149 on counts, its right 60 px.
    let whole = save("whole.png", 320, 256, &|x, y| !(112..149).contains(&x) || !(88..169).contains(&y));
    let own = save("own.png", 97, 81, &|x, _| x >= 37);
    let other = save("other.png", 97, 80, &|_, _| true);
    let teach = |mask: &Path| {
        let file = at("masked.json");
        let named = ["teach", text(&part), "--name", "bracket", "--region", REGION, "--out", text(&file), "--json"];
        serde_json::from_str::<Value>(&sheetlight(&[&named[..], &["--mask", text(mask)]].concat())).unwrap()
    };
    let (a, b) = (teach(&whole), teach(&own));
    assert!(a["model"] == b["model"] && a["levels"] == b["levels"], "two forms of one mask");
    let edges = a["model"]["levels"][0].as_array().unwrap();
    assert!(edges.len() > 50 && edges.iter().all(|p| number(p, "x") > -12.0), "{} edges", edges.len());
    let search = ["match", text(&part), text(&table), "--template-region", REGION, "--all", "--json"];
    let found = list(&sheetlight(&[&search[..], &["--mask", text(&own)]].concat()));
    assert!(found.iter().any(|m| (number(m, "x_px") - 70.2).hypot(number(m, "y_px") - 70.7) < 0.5), "{found:?}");
    let (_, said) = sheetlight_fails(&[&search[..], &["--mask", text(&other)]].concat());
    assert!(["97x80", "320x256", "97x81"].iter().all(|size| said.contains(size)), "{said}");
    let none = save("none.png", 97, 81, &|_, _| false);
    let (_, said) = sheetlight_fails(&[&search[..], &["--mask", text(&none)]].concat());
    assert!(said.contains("edge places"), "{said}");
    let file = at("masked.json");
    let (_, said) = sheetlight_fails(&["match", text(&file), text(&table), "--mask", text(&own)]);
    assert!(said.contains("--mask with a taught part"), "{said}");
}

#[test]
fn several_examples_keep_what_they_share() {
    let (dir, [part, table, second, third]) = pictures();
    let file = dir.path().join("bracket.json");
    let named = ["--name", "bracket", "--region", REGION, "--out", text(&file)];
    let said = sheetlight(&[&["teach", text(&part), text(&second), text(&third)], &named[..]].concat());
    assert!(said.contains("second.png: at 140.") && said.contains("of the first example stayed"), "{said}");
    let search = |template: &str, more: &[&str]| {
        list(&sheetlight(&[&["match", template, text(&table), "--all", "--json"], more].concat()))
    };
    let shared = search(text(&file), &["--score", "0.8"]);
    assert!(shared.len() == 3 && shared.iter().all(|m| number(m, "correlation") > 0.95), "{shared:?}");
    assert!(search(text(&part), &["--template-region", REGION, "--score", "0.8"]).is_empty());
    let empty = dir.path().join("empty.png");
    save_png(&printed(&[], 5, false), &empty).unwrap();
    let (_, words) = sheetlight_fails(&[&["teach", text(&part), text(&empty)], &named[..]].concat());
    assert!(words.contains("not found in empty.png"), "{words}");
    let (_, words) = sheetlight_fails(&[&["teach", text(&part), text(dir.path())], &named[..]].concat());
    assert!(words.contains("scan among several examples"), "{words}");
}
