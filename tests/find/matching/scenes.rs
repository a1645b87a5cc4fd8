//! In: seeds. Out: pictures drawn from exact shapes, parts of several kinds and sizes, what hides them, what lies
//! around them.
//! Frame and unit: pixels; greys of 8 bits.

use crate::shapes::{boxed, cover, disc};
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use sheetlight::find::{Kind, Layer, ModelOptions, Pose, Region, Scene, ShapeModel};

pub use crate::shapes::part as bracket;

pub const W: usize = 320;
pub const H: usize = 256;

/// Signed distance to a part's material, negative inside; none is symmetric.
pub type Part = fn(f64, f64) -> f64;

/// A round cover: an ear, an off-centre bore, three screw holes.
fn cover_plate(x: f64, y: f64) -> f64 {
    let body = disc(x, y, 0.0, 0.0, 26.0).min(boxed(x, y, 28.0, 0.0, 8.0, 6.0));
    let holes = disc(x, y, -5.0, 4.0, 9.0).min(disc(x, y, 12.0, 14.0, 3.0)).min(disc(x, y, 29.0, 0.0, 3.0));
    body.max(-holes.min(disc(x, y, 6.0, -18.0, 3.5)))
}

/// A comb: a bar with teeth of three widths.
fn comb(x: f64, y: f64) -> f64 {
    let bar = boxed(x, y, 0.0, -12.0, 36.0, 7.0);
    let teeth = boxed(x, y, -30.0, 6.0, 6.0, 14.0)
        .min(boxed(x, y, -8.0, 6.0, 4.0, 14.0))
        .min(boxed(x, y, 18.0, 2.0, 9.0, 10.0));
    bar.min(teeth).max(-disc(x, y, 27.0, -12.0, 3.5))
}

pub const PARTS: [(&str, Part); 3] = [("bracket", bracket), ("cover", cover_plate), ("comb", comb)];

/// What lies on or under a part: distance in the picture, grey.
#[derive(Clone, Copy)]
pub enum Thing {
    Box { at: [f64; 2], half: [f64; 2], turn: f64, grey: f64 },
    Disc { at: [f64; 2], radius: f64, grey: f64 },
}

impl Thing {
    pub fn random(rng: &mut Pcg64, greys: std::ops::Range<f64>) -> Thing {
        let at = [rng.random_range(0.0..W as f64), rng.random_range(0.0..H as f64)];
        let grey = rng.random_range(greys);
        if rng.random_bool(0.7) {
            let half = [rng.random_range(3.0..32.0), rng.random_range(3.0..32.0)];
            Thing::Box { at, half, turn: rng.random_range(0.0..3.0), grey }
        } else {
            Thing::Disc { at, radius: rng.random_range(3.0..24.0), grey }
        }
    }
    fn distance(&self, x: f64, y: f64) -> f64 {
        match *self {
            Thing::Disc { at, radius, .. } => disc(x, y, at[0], at[1], radius),
            Thing::Box { at, half, turn, .. } => {
                let (s, c) = turn.sin_cos();
                let (dx, dy) = (x - at[0], y - at[1]);
                boxed(c * dx + s * dy, c * dy - s * dx, 0.0, 0.0, half[0], half[1])
            }
        }
    }
    fn grey(&self) -> f64 {
        match *self {
            Thing::Box { grey, .. } | Thing::Disc { grey, .. } => grey,
        }
    }
}

/// Parts, their poses (the scale is their size) and greys, between what lies under and over them.
pub struct Picture {
    pub parts: Vec<(Part, Pose, f64)>,
    pub back: f64,
    pub under: Vec<Thing>,
    pub over: Vec<Thing>,
    pub noise: f64,
}

pub fn draw(p: &Picture, rng: &mut Pcg64) -> Scene {
    let normal = Normal::new(0.0, p.noise.max(1e-9)).unwrap();
    let mut values = Vec::with_capacity(W * H);
    for y in 0..H {
        for x in 0..W {
            let (fx, fy) = (x as f64, y as f64);
            let mut v = p.back;
            p.under.iter().for_each(|t| v += (t.grey() - v) * cover(t.distance(fx, fy)));
            for (part, pose, front) in &p.parts {
                let (s, c) = pose.angle.sin_cos();
                let (dx, dy) = ((fx - pose.x) / pose.scale, (fy - pose.y) / pose.scale);
                v += (front - v) * cover(part(c * dx + s * dy, c * dy - s * dx) * pose.scale);
            }
            p.over.iter().for_each(|t| v += (t.grey() - v) * cover(t.distance(fx, fy)));
            values.push((v + if p.noise > 0.0 { normal.sample(rng) } else { 0.0 }).round().clamp(0.0, 255.0) as f32);
        }
    }
    Scene::new(vec![Layer::new(Kind::Intensity, W, H, values).unwrap()], None).unwrap()
}

/// The model of a part at a size, taught from a clean picture of it.
pub fn taught(part: Part, size: f64) -> (ShapeModel, f64) {
    let mut rng = Pcg64::seed_from_u64(1);
    let pose = Pose { x: 0.5 * W as f64 + 0.37, y: 0.5 * H as f64 - 0.21, angle: 0.21, scale: size };
    let p = Picture { parts: vec![(part, pose, 160.0)], back: 60.0, under: vec![], over: vec![], noise: 0.0 };
    let r = (52.0 * size) as usize;
    let region = Region { x0: W / 2 - r, y0: (H / 2).saturating_sub(r), x1: W / 2 + r, y1: (H / 2 + r).min(H) };
    let scene = draw(&p, &mut rng);
    (ShapeModel::from_region(&scene, region, Some([pose.x, pose.y]), &ModelOptions::default()).unwrap(), pose.angle)
}

/// An occluder that hides `share` of the model's edges at `pose` (a pose of the model): moved in from a random side.
pub fn occluder(model: &ShapeModel, pose: &Pose, share: f64, rng: &mut Pcg64) -> Thing {
    let side: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    let (radius, grey) = (model.radius, rng.random_range(10.0..245.0));
    let kind = rng.random_range(0..3);
    let aside = rng.random_range(-0.3..0.3) * radius;
    let turn = rng.random_range(0.0..3.0);
    let at = |d: f64| {
        let (s, c) = side.sin_cos();
        let at = [pose.x + d * c - aside * s, pose.y + d * s + aside * c];
        match kind {
            0 => Thing::Box {
                at: [pose.x + (d + 200.0) * c, pose.y + (d + 200.0) * s],
                half: [200.0, 200.0],
                turn: side,
                grey,
            },
            1 => Thing::Disc { at, radius: 0.7 * radius, grey },
            _ => Thing::Box { at, half: [0.6 * radius, 0.5 * radius], turn, grey },
        }
    };
    let hidden = |t: &Thing| {
        let points = &model.levels[0];
        let under = |p: &&sheetlight::find::model::shape_model::ModelPoint| {
            let (x, y) = pose.point(p.x, p.y);
            t.distance(x, y) < 0.0
        };
        points.iter().filter(under).count() as f64 / points.len() as f64
    };
    // From outside inwards: the first place that hides enough.
    let steps = (0..400).map(|k| 2.2 * radius * (1.0 - f64::from(k) / 200.0));
    steps.map(at).find(|t| hidden(t) >= share).unwrap_or_else(|| Thing::Box {
        at: [pose.x + 200.0 * side.cos(), pose.y + 200.0 * side.sin()],
        half: [200.0, 200.0],
        turn: side,
        grey,
    })
}
