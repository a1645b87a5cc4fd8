//! In: pairs of height maps with missing cells, spikes and a sensor's noise; the part is taught by a region of the
//! first. Out: judgement on place, turn, recall and false places in the second (truth is known). SHEETLIGHT_LONG: more
//! pairs.
//! Frame and unit: cells and degrees; heights in mm.

use crate::common::{sheetlight, sheetlight_fails};
use crate::shapes::{boxed, cover, disc, part};
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::find::{ModelOptions, Pose, Scene, SearchOptions, Template, find_in};
use sheetlight::geometry::Rigid;
use sheetlight::scan::HeightMap;

const W: u32 = 300;
const H: u32 = 260;
/// Cell of the first map, mm.
const CELL: f64 = 0.1;
/// Height of the part, mm.
const HIGH: f64 = 1.5;

/// A map in which `missing` of the cells have no height, half of them single and half in spots of up to 11 cells. One
/// cell in 500 is a spike.
fn seen(missing: f64, noise: f64, pose: Option<Pose>, clutter: usize, rng: &mut Pcg64) -> HeightMap {
    let (w, h) = (W as usize, H as usize);
    let places: Vec<(f64, f64, f64, f64)> = (0..clutter)
        .map(|_| {
            let [x, y] = [W, H].map(|n| rng.random_range(0.0..f64::from(n)));
            (x, y, rng.random_range(4.0..20.0), rng.random_range(-1.0..2.0))
        })
        .collect();
    let tilt = [rng.random_range(-0.01..0.01), rng.random_range(-0.01..0.01)];
    let own = |x: f64, y: f64| {
        let Some(p) = pose else { return 0.0 };
        let (s, c) = p.angle.sin_cos();
        let (dx, dy) = ((x - p.x) / p.scale, (y - p.y) / p.scale);
        cover(part(c * dx + s * dy, c * dy - s * dx))
    };
    let height = |x: f64, y: f64| {
        let beside = |&(cx, cy, r, z): &(f64, f64, f64, f64)| {
            let shape = if z > 0.5 { boxed(x, y, cx, cy, r, 0.6 * r) } else { disc(x, y, cx, cy, r) };
            z * cover(shape)
        };
        let share = own(x, y);
        let others: f64 = places.iter().map(beside).sum();
        tilt[0] * x + tilt[1] * y + share * HIGH + (1.0 - share) * others
    };
    let mut z: Vec<f64> = (0..w * h).map(|i| height((i % w) as f64, (i / w) as f64)).collect();
    let mut hidden = vec![false; w * h];
    let mut left = (missing * (w * h) as f64) as usize;
    while left > 0 {
        let (x, y) = (rng.random_range(0..w) as i64, rng.random_range(0..h) as i64);
        let r = if rng.random_bool(0.05) { rng.random_range(1..6i64) } else { 0 };
        for (dx, dy) in (-r..=r).flat_map(|dy| (-r..=r).map(move |dx| (dx, dy))).filter(|(x, y)| x * x + y * y <= r * r)
        {
            let (x, y) = (x + dx, y + dy);
            if (0..w as i64).contains(&x) && (0..h as i64).contains(&y) && left > 0 {
                let cell = &mut hidden[y as usize * w + x as usize];
                left -= usize::from(!*cell);
                *cell = true;
            }
        }
    }
    let normal = Normal::new(0.0, noise).unwrap();
    for z in &mut z {
        *z += normal.sample(rng) + if rng.random_bool(0.002) { rng.random_range(-1.0..1.0) } else { 0.0 };
    }
    let mut map = HeightMap::empty(W, H, CELL, Rigid::identity());
    map.z = z.iter().zip(hidden).map(|(z, hidden)| if hidden { f32::NAN } else { *z as f32 }).collect();
    map
}

struct Tried {
    found: bool,
    false_place: bool,
    off: [f64; 2],
}

fn tried(draw: u64) -> Tried {
    let mut rng = Pcg64::seed_from_u64(draw);
    let (missing, noise) = (rng.random_range(0.05..0.3), rng.random_range(0.01..0.06));
    let first = Pose { x: 149.5, y: 129.5, angle: 0.0, scale: 1.0 };
    let taught = seen(missing, noise, Some(first), 0, &mut rng);
    let region = Some([100, 80, 100, 100]);
    let source = ("first".to_string(), "0".to_string());
    let template = Template::teach_map("bracket", &taught, region, source, &ModelOptions::default()).unwrap();
    let there = Pose {
        x: rng.random_range(80.0..220.0),
        y: rng.random_range(70.0..190.0),
        angle: rng.random_range(-3.1..3.1),
        scale: 1.0,
    };
    let search = |map: &HeightMap| {
        find_in(&Scene::from_heights(map).unwrap(), &template.model, &SearchOptions::default(), None, None).unwrap()
    };
    let matches = search(&seen(missing, noise, Some(there), 5, &mut rng));
    let empty = search(&seen(missing, noise, None, 12, &mut rng));
    let off = matches.first().map_or([f64::INFINITY; 2], |m| {
        let turn =
            (m.pose.angle - there.angle + 9.0 * std::f64::consts::PI) % std::f64::consts::TAU - std::f64::consts::PI;
        [(m.pose.x - there.x).hypot(m.pose.y - there.y), turn.to_degrees().abs()]
    });
    let found = off[0] < 0.1 && off[1] < 0.1;
    let strange = !empty.is_empty() || (!matches.is_empty() && off[0] > 2.0);
    let score = matches.first().map_or(0.0, |m| m.score);
    println!(
        "pair {draw}: {missing:.2} missing, noise {noise:.3} mm: {:.3} px, {:.3} degrees, score {score:.2}",
        off[0], off[1]
    );
    Tried { found, false_place: strange, off }
}

#[test]
fn a_part_taught_by_a_region_of_one_map_is_found_in_another() {
    let pairs = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 400 } else { 30 };
    let all: Vec<Tried> = (0..pairs).into_par_iter().map(tried).collect();
    let count = |of: fn(&Tried) -> bool| all.iter().filter(|t| of(t)).count() as u64;
    let (found, strange) = (count(|t| t.found), count(|t| t.false_place));
    let mut off: Vec<f64> = all.iter().map(|t| t.off[0]).collect();
    off.sort_by(f64::total_cmp);
    println!(
        "{found} of {pairs} within 0.1 px and 0.1 degrees, median {:.3} px; {strange} false places",
        off[off.len() / 2]
    );
    assert!(found * 100 >= pairs * 97, "{found} of {pairs} are found");
    assert_eq!(strange, 0, "false places");
}

#[test]
fn scans_are_taught_and_matched_by_commands_and_other_cells_and_pictures_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let mut rng = Pcg64::seed_from_u64(77);
    let pose = |x: f64, y: f64, angle: f64, scale: f64| Some(Pose { x, y, angle, scale });
    seen(0.1, 0.02, pose(149.5, 129.5, 0.0, 1.0), 0, &mut rng).save(dir.path().join("first").as_path()).unwrap();
    seen(0.1, 0.02, pose(120.2, 140.7, 0.5, 1.0), 3, &mut rng).save(dir.path().join("second").as_path()).unwrap();
    // The same part in cells of another width.
    let mut coarse = seen(0.1, 0.02, pose(160.4, 110.3, -0.8, 0.8), 0, &mut rng);
    coarse.cell = 0.125;
    coarse.save(dir.path().join("coarse").as_path()).unwrap();
    let (first, second, file) = (at("first"), at("second"), at("bracket.json"));
    sheetlight(&["teach", &first, "--name", "bracket", "--region", "100,80,100,100", "--out", &file]);
    assert!(dir.path().join("bracket.png").exists());
    let found = sheetlight(&["match", &file, &second, &at("coarse"), "--json", "--out", &at("found.json")]);
    let said: serde_json::Value = serde_json::from_str(&found).unwrap();
    let number = |k: usize, key: &str| said["pictures"][k]["matches"][0][key].as_f64().unwrap();
    for (k, x, y, turn, cell) in [(0, 120.2, 140.7, 0.5f64, CELL), (1, 160.4, 110.3, -0.8, 0.125)] {
        let off = (number(k, "x_px") - x).hypot(number(k, "y_px") - y);
        assert!(off < 0.1 && (number(k, "angle_deg") - turn.to_degrees()).abs() < 0.1, "{found}");
        assert!((number(k, "x_mm") - (number(k, "x_px") + 0.5) * cell).abs() < 1e-9, "{found}");
        assert_eq!(number(k, "scale"), 1.0, "{found}");
    }
    assert!(said["units"] == "px, mm, degrees" && said["template"]["mm_per_px"] == CELL, "{found}");
    // The map of the first scan is its own template as well.
    let own = sheetlight(&["match", &first, &second, "--template-region", "100,80,100,100", "--json"]);
    assert_eq!(serde_json::from_str::<serde_json::Value>(&own).unwrap()["pictures"][0], said["pictures"][0]);

    let picture = format!("{first}/height_picture.png");
    let (code, words) = sheetlight_fails(&["match", &file, &picture]);
    assert!(code == 2 && words.contains("a picture is searched for a part that a height map taught"), "{words}");
    let (code, words) = sheetlight_fails(&["match", &picture, &second]);
    assert!(code == 2 && words.contains("a height map is searched for a part that a picture taught"), "{words}");
    coarse.cell = 0.3;
    coarse.save(dir.path().join("coarse").as_path()).unwrap();
    let (code, words) = sheetlight_fails(&["match", &file, &at("coarse")]);
    assert!(code == 1 && words.contains("cells are 0.3 mm wide, those of the template 0.1 mm"), "{words}");
    let (_, words) = sheetlight_fails(&["match", &file, &second, "--out", &format!("{second}/height.json")]);
    assert!(words.contains("height.json"), "{words}");
}
