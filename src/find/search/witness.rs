//! In: the values of a template's region, a scene, a pose found there by edges. Out: how well the values agree: their
//! normalised correlation (docs/math.md, Shape matching (5)).
//! Frame and unit: scene pixels in poses; -1 to 1.

use super::refine::Pose;
use crate::find::model::levels::Levels;
use crate::find::scene::{Kind, Layer, Scene, from_level, to_level};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;

/// Share of the template's values that the scene has to show.
const ENOUGH: f64 = 0.5;
/// Fewest values that are compared.
const FEWEST: f64 = 16.0;
/// Most halvings of template or scene: scales reach from 0.2 to 5, and a template's region is halved at most 8 times.
const HALVINGS: usize = 12;

/// What a template's values say about poses in a scene. Edges are the first witness, and this is a second one.
pub struct Witness<'a> {
    /// The template's values, each layer half as large as the one before.
    template: Vec<Cow<'a, Layer>>,
    /// The scene's values likewise.
    scene: Vec<Cow<'a, Layer>>,
    /// How often the template's first layer was halved.
    halved: usize,
    /// Middle of the region in its own pixels.
    middle: [f64; 2],
}

impl<'a> Witness<'a> {
    /// Prepares the comparison at scales up to `most`. `region_px` is the size of the template's region. `None` where
    /// the scene has no layer of this kind.
    pub fn new(
        levels: &Levels,
        region_px: [u32; 2],
        kind: Kind,
        scene: &'a Scene,
        scales: [f64; 2],
    ) -> Option<Witness<'a>> {
        let layer = scene.layers.iter().find(|l| l.kind == kind)?;
        let halved = levels.halved as usize;
        let [finest, coarsest] = scales.map(|s| steps(s * (1u64 << halved) as f64));
        Some(Witness {
            template: halvings(Cow::Owned(levels.layer(kind)), (-finest).max(0) as usize),
            scene: halvings(Cow::Borrowed(layer), coarsest.max(0) as usize),
            halved,
            middle: region_px.map(|n| 0.5 * (f64::from(n) - 1.0)),
        })
    }

    /// Correlation of the values under a pose; of heights after the planes of least squares were subtracted. `None`
    /// where the scene shows less than half of the template's values, or nothing varies.
    pub fn correlation(&self, pose: &Pose) -> Option<f64> {
        let pitch = steps(pose.scale * (1u64 << self.halved) as f64);
        let fine = (-pitch).max(0) as usize;
        let template = self.template.get(fine).or(self.template.last())?;
        let level = (pitch.max(0) as usize).min(self.scene.len() - 1);
        let (scene, fine) = (&self.scene[level], fine.min(self.template.len() - 1) + self.halved);
        let mut sums = Sums::default();
        let mut all = 0.0;
        for (i, a) in template.values.iter().enumerate().filter(|(_, a)| !a.is_nan()) {
            all += 1.0;
            let place = |i: usize, k: usize| from_level(i as f64, fine) - self.middle[k];
            let (u, v) = (place(i % template.width, 0), place(i / template.width, 1));
            let (x, y) = pose.point(u, v);
            if let Some(b) = between(scene, to_level(x, level), to_level(y, level)) {
                sums.add([u / (1.0 + self.middle[0]), v / (1.0 + self.middle[1])], f64::from(*a), b);
            }
        }
        if sums.n < FEWEST.max(ENOUGH * all) { None } else { sums.correlation(template.kind == Kind::Height) }
    }
}

/// By how many halvings of the scene (of the template where negative) both have pixels of about the same size.
fn steps(pitch: f64) -> i32 {
    (pitch.log2().round() as i32).clamp(-(HALVINGS as i32), HALVINGS as i32)
}

/// A layer and its halvings, which end where nothing is left to halve.
fn halvings(layer: Cow<'_, Layer>, most: usize) -> Vec<Cow<'_, Layer>> {
    let mut out = vec![layer];
    while out.len() <= most && out.last().is_some_and(|l| l.width.min(l.height) >= 8) {
        let half = out.last().expect("never empty").halved();
        out.push(Cow::Owned(half));
    }
    out
}

/// Bilinear value at a place; `None` outside and where one of the four cells is missing.
pub(super) fn between(layer: &Layer, x: f64, y: f64) -> Option<f64> {
    let (fx, fy) = (x.floor(), y.floor());
    let (a, b) = (x - fx, y - fy);
    // A place on the last column or row needs no neighbour beyond it.
    let (right, down) = (usize::from(a > 0.0), usize::from(b > 0.0));
    if !(fx >= 0.0 && fy >= 0.0) || fx as usize + right >= layer.width || fy as usize + down >= layer.height {
        return None;
    }
    let i = fy as usize * layer.width + fx as usize;
    let value = |k: usize| f64::from(layer.values[k]);
    let row = |i: usize| value(i) + a * (value(i + right) - value(i));
    let (above, below) = (row(i), row(i + down * layer.width));
    Some(above + b * (below - above)).filter(|v| !v.is_nan())
}

/// Sums of pairs of values over places.
#[derive(Default)]
struct Sums {
    n: f64,
    /// 1, x, y with each other, with the first value, with the second.
    places: Matrix3<f64>,
    a: Vector3<f64>,
    b: Vector3<f64>,
    aa: f64,
    ab: f64,
    bb: f64,
    /// The first pair, subtracted from all: sums of large values would lose digits.
    first: Option<[f64; 2]>,
}

impl Sums {
    fn add(&mut self, [x, y]: [f64; 2], a: f64, b: f64) {
        let [a0, b0] = *self.first.get_or_insert([a, b]);
        let (a, b, row) = (a - a0, b - b0, Vector3::new(1.0, x, y));
        self.n += 1.0;
        self.places += row * row.transpose();
        self.a += row * a;
        self.b += row * b;
        self.aa += a * a;
        self.ab += a * b;
        self.bb += b * b;
    }

    /// Correlation of what the means leave, or with `planes` what the planes of least squares leave.
    fn correlation(&self, planes: bool) -> Option<f64> {
        let (aa, ab, bb) = if planes {
            let inverse = self.places.try_inverse()?;
            let left = |s: f64, p: &Vector3<f64>, q: &Vector3<f64>| s - p.dot(&(inverse * q));
            (left(self.aa, &self.a, &self.a), left(self.ab, &self.a, &self.b), left(self.bb, &self.b, &self.b))
        } else {
            let left = |s: f64, p: f64, q: f64| s - p * q / self.n;
            (left(self.aa, self.a.x, self.a.x), left(self.ab, self.a.x, self.b.x), left(self.bb, self.b.x, self.b.x))
        };
        // What rounding leaves of an even region is no variation.
        let varies = aa > 1e-9 * (1.0 + self.aa) && bb > 1e-9 * (1.0 + self.bb);
        varies.then(|| (ab / (aa * bb).sqrt()).clamp(-1.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::scene::Region;

    /// Smooth waves that no turn or shift repeats nearby.
    fn waves(x: f64, y: f64) -> f64 {
        (0.21 * x + 0.05 * y).sin() + 0.7 * (0.13 * y - 0.02 * x * x / 20.0).cos() + 0.4 * (0.3 * x - 0.17 * y).sin()
    }

    fn scene(kind: Kind, f: impl Fn(f64, f64) -> f64) -> Scene {
        let values = (0..160 * 140).map(|i| f(f64::from(i % 160), f64::from(i / 160)) as f32).collect();
        Scene::new(vec![Layer::new(kind, 160, 140, values).unwrap()], None).unwrap()
    }

    /// Waves about (80, 70), seen under a pose.
    fn seen(kind: Kind, pose: Pose, levels: impl Fn(f64, f64, f64) -> f64) -> Scene {
        let (s, c) = pose.angle.sin_cos();
        scene(kind, |x, y| {
            let (dx, dy) = ((x - pose.x) / pose.scale, (y - pose.y) / pose.scale);
            levels(x, y, waves(c * dx + s * dy, c * dy - s * dx))
        })
    }

    fn levels(kind: Kind) -> Levels {
        let still = Pose { x: 80.0, y: 70.0, angle: 0.0, scale: 1.0 };
        let region = Region { x0: 55, y0: 50, x1: 106, y1: 91 };
        Levels::of(&seen(kind, still, |_, _, v| 128.0 + 30.0 * v).layers[0].crop(region)).unwrap()
    }

    fn judged(kind: Kind, scene: &Scene, pose: &Pose) -> Option<f64> {
        Witness::new(&levels(kind), [51, 41], kind, scene, [pose.scale; 2]).unwrap().correlation(pose)
    }

    #[test]
    fn the_right_pose_agrees_at_any_contrast_turn_and_scale() {
        for scale in [0.4, 0.7, 1.0, 1.3] {
            for angle in [0.0, 0.6, 2.5] {
                let pose = Pose { x: 79.3, y: 71.6, angle, scale };
                let at = |scene: &Scene, pose: &Pose| judged(Kind::Intensity, scene, pose).unwrap();
                let dim = seen(Kind::Intensity, pose, |_, _, v| 60.0 + 4.0 * v);
                let reversed = seen(Kind::Intensity, pose, |_, _, v| 60.0 - 9.0 * v);
                assert!(at(&dim, &pose) > 0.99, "{} at {scale} {angle}", at(&dim, &pose));
                assert!(at(&reversed, &pose) < -0.99);
                let aside = Pose { x: pose.x + 7.0 * scale, ..pose };
                assert!(at(&dim, &aside) < 0.8, "{}", at(&dim, &aside));
            }
        }
    }

    #[test]
    fn it_is_the_correlation_of_the_definition() {
        // Every value compared by hand at whole pixels: no interpolation enters.
        let pose = Pose { x: 82.0, y: 69.0, angle: 0.0, scale: 1.0 };
        let scene = scene(Kind::Intensity, |x, y| 90.0 + 25.0 * waves(x - 78.0, y - 72.0) + 0.2 * x);
        let own = levels(Kind::Intensity);
        let pairs: Vec<[f64; 2]> = (0..51 * 41)
            .map(|i| {
                [
                    f64::from(own.values[i]),
                    f64::from(scene.layers[0].values[(69 - 20 + i / 51) * 160 + 82 - 25 + i % 51]),
                ]
            })
            .collect();
        let mean = [0, 1].map(|k| pairs.iter().map(|p| p[k]).sum::<f64>() / pairs.len() as f64);
        let product = |k: usize, l: usize| pairs.iter().map(|p| (p[k] - mean[k]) * (p[l] - mean[l])).sum::<f64>();
        let want = product(0, 1) / (product(0, 0) * product(1, 1)).sqrt();
        let got = judged(Kind::Intensity, &scene, &pose).unwrap();
        assert!((got - want).abs() < 1e-9 && want.abs() < 0.95, "{got} {want}");
    }

    #[test]
    fn hidden_values_do_not_count_and_few_say_nothing() {
        let pose = Pose { x: 80.4, y: 70.2, angle: 0.3, scale: 1.0 };
        let hidden =
            |limit: f64| seen(Kind::Intensity, pose, move |x, _, v| if x < limit { f64::NAN } else { 90.0 + v });
        assert!(judged(Kind::Intensity, &hidden(75.0), &pose).unwrap() > 0.99);
        assert!(judged(Kind::Intensity, &hidden(84.0), &pose).is_none());
        let even = scene(Kind::Intensity, |_, _| 200.0);
        assert!(judged(Kind::Intensity, &even, &pose).is_none());
    }

    #[test]
    fn the_tilt_of_heights_does_not_count() {
        let pose = Pose { x: 80.4, y: 70.2, angle: 0.3, scale: 1.0 };
        let tilted = seen(Kind::Height, pose, |x, y, v| 200.0 + 0.02 * v + 0.4 * x - 0.1 * y);
        assert!(judged(Kind::Height, &tilted, &pose).unwrap() > 0.98);
        let grey = seen(Kind::Intensity, pose, |x, y, v| 200.0 + 0.02 * v + 0.4 * x - 0.1 * y);
        assert!(judged(Kind::Intensity, &grey, &pose).unwrap() < 0.6, "of grey levels it does");
    }
}
