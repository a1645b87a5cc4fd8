//! In: pictures with several equal parts, drawn here. Out: judgement on `sheetlight match` and `teach --region` run
//! as commands.
//! Frame and unit: pixels, degrees.

use crate::common::{sheetlight, sheetlight_fails};
use crate::shapes::{cover, part};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use serde_json::Value;
use sheetlight::find::Pose;
use sheetlight::raster::{Image, save_png};
use std::path::Path;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Writes a noisy picture with a part at each pose.
fn save(path: &Path, poses: &[Pose]) {
    let (mut rng, noise) = (Pcg64::seed_from_u64(4), Normal::new(0.0, 3.0).unwrap());
    let mut level = |x: f64, y: f64| -> u8 {
        let drawn = poses.iter().fold(60.0, |v, pose| {
            let (s, c) = pose.angle.sin_cos();
            let (dx, dy) = (x - pose.x, y - pose.y);
            v + (170.0 - v) * cover(part(c * dx + s * dy, c * dy - s * dx))
        });
        (drawn + noise.sample(&mut rng)).round() as u8
    };
    let pixels = (0..320 * 256).map(|i| level(f64::from(i % 320), f64::from(i / 320))).collect();
    save_png(&Image::from_u8(320, 256, pixels), path).unwrap();
}

fn pose(x: f64, y: f64, degrees: f64) -> Pose {
    Pose { x, y, angle: f64::to_radians(degrees), scale: 1.0 }
}

fn matches(printed: &str) -> Vec<(f64, f64, f64)> {
    let said: Value = serde_json::from_str(printed).unwrap();
    let list = said["pictures"][0]["matches"].as_array().unwrap().clone();
    let number = |m: &Value, key: &str| m[key].as_f64().unwrap();
    list.iter().map(|m| (number(m, "x_px"), number(m, "y_px"), number(m, "angle_deg"))).collect()
}

fn near(found: &[(f64, f64, f64)], want: &Pose) -> bool {
    found.iter().any(|f| (f.0 - want.x).hypot(f.1 - want.y) < 0.1 && (f.2 - want.angle.to_degrees()).abs() < 0.15)
}

#[test]
fn all_instances_are_found_taught_or_cut_out_and_ranges_and_regions_hold() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    // The template's middle is the part's origin; three parts lie in the searched picture.
    save(&at("part.png"), &[pose(160.0, 128.0, 0.0)]);
    let three = [pose(70.2, 70.7, 0.0), pose(200.4, 80.1, 41.0), pose(120.6, 190.3, -4.0)];
    save(&at("table.png"), &three);
    let region = "112,88,97,81";
    let (part, table, file) = (at("part.png"), at("table.png"), at("b.json"));
    let cut = ["match", text(&part), text(&table), "--template-region", region, "--all", "--json"];
    let out = at("found.json");
    let found = matches(&sheetlight(&[&cut[..], &["--out", text(&out)]].concat()));
    assert!(found.len() == 3 && three.iter().all(|p| near(&found, p)), "{found:?}");
    let csv = std::fs::read_to_string(at("found.csv")).unwrap();
    assert_eq!(csv.lines().count(), 4, "{csv}");
    assert!(at("found.png").exists() && out.exists());

    sheetlight(&[
        "teach",
        text(&at("part.png")),
        "--name",
        "bracket",
        "--region",
        region,
        "--out",
        text(&at("b.json")),
    ]);
    assert!(at("b.png").exists());
    let taught = ["match", text(&file), text(&table), "--all", "--json"];
    assert_eq!(matches(&sheetlight(&taught)).len(), 3);
    // A range limits the result: the part at 41 degrees is none of ±5, and a part's turn is told within the range.
    let five = matches(&sheetlight(&[&taught[..], &["--angles", "-5..5"]].concat()));
    assert!(five.len() == 2 && near(&five, &three[0]) && near(&five, &three[2]), "{five:?}");
    let far = matches(&sheetlight(&[&taught[..], &["--angles", "355..400"]].concat()));
    assert!(far.iter().all(|f| (354.9..400.1).contains(&f.2)) && far.len() == 2, "{far:?}");
    let left = matches(&sheetlight(&[&taught[..], &["--region", "0,0,150,256"]].concat()));
    assert!(left.len() == 2 && near(&left, &three[0]) && near(&left, &three[2]), "{left:?}");
    let corner = matches(&sheetlight(&[&taught[..], &["--polygon", "100,0,319,0,319,255"]].concat()));
    assert!(corner.len() == 1 && near(&corner, &three[1]), "{corner:?}");
    assert!(matches(&sheetlight(&[&taught[..], &["--score", "1"]].concat())).is_empty(), "nothing found is an answer");
}

#[test]
fn what_cannot_be_searched_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    save(&at("part.png"), &[pose(160.0, 128.0, 0.0)]);
    let part = at("part.png");
    std::fs::write(at("no.json"), "{}").unwrap();
    let refused: [(&[&str], &str); 6] = [
        (&["--template-region", "300,0,100,100"], "does not lie in"),
        (&["--template-region", "2,2,20,20"], "edge places"),
        (&["--region", "5000,0,10,10"], "outside the picture"),
        (&["--polygon", "0,0,5,5"], "corners"),
        (&["--angles", "5..-5"], "angles_deg"),
        (&["--out", text(&part)], "would replace"),
    ];
    for (more, word) in refused {
        let (_, said) = sheetlight_fails(&[&["match", text(&part), text(&part)], more].concat());
        assert!(said.contains(word), "{more:?}: {said}");
    }
    let (_, said) = sheetlight_fails(&["match", text(&at("no.json")), text(&part)]);
    assert!(said.contains("not a taught part"), "{said}");
}
