//! In: pictures and height maps with a part among noise. Out: the coarse search gives the same matches, to the last
//! bit, whether its sums come from the CPU or from the WGSL stages. Frame and unit: pixels.

use crate::common;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use sheetlight::find::{
    Accelerator, Kind, Layer, Match, ModelOptions, Region, Scene, SearchOptions, ShapeModel, find, find_on,
};

/// An L with a notch at a place and turn, on noise, some cells missing.
fn layer(kind: Kind, w: usize, h: usize, x: f64, y: f64, angle: f64, holes: bool, seed: u64) -> Layer {
    let mut rng = Pcg64::seed_from_u64(seed);
    let (s, c) = angle.sin_cos();
    let values = (0..w * h)
        .map(|i| {
            let (dx, dy) = ((i % w) as f64 - x, (i / w) as f64 - y);
            let (px, py) = (c * dx + s * dy, c * dy - s * dx);
            let long = px.abs() < 30.0 && py.abs() < 10.0 && !(px.abs() < 4.0 && py > 4.0);
            let foot = (px - 24.0).abs() < 6.0 && (0.0..26.0).contains(&py);
            let noise: f64 = rng.random_range(-3.0..3.0);
            let missing = holes && rng.random_bool(0.02);
            if missing { f32::NAN } else { (if long || foot { 90.0 } else { 40.0 } + noise) as f32 }
        })
        .collect();
    Layer::new(kind, w, h, values).unwrap()
}

fn bits(found: &[Match]) -> Vec<[u64; 4]> {
    found.iter().map(|m| [m.pose.x, m.pose.y, m.pose.angle, m.score].map(f64::to_bits)).collect()
}

#[test]
fn the_gpu_finds_what_the_cpu_finds() {
    let Some(device) = common::device() else { return };
    let accelerator = Accelerator::on(&device).unwrap();
    let both = |angle: f64, holes: bool| {
        let layers = [Kind::Intensity, Kind::Height].map(|k| layer(k, 150, 110, 71.0, 52.0, angle, holes, 3));
        Scene::new(layers.to_vec(), None).unwrap()
    };
    let template = both(0.0, false);
    let region = Region { x0: 30, y0: 30, x1: 112, y1: 90 };
    let model = ShapeModel::from_region(&template, region, None, &ModelOptions::default()).unwrap();
    for (angle, ignore_polarity, max_levels) in [(0.4, false, 6), (2.9, true, 6), (-1.7, false, 1)] {
        let scene = both(angle, true);
        let model = ShapeModel { levels: model.levels[..max_levels.min(model.levels.len())].to_vec(), ..model.clone() };
        let options = SearchOptions { ignore_polarity, max_matches: 3, min_score: 0.5, ..SearchOptions::default() };
        let cpu = find(&scene, &model, &options).unwrap();
        let gpu = find_on(&scene, &model, &options, Some(&accelerator)).unwrap();
        assert!(!cpu.is_empty(), "nothing found at {angle}");
        assert_eq!(bits(&cpu), bits(&gpu), "turn {angle}");
    }
}

#[test]
fn a_lost_device_leaves_the_search_to_the_cpu() {
    let Some(device) = common::device() else { return };
    let accelerator = Accelerator::on(&device).unwrap();
    device.lose();
    let template = Scene::new(vec![layer(Kind::Height, 120, 90, 60.0, 45.0, 0.0, false, 1)], None).unwrap();
    let region = Region { x0: 20, y0: 25, x1: 100, y1: 80 };
    let model = ShapeModel::from_region(&template, region, None, &ModelOptions::default()).unwrap();
    let scene = Scene::new(vec![layer(Kind::Height, 120, 90, 64.0, 44.0, 0.9, false, 2)], None).unwrap();
    let options = SearchOptions::default();
    let cpu = find(&scene, &model, &options).unwrap();
    assert_eq!(bits(&cpu), bits(&find_on(&scene, &model, &options, Some(&accelerator)).unwrap()));
}

#[test]
fn the_rule_is_measured_and_weighs_both_sides() {
    use sheetlight::find::search::accelerator::Rule;
    let rule = Rule { fixed_s: 1e-3, here_s: 1e-11, cpu_s: 1e-10 };
    // Worth it from fixed / (cpu - here) on: 1.1e7 additions.
    assert!(!rule.pays(11_000_000) && rule.pays(11_200_000));
    assert!(!Rule { here_s: 2e-10, ..rule }.pays(u64::MAX), "slower an addition: never");
    let Some(device) = common::device() else { return };
    let measured = Accelerator::on(&device).unwrap().measured().unwrap();
    println!("{}: {measured:?}", device.info.name);
    // A search of no additions never pays; costs are those of a machine, not of a mistaken unit.
    assert!(!measured.pays(0) && (1e-5..1.0).contains(&measured.fixed_s), "{measured:?}");
    assert!([measured.here_s, measured.cpu_s].iter().all(|s| (1e-14..1e-6).contains(s)), "{measured:?}");
}
