//! In: a task and the number of a picture. Out: the picture, the same on every machine, and the hash of a task's
//! pictures. Frame and unit: px; grey levels.

use super::scene::{Line, SceneKind, Task};
use super::wire::picture_bytes;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use sheetlight::raster::Image;
use sheetlight::stages::noise::Noise;

/// Grains of speckle: their distance, px, and the number of looks, whose inverse root is the contrast.
const GRAIN_PX: f64 = 1.7;
const LOOKS: u32 = 4;
/// Variance of shot noise per unit of light, both as shares of full scale.
const SHOT: f64 = 0.0003;

/// A number from other numbers, well mixed (the finaliser of SplitMix64).
fn mixed(words: [u64; 3]) -> u64 {
    words.iter().fold(0x9e37_79b9_7f4a_7c15, |z: u64, &w| {
        let z = (z ^ w).wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    })
}

/// Light of one speckle grain, mean 1: the mean of exponential variables.
fn grain(seed: u64, column: i64, row: i64) -> f64 {
    let mut noise = Noise(mixed([seed, column as u64, row as u64]));
    let one = |noise: &mut Noise| -libm::log((f64::from(noise.next()) + 1.0) / 2_147_483_649.0);
    (0..LOOKS).map(|_| one(&mut noise)).sum::<f64>() / f64::from(LOOKS)
}

/// Speckle at a pixel: the grains around it, interpolated.
fn speckle(seed: u64, x: f64, y: f64) -> f64 {
    let (x, y) = (x / GRAIN_PX, y / GRAIN_PX);
    let (left, top) = (libm::floor(x), libm::floor(y));
    let (a, b) = (x - left, y - top);
    let at = |dx: i64, dy: i64| grain(seed, left as i64 + dx, top as i64 + dy);
    (1.0 - b) * ((1.0 - a) * at(0, 0) + a * at(1, 0)) + b * ((1.0 - a) * at(0, 1) + a * at(1, 1))
}

/// Light of a picture, share of full scale.
struct Canvas {
    width: u32,
    height: u32,
    light: Vec<f32>,
}

impl Canvas {
    /// Adds light to the rows around `middle` in one column.
    fn column(&mut self, x: u32, middle: f64, reach: f64, light: impl Fn(f64) -> f64) {
        let from = libm::floor(middle - reach).max(0.0) as u32;
        let to = (libm::ceil(middle + reach).max(0.0) as u32).min(self.height.saturating_sub(1));
        for y in from..=to {
            self.light[(y as usize) * self.width as usize + x as usize] += light(f64::from(y)) as f32;
        }
    }

    /// A line whose profile across it is a Gaussian.
    fn line(&mut self, line: &Line, sigma: f64, speckled: Option<u64>) {
        for x in line.from as u32..=line.to as u32 {
            let u = f64::from(x);
            let (middle, slope) = (line.row(u), line.slope(u));
            let across = 1.0 / (1.0 + slope * slope).sqrt();
            self.column(x, middle, 6.0 * sigma / across, |y| {
                let d = (y - middle) * across / sigma;
                let bell = line.peak * libm::exp(-0.5 * d * d);
                speckled.map_or(bell, |seed| bell * speckle(seed, u, y))
            });
        }
    }

    /// A round bright spot.
    fn spot(&mut self, cx: u32, cy: u32, radius: f64) {
        let reach = 4.0 * radius;
        let from = (f64::from(cx) - reach).max(0.0) as u32;
        let to = ((f64::from(cx) + reach) as u32).min(self.width - 1);
        for x in from..=to {
            let dx = f64::from(x) - f64::from(cx);
            self.column(x, f64::from(cy), reach, |y| {
                let dy = y - f64::from(cy);
                0.9 * libm::exp(-0.5 * (dx * dx + dy * dy) / (radius * radius))
            });
        }
    }
}

/// One picture of a task.
pub(super) fn draw(task: &Task, number: u32) -> Image {
    let (width, height) = (task.width, task.height);
    let seed = mixed([task.scene as u64, u64::from(number), 1]);
    let mut canvas = Canvas { width, height, light: vec![0.0; width as usize * height as usize] };
    let sigma = task.scene.sigma_px();
    let lines = task.lines(number);
    for line in &lines {
        canvas.line(line, sigma, (task.scene == SceneKind::Speckle).then_some(seed));
    }
    if task.scene == SceneKind::Reflections {
        let mut noise = Noise(seed);
        for _ in 0..40 {
            let (cx, cy) = (noise.next() % width, noise.next() % height);
            canvas.spot(cx, cy, 2.0 + f64::from(noise.next() % 8));
        }
        let (w, h) = (f64::from(width), f64::from(height));
        canvas.line(&lines[0].moved(0.2 * h, 0.2 * w, 0.4 * w, 0.25), 3.0 * sigma, None);
    }
    let full = f64::from((1u32 << task.bits) - 1);
    let [background, read] = task.scene.background();
    let level = |light: f32, noise: &mut Noise| {
        let light = f64::from(light);
        let light = background + light + read * noise.normal() + (SHOT * light).sqrt() * noise.normal();
        (full * light).round().clamp(0.0, full) as u16
    };
    let rows = canvas.light.par_chunks(width as usize).enumerate();
    let levels: Vec<u16> = rows
        .flat_map_iter(|(y, row)| {
            let mut noise = Noise(mixed([seed, y as u64, 2]));
            row.iter().map(move |&light| level(light, &mut noise)).collect::<Vec<_>>()
        })
        .collect();
    if task.bits == 8 {
        Image::from_u8(width, height, levels.iter().map(|&v| v as u8).collect())
    } else {
        Image::from_u16(width, height, task.bits, levels)
    }
}

/// SHA-256 of the bytes of a task's pictures, in order, as hexadecimal digits.
pub(super) fn hash(pictures: &[Image]) -> String {
    let mut all = Sha256::new();
    pictures.iter().for_each(|p| all.update(picture_bytes(p)));
    all.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// All pictures of a task.
pub(super) fn pictures(task: &Task) -> Vec<Image> {
    (0..task.pictures()).map(|n| draw(task, n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use strum::VariantArray;

    fn task(scene: SceneKind, bits: u8) -> Task {
        Task { scene, width: 320, height: 240, bits }
    }

    /// Another machine, compiler or change must not change the pictures: results would not compare.
    #[test]
    fn pictures_are_those_of_the_first_version() {
        let known = [
            (SceneKind::Clean, 8, "cb697364e991e9117277eb52c04bf18e30c2394b5ae68250bf197c576dabf6a8"),
            (SceneKind::Speckle, 12, "ae7682f6fd283c01cad53a51414ab6a52dfacee2426ba8ecd2e8882ba0846ad5"),
            (SceneKind::Reflections, 8, "6b6c98d867f4ae272ca17b58d89bec05856e04b74e958ee7b52edc33cb285bd1"),
            (SceneKind::TenthLit, 8, "311cb3244e6bc9ebec617ec3ce4a93143b38befe81d772528df33dfbf6b9d1d1"),
        ];
        let drawn = known.map(|(scene, bits, _)| {
            let t = task(scene, bits);
            (scene, bits, hash(&[draw(&t, 0), draw(&t, 1)]))
        });
        assert_eq!(drawn, known.map(|(scene, bits, sha)| (scene, bits, sha.to_owned())));
    }

    /// The brightest row of noise-free columns is the line's row, and the scene's statement about noise holds.
    #[test]
    fn light_stands_where_the_lines_are() {
        for &scene in SceneKind::VARIANTS {
            let t = task(scene, 12);
            let image = draw(&t, 3);
            let mean = |x: u32, y: u32| {
                let near = (0..3).flat_map(|dy| (0..5).map(move |dx| (dx, dy)));
                near.map(|(dx, dy)| f64::from(image.get(x - 2 + dx, y - 1 + dy))).sum::<f64>() / 15.0 / 4095.0
            };
            let background = scene.background()[0];
            for line in t.lines(3) {
                let u = libm::floor(0.5 * (line.from + line.to));
                let light = mean(u as u32, line.row(u).round() as u32) - background;
                assert!(light > 0.55 * line.peak, "{scene:?}: {light}");
            }
        }
        let noisy = draw(&task(SceneKind::TenthLit, 8), 0);
        let levels = noisy.to_u8();
        let lit = levels.iter().filter(|&&v| f64::from(v) > (0.12 + 0.03) * 255.0).count() as f64;
        let share = lit / levels.len() as f64;
        assert!((0.08..0.25).contains(&share), "{share}");
    }
}
