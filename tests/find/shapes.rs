//! In: a place in a drawn shape's frame. Out: its distance to the shape's outline, negative inside, and the share of a
//! pixel there that a blurred edge covers; pictures of printed parts.
//! Frame and unit: px.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use sheetlight::find::Pose;
use sheetlight::raster::Image;

/// Blur of the drawn edges, px.
pub const BLUR: f64 = 0.8;

/// Signed distance to a box, negative inside.
pub fn boxed(x: f64, y: f64, cx: f64, cy: f64, hw: f64, hh: f64) -> f64 {
    let (dx, dy) = ((x - cx).abs() - hw, (y - cy).abs() - hh);
    dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0)
}

pub fn disc(x: f64, y: f64, cx: f64, cy: f64, r: f64) -> f64 {
    (x - cx).hypot(y - cy) - r
}

/// A bracket: a plate with a foot, two holes and a slot; no symmetry.
pub fn part(x: f64, y: f64) -> f64 {
    let plate = boxed(x, y, 0.0, 0.0, 34.0, 18.0).min(boxed(x, y, 26.0, 22.0, 8.0, 14.0));
    let holes = disc(x, y, -20.0, 4.0, 6.0).min(disc(x, y, 2.0, -6.0, 4.0)).min(boxed(x, y, 18.0, 2.0, 9.0, 2.5));
    plate.max(-holes)
}

/// Share of a blurred edge at a signed distance: the integral of a Gaussian, by the logistic form that
/// stays within 1e-2 of it and, like it, is symmetric about the edge.
pub fn cover(distance: f64) -> f64 {
    1.0 / (1.0 + (1.702 * distance / BLUR).exp())
}

/// Strokes of print on a bracket, which differ from specimen to specimen: place and turn in its frame.
fn strokes(rng: &mut Pcg64) -> Vec<[f64; 3]> {
    let mut one =
        || [rng.random_range(-30.0..30.0), rng.random_range(-14.0..14.0), rng.random_range(0.0..std::f64::consts::PI)];
    (0..32).map(|_| one()).collect()
}

/// Distance to a stroke, 14 by 1.6 px.
fn stroke([cx, cy, turn]: [f64; 3], x: f64, y: f64) -> f64 {
    let ((s, c), dx, dy) = (turn.sin_cos(), x - cx, y - cy);
    boxed(c * dx + s * dy, c * dy - s * dx, 0.0, 0.0, 7.0, 0.8)
}

/// A noisy picture, 320 by 256, with a printed bracket at each pose; the print depends on the seed. `reversed` is its
/// negative.
pub fn printed(poses: &[Pose], seed: u64, reversed: bool) -> Image {
    let (mut rng, noise) = (Pcg64::seed_from_u64(seed), Normal::new(0.0, 3.0).unwrap());
    let print: Vec<Vec<[f64; 3]>> = poses.iter().map(|_| strokes(&mut rng)).collect();
    let mut level = |x: f64, y: f64| -> u8 {
        let mut v = 60.0;
        for (pose, print) in poses.iter().zip(&print) {
            let (s, c) = pose.angle.sin_cos();
            let (dx, dy) = (x - pose.x, y - pose.y);
            if dx.hypot(dy) < 60.0 {
                let (u, w) = (c * dx + s * dy, c * dy - s * dx);
                v += (170.0 - v) * cover(part(u, w));
                print.iter().for_each(|p| v += (90.0 - v) * cover(stroke(*p, u, w)));
            }
        }
        ((if reversed { 230.0 - v } else { v }) + noise.sample(&mut rng)).round() as u8
    };
    Image::from_u8(320, 256, (0..320 * 256).map(|i| level(f64::from(i % 320), f64::from(i / 320))).collect())
}
