//! In: height maps of a socket with windows, as a line scan sees it: what is low beside a wall is in the camera's
//! shadow, and missing.
//! Out: judgement on where it is found. Frame and unit: cells of the map, mm.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use sheetlight::find::{Kind, Layer, Recipe, Scene, SearchOptions, ShapeModel, find};
use std::f64::consts::PI;
use std::path::Path;

const CELL_MM: f64 = 0.45;
const W: usize = 110;
const H: usize = 150;

/// Whether data/recipes/led.toml has a contact's funnel at a place of the part, mm; hardly any of its light comes back.
fn funnel(x: f64, y: f64) -> bool {
    let (dx, dy) = ((x / 2.54).floor() * 2.54 + 1.27 - x, y.abs() - 7.62);
    x.abs() < 15.24 && dx.hypot(dy) < 0.8
}

/// Whether it has material there.
fn body(x: f64, y: f64) -> bool {
    let window = (x.abs() - 7.12).abs() < 5.52 && y.abs() < 6.2;
    x.abs() < 15.24 && y.abs() < 8.89 && !window && (x + 15.24).hypot(y) > 1.5
}

/// A map of the part at a place (cells) and turn; `shadow` mm beside whatever stands 4.2 mm high are missing, towards
/// larger x.
fn map(x: f64, y: f64, turn: f64, shadow: f64, rng: &mut Pcg64) -> Scene {
    let (s, c) = turn.sin_cos();
    let place = |u: f64, v: f64| {
        let (dx, dy) = ((u - x) * CELL_MM, (v - y) * CELL_MM);
        (c * dx + s * dy, c * dy - s * dx)
    };
    let high = |u: f64, v: f64| {
        let (x, y) = place(u, v);
        body(x, y)
    };
    let dark: Vec<bool> = (0..W * H).map(|_| rng.random_bool(0.6)).collect();
    let noise = Normal::new(0.0, 0.02).unwrap();
    let cell = |i: usize| {
        let (u, v) = ((i % W) as f64, (i / W) as f64);
        let steps = (shadow / CELL_MM / 0.25) as i32;
        let (px, py) = place(u, v);
        match high(u, v) {
            true if funnel(px, py) => {
                if dark[i] {
                    f64::NAN
                } else {
                    3.4
                }
            }
            true => 4.2,
            false if (1..=steps).any(|k| high(u - 0.25 * f64::from(k), v)) => f64::NAN,
            false => 0.0,
        }
    };
    let values = (0..W * H).map(|i| (cell(i) + noise.sample(rng)) as f32).collect();
    Scene::new(vec![Layer::new(Kind::Height, W, H, values).unwrap()], Some(CELL_MM)).unwrap()
}

/// A shadow's cells count half, so a pose as far off as a shadow is wide scores well too: it has to be climbed down
/// from.
#[test]
fn a_part_is_found_where_it_stands_and_not_a_shadow_beside() {
    let recipe = Recipe::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("data/recipes/led.toml")).unwrap();
    let model = ShapeModel::from_drawing(&recipe.drawing(), CELL_MM, Kind::Height, &recipe.model).unwrap();
    let mut rng = Pcg64::seed_from_u64(5);
    // The widest shadows leave little more than half of the edges.
    let options = SearchOptions { min_score: 0.4, max_matches: 3, ..SearchOptions::default() };
    let mut wrong = Vec::new();
    for k in 0..60 {
        let (x, y) = (rng.random_range(48.0..60.0), rng.random_range(65.0..80.0));
        // With long walls across the shadows, and turned by anything.
        let turn = if k % 2 == 0 { PI / 2.0 + rng.random_range(-0.15..0.15) } else { rng.random_range(-PI..PI) };
        let shadow = [1.5, 2.3, 3.1][k / 2 % 3];
        let found = find(&map(x, y, turn, shadow, &mut rng), &model, &options).unwrap();
        // The part looks nearly alike when turned by half: which of the two it is, its points tell later.
        let off = found.first().map_or(f64::INFINITY, |m| (m.pose.x - x).hypot(m.pose.y - y));
        if off > 1.5 {
            wrong.push(format!("{k}: {off:.1} cells off, shadow {shadow} mm, turned {:.0} degrees", turn.to_degrees()));
        }
    }
    assert!(wrong.is_empty(), "{} of 60:\n{}", wrong.len(), wrong.join("\n"));
}
