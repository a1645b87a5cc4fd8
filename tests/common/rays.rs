//! In: a camera that was found, and the true one. Out: how far its viewing rays are off.
//! Frame and unit: px, after the best rotation of the whole camera.

use sheetlight::camera::Intrinsics;
use sheetlight::geometry::{Mat3, Vec2, Vec3, orthonormalise};

/// Rms displacement of viewing rays over the image, px. Where the true camera has no ray there is none to miss; where
/// only the found one has none it is off by `LOST`.
pub fn ray_error(found: &Intrinsics, truth: &Intrinsics) -> f64 {
    const LOST: f64 = 10.0;
    let (mut pairs, mut lost) = (Vec::new(), 0usize);
    for y in (0..truth.height).step_by(truth.height as usize / 60) {
        for x in (0..truth.width).step_by(truth.width as usize / 80) {
            let px = Vec2::new(x.into(), y.into());
            let Some(t) = truth.ray_from_pixel(&px) else { continue };
            match found.ray_from_pixel(&px) {
                Some(f) => pairs.push((f.direction, t.direction)),
                None => lost += 1,
            }
        }
    }
    let m = pairs.iter().map(|(f, t)| t * f.transpose()).sum::<Mat3>();
    let r = orthonormalise(&m);
    let apart = |f: &Vec3, t: &Vec3| {
        let [f, t] = [r * f, *t].map(|p| truth.pixel_from_point(&p));
        f.zip(t).map_or(LOST, |(f, t)| (f - t).norm())
    };
    let sum: f64 = pairs.iter().map(|(f, t)| apart(f, t).powi(2)).sum::<f64>() + lost as f64 * LOST * LOST;
    (sum / (pairs.len() + lost) as f64).sqrt()
}
