//! In: a picture of 1280x1024 and a height map of 2000x2000 with one part among clutter, drawn here. Out: time of a
//! full 360-degree search to the refined pose, and of the coarse search alone on the CPU and through the WGSL stages.
//! Frame and unit: milliseconds; benches/peers/find.py measures OpenCV on the same input, which is left in
//! target/find-bench with the size of the model.

use criterion::{Criterion, criterion_group, criterion_main};
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::find::{
    Accelerator, Kind, Layer, ModelOptions, Pose, Region, Scene, SearchOptions, ShapeModel, find, find_on,
};
use sheetlight::gpu::Device;
use sheetlight::raster::{Image, save_png};
use std::hint::black_box;
use std::path::Path;

/// The program's own.
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn boxed(x: f64, y: f64, cx: f64, cy: f64, hw: f64, hh: f64) -> f64 {
    let (dx, dy) = ((x - cx).abs() - hw, (y - cy).abs() - hh);
    dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0)
}

/// A bracket: a plate with a foot, two holes and a slot, about 68 x 54 units; no symmetry.
fn part(x: f64, y: f64) -> f64 {
    let plate = boxed(x, y, 0.0, 0.0, 34.0, 18.0).min(boxed(x, y, 26.0, 22.0, 8.0, 14.0));
    let disc = |cx: f64, cy: f64, r: f64| (x - cx).hypot(y - cy) - r;
    plate.max(-disc(-20.0, 4.0, 6.0).min(disc(2.0, -6.0, 4.0)).min(boxed(x, y, 18.0, 2.0, 9.0, 2.5)))
}

fn cover(distance: f64) -> f64 {
    1.0 / (1.0 + (1.702 * distance / 0.8).exp())
}

/// A picture in 8-bit levels: the part `size` px a unit, `clutter` boxes, noise of 4 levels.
fn drawn(w: usize, h: usize, pose: &Pose, clutter: usize) -> Vec<u8> {
    let mut rng = Pcg64::seed_from_u64(7 + w as u64);
    let mut pick = |a: f64, b: f64| rng.random_range(a..b);
    let boxes: Vec<[f64; 5]> = (0..clutter)
        .map(|_| {
            let size = [pick(8.0, 60.0), pick(8.0, 60.0)];
            [pick(0.0, w as f64), pick(0.0, h as f64), size[0], size[1], pick(30.0, 140.0)]
        })
        .collect();
    let (s, c) = pose.angle.sin_cos();
    let rows = (0..h).into_par_iter().flat_map_iter(|y| {
        let mut rng = Pcg64::seed_from_u64(y as u64);
        let grain = Normal::new(0.0, 4.0).expect("positive");
        let near: Vec<[f64; 5]> = boxes.iter().copied().filter(|b| (y as f64 - b[1]).abs() < b[3] + 4.0).collect();
        let row: Vec<u8> = (0..w)
            .map(|x| {
                let (fx, fy) = (x as f64, y as f64);
                let mut v = 60.0;
                for b in &near {
                    v += (b[4] - v) * cover(boxed(fx, fy, b[0], b[1], b[2], b[3]));
                }
                let (dx, dy) = ((fx - pose.x) / pose.scale, (fy - pose.y) / pose.scale);
                v += (180.0 - v) * cover(part(c * dx + s * dy, c * dy - s * dx) * pose.scale);
                (v + grain.sample(&mut rng)).round().clamp(0.0, 255.0) as u8
            })
            .collect();
        row
    });
    rows.collect()
}

struct Task {
    name: &'static str,
    scene: Scene,
    model: ShapeModel,
    truth: Pose,
}

/// A scene and the model of its part, learned from another picture of it.
fn task(name: &'static str, w: usize, h: usize, kind: Kind, size: f64) -> Task {
    let truth = Pose { x: 0.61 * w as f64, y: 0.43 * h as f64, angle: 2.1, scale: size };
    let taught = Pose { x: 50.0 * size + 0.3, y: 50.0 * size + 0.4, angle: 0.0, scale: size };
    let side = (100.0 * size) as usize;
    let scene = |w: usize, h: usize, pixels: &[u8]| {
        // A height map: 0.02 mm a level.
        let unit = if kind == Kind::Height { 0.02 } else { 1.0 };
        let values = pixels.iter().map(|&v| unit * f32::from(v)).collect();
        Scene::new(vec![Layer::new(kind, w, h, values).expect("its size")], None).expect("one layer")
    };
    let (picture, template) = (drawn(w, h, &truth, 60), drawn(side, side, &taught, 0));
    let region = Region { x0: 0, y0: 0, x1: side, y1: side };
    let model = ShapeModel::from_region(
        &scene(side, side, &template),
        region,
        Some([taught.x, taught.y]),
        &ModelOptions::default(),
    )
    .expect("a clear outline");
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("target/find-bench");
    std::fs::create_dir_all(&folder).expect("target can be written");
    let keep = |what: &str, w: usize, h: usize, pixels: &[u8]| {
        let image = Image::from_u8(w as u32, h as u32, pixels.to_vec());
        save_png(&image, &folder.join(format!("{name} {what}.png"))).expect("target can be written");
    };
    keep("scene", w, h, &picture);
    keep("template", side, side, &template);
    let said = serde_json::json!({"radius": model.radius, "levels": model.levels.len(),
        "x": truth.x, "y": truth.y, "angle_deg": truth.angle.to_degrees(), "centre": [taught.x, taught.y]});
    std::fs::write(folder.join(format!("{name}.json")), said.to_string()).expect("target can be written");
    Task { name, scene: scene(w, h, &picture), model, truth }
}

fn benches(c: &mut Criterion) {
    let tasks = [
        task("picture 1280x1024", 1280, 1024, Kind::Intensity, 1.5),
        task("height map 2000x2000", 2000, 2000, Kind::Height, 3.0),
    ];
    let options = SearchOptions::default();
    let device = Device::open();
    let accelerator = device.as_ref().ok().and_then(|d| Accelerator::on(d).ok());
    if let Some(rule) = accelerator.as_ref().and_then(|a| a.measured().ok()) {
        println!("coarse search, s: {rule:?}");
    }
    let mut group = c.benchmark_group("find");
    group.sample_size(10);
    for t in &tasks {
        let found = find(&t.scene, &t.model, &options).expect("valid options");
        let off = found.first().map_or(f64::MAX, |m| (m.pose.x - t.truth.x).hypot(m.pose.y - t.truth.y));
        assert!(off < 0.2, "{}: {off} px off", t.name);
        println!("{}: {} levels, radius {:.0} px, {off:.3} px off", t.name, t.model.levels.len(), t.model.radius);
        group.bench_function(t.name, |b| b.iter(|| find(black_box(&t.scene), &t.model, &options)));
        // Fewer levels: the coarse search dominates, as for long parts.
        let fine = ShapeModel { levels: t.model.levels[..2].to_vec(), ..t.model.clone() };
        group
            .bench_function(format!("{}, 2 levels", t.name), |b| b.iter(|| find(black_box(&t.scene), &fine, &options)));
        if let Some(a) = &accelerator {
            assert_eq!(
                format!("{:?}", find_on(&t.scene, &fine, &options, Some(a))),
                format!("{:?}", find(&t.scene, &fine, &options)),
                "the same matches"
            );
            let name = format!("{}, 2 levels, WGSL stages", t.name);
            group.bench_function(name, |b| b.iter(|| find_on(black_box(&t.scene), &fine, &options, Some(a))));
        }
    }
}

criterion_group!(group, benches);
criterion_main!(group);
