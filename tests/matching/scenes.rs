//! In: seeds. Out: pictures drawn from exact shapes, parts at any place, turn and size.
//! Frame and unit: pixels; greys of 8 bits.

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use sheetlight::find::{Kind, Layer, ModelOptions, Pose, Region, Scene, ShapeModel};

pub const W: usize = 320;
pub const H: usize = 256;
const BLUR: f64 = 0.8;

fn boxed(x: f64, y: f64, cx: f64, cy: f64, hw: f64, hh: f64) -> f64 {
    let (dx, dy) = ((x - cx).abs() - hw, (y - cy).abs() - hh);
    dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0)
}

fn disc(x: f64, y: f64, cx: f64, cy: f64, r: f64) -> f64 {
    (x - cx).hypot(y - cy) - r
}

/// Signed distance to a part's material, negative inside; none is symmetric.
pub type Part = fn(f64, f64) -> f64;

/// A plate with a foot, two holes and a slot.
pub fn bracket(x: f64, y: f64) -> f64 {
    let plate = boxed(x, y, 0.0, 0.0, 34.0, 18.0).min(boxed(x, y, 26.0, 22.0, 8.0, 14.0));
    let holes = disc(x, y, -20.0, 4.0, 6.0).min(disc(x, y, 2.0, -6.0, 4.0)).min(boxed(x, y, 18.0, 2.0, 9.0, 2.5));
    plate.max(-holes)
}

/// Share of a blurred edge at a signed distance.
fn cover(distance: f64) -> f64 {
    1.0 / (1.0 + (1.702 * distance / BLUR).exp())
}

/// Parts, their poses (the scale is their size) and greys.
pub struct Picture {
    pub parts: Vec<(Part, Pose, f64)>,
    pub back: f64,
    pub noise: f64,
}

pub fn draw(p: &Picture, rng: &mut Pcg64) -> Scene {
    let normal = Normal::new(0.0, p.noise.max(1e-9)).unwrap();
    let mut values = Vec::with_capacity(W * H);
    for y in 0..H {
        for x in 0..W {
            let (fx, fy) = (x as f64, y as f64);
            let mut v = p.back;
            for (part, pose, front) in &p.parts {
                let (s, c) = pose.angle.sin_cos();
                let (dx, dy) = ((fx - pose.x) / pose.scale, (fy - pose.y) / pose.scale);
                v += (front - v) * cover(part(c * dx + s * dy, c * dy - s * dx) * pose.scale);
            }
            values.push((v + if p.noise > 0.0 { normal.sample(rng) } else { 0.0 }).round().clamp(0.0, 255.0) as f32);
        }
    }
    Scene::new(vec![Layer::new(Kind::Intensity, W, H, values).unwrap()], None).unwrap()
}

/// The model of a part at a size, taught from a clean picture of it.
pub fn taught(part: Part, size: f64) -> (ShapeModel, f64) {
    let mut rng = Pcg64::seed_from_u64(1);
    let pose = Pose { x: 0.5 * W as f64 + 0.37, y: 0.5 * H as f64 - 0.21, angle: 0.21, scale: size };
    let p = Picture { parts: vec![(part, pose, 160.0)], back: 60.0, noise: 0.0 };
    let r = (52.0 * size) as usize;
    let region = Region { x0: W / 2 - r, y0: (H / 2).saturating_sub(r), x1: W / 2 + r, y1: (H / 2 + r).min(H) };
    let scene = draw(&p, &mut rng);
    (ShapeModel::from_region(&scene, region, Some([pose.x, pose.y]), &ModelOptions::default()).unwrap(), pose.angle)
}
