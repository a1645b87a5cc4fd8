//! In: light per pixel. Out: the sensor's picture: room light, blur, speckle, shot and read noise, hot
//! pixels, saturation, grey steps.
//! Frame and unit: pixels; grey levels of the sensor's depth.

use super::light::{Canvas, View};
use super::sensor::Sensor;
use crate::geometry::{Vec2, Vec3};
use crate::raster::Image;
use rand_distr::{Distribution, Gamma, StandardNormal};
use rand_pcg::Pcg64;

impl View<'_> {
    /// Grey of a viewing direction (ideal normalised coordinates) under room light that comes from
    /// above at a slant, as share of white.
    fn room_light(&self, n: &Vec2) -> f32 {
        let along = Vec3::new(n.x, n.y, 1.0).normalize();
        let eye = self.scene_from_camera.translation;
        let direction = self.scene_from_camera.direction(&along);
        let Some(hit) = self.scene.hit(&eye, &direction, self.far()) else { return 0.02 };
        let lamp = self.scene_from_camera.direction(&Vec3::new(-0.35, -0.25, -0.9)).normalize();
        let shade = 0.55 + 0.45 * hit.normal.dot(&lamp).max(0.0);
        // cos⁴ of the angle to the axis: natural vignetting of a lens.
        (hit.material.albedo * shade * along.z.powi(4)) as f32
    }

    /// Viewing directions at the corners between pixels, along one row of corners.
    fn corners(&self, row: u32) -> Vec<Option<Vec2>> {
        let camera = &self.station.camera;
        let v = f64::from(row) - 0.5;
        (0..=camera.width).map(|x| camera.normalised_from_pixel(&Vec2::new(f64::from(x) - 0.5, v))).collect()
    }

    /// Room light in every pixel with `samples`² rays a pixel, blurred by the lens. Within a pixel the lens
    /// distortion is linear to 1e-6 px, so the rays are interpolated between those of its corners.
    pub fn ambient(&self, samples: u32) -> Canvas {
        let camera = &self.station.camera;
        let mut canvas = Canvas::new(camera.width, camera.height);
        let places: Vec<f64> = (0..samples).map(|i| (f64::from(i) + 0.5) / f64::from(samples)).collect();
        let mut below = self.corners(0);
        for (y, row) in canvas.pixels.chunks_exact_mut(camera.width as usize).enumerate() {
            let above = std::mem::replace(&mut below, self.corners(y as u32 + 1));
            for (x, pixel) in row.iter_mut().enumerate() {
                let (Some(a), Some(b), Some(c), Some(d)) = (above[x], above[x + 1], below[x], below[x + 1]) else {
                    continue;
                };
                let mut sum = 0.0;
                for fy in &places {
                    let (left, right) = (a + (c - a) * *fy, b + (d - b) * *fy);
                    sum += places.iter().map(|fx| self.room_light(&(left + (right - left) * *fx))).sum::<f32>();
                }
                *pixel = sum / (samples * samples) as f32;
            }
        }
        blur(&mut canvas, self.station.blur_px());
        canvas
    }

    /// Room light from one ray every few pixels, interpolated: accurate enough for the faint leak through a laser's
    /// filter.
    pub fn faint_ambient(&self) -> Canvas {
        let camera = &self.station.camera;
        let step = (camera.width / 160).max(1);
        let (nx, ny) = (camera.width.div_ceil(step) + 1, camera.height.div_ceil(step) + 1);
        let knot = |i: u32| Vec2::new(f64::from((i % nx) * step), f64::from((i / nx) * step));
        let light = |px: Vec2| camera.normalised_from_pixel(&px).map_or(0.0, |n| self.room_light(&n));
        let knots: Vec<f32> = (0..nx * ny).map(|i| light(knot(i))).collect();
        let mut canvas = Canvas::new(camera.width, camera.height);
        let scale = 1.0 / step as f32;
        for (y, row) in canvas.pixels.chunks_exact_mut(camera.width as usize).enumerate() {
            let (j, fy) = (y as u32 / step, (y as u32 % step) as f32 * scale);
            let (above, below) = (&knots[(j * nx) as usize..], &knots[((j + 1) * nx) as usize..]);
            for (x, pixel) in row.iter_mut().enumerate() {
                let (i, fx) = (x / step as usize, (x as u32 % step) as f32 * scale);
                let top = above[i] + fx * (above[i + 1] - above[i]);
                let bottom = below[i] + fx * (below[i + 1] - below[i]);
                *pixel = top + fy * (bottom - top);
            }
        }
        canvas
    }
}

/// Gaussian blur, separable, edges repeated.
pub fn blur(canvas: &mut Canvas, sigma: f64) {
    let reach = (3.0 * sigma).ceil() as usize;
    let mut kernel: Vec<f32> =
        (0..=2 * reach).map(|i| (-0.5 * ((i as f64 - reach as f64) / sigma).powi(2)).exp() as f32).collect();
    let total: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= total);
    let (w, h) = (canvas.width as usize, canvas.height as usize);
    let mut line = Vec::new();
    for row in canvas.pixels.chunks_exact_mut(w) {
        line.clear();
        line.extend(std::iter::repeat_n(row[0], reach).chain(row.iter().copied()));
        line.extend(std::iter::repeat_n(row[w - 1], reach));
        for (pixel, window) in row.iter_mut().zip(line.windows(kernel.len())) {
            *pixel = window.iter().zip(&kernel).map(|(a, b)| a * b).sum();
        }
    }
    let before = canvas.pixels.clone();
    for (y, row) in canvas.pixels.chunks_exact_mut(w).enumerate() {
        row.fill(0.0);
        for (i, k) in kernel.iter().enumerate() {
            let from = (y + i).saturating_sub(reach).min(h - 1) * w;
            row.iter_mut().zip(&before[from..from + w]).for_each(|(pixel, b)| *pixel += k * b);
        }
    }
}

/// A speckle contrast below this changes no level of 16 bits, and the Gamma distribution's shape exceeds the range
/// of f32.
const FAINTEST_SPECKLE: f64 = 1e-6;

/// The factor that multiplies coherent light: Gamma distributed, of mean one [goodman07, 4.6].
enum Speckle {
    /// Each pixel has an independent factor.
    Pixels(Gamma<f32>),
    /// Grains: correlated normal numbers, one a pixel, and the Gamma distribution's shape.
    Grains(Vec<f32>, f32),
}

impl Speckle {
    fn new(sensor: &Sensor, (width, height): (u32, u32), rng: &mut Pcg64) -> Speckle {
        let shape = (1.0 / (sensor.speckle * sensor.speckle)) as f32;
        if sensor.grain_px == 0.0 {
            return Speckle::Pixels(Gamma::new(shape, 1.0 / shape).expect("positive"));
        }
        let mut field = Canvas::new(width, height);
        field.pixels.iter_mut().for_each(|p| *p = StandardNormal.sample(rng));
        blur(&mut field, sensor.grain_px);
        let rms = (field.pixels.iter().map(|p| p * p).sum::<f32>() / field.pixels.len() as f32).sqrt();
        field.pixels.iter_mut().for_each(|p| *p /= rms);
        Speckle::Grains(field.pixels, shape)
    }
    fn at(&self, pixel: usize, rng: &mut Pcg64) -> f32 {
        match self {
            Speckle::Pixels(gamma) => gamma.sample(rng),
            // Wilson and Hilferty: the cube root of a Gamma number is nearly normal.
            Speckle::Grains(field, shape) => {
                let root = 1.0 - 1.0 / (9.0 * shape) + field[pixel] / (3.0 * shape.sqrt());
                root.max(0.0).powi(3)
            }
        }
    }
}

/// Converts light (share of full scale) into grey levels. `laser` has speckle, `room` has none.
pub fn expose(
    sensor: &Sensor,
    laser: &Canvas,
    room: &Canvas,
    room_gain: f32,
    hot: &[(usize, f32)],
    rng: &mut Pcg64,
) -> Image {
    let light = fallen(sensor, laser, room, room_gain, hot, rng);
    read(sensor, &light, 1.0, rng)
}

/// The light that falls on the sensor, with its speckle and with what its hot pixels add.
pub(super) fn fallen(
    sensor: &Sensor,
    laser: &Canvas,
    room: &Canvas,
    room_gain: f32,
    hot: &[(usize, f32)],
    rng: &mut Pcg64,
) -> Canvas {
    let speckle = (sensor.speckle > FAINTEST_SPECKLE).then(|| Speckle::new(sensor, (laser.width, laser.height), rng));
    let mut light: Vec<f32> = laser
        .pixels
        .iter()
        .zip(&room.pixels)
        .enumerate()
        .map(|(i, (&l, &r))| match &speckle {
            Some(speckle) if l > 1e-4 => l * speckle.at(i, rng) + r * room_gain,
            _ => l + r * room_gain,
        })
        .collect();
    hot.iter().for_each(|&(i, extra)| light[i] += extra);
    Canvas { pixels: light, ..Canvas::new(laser.width, laser.height) }
}

/// Grey levels of light that falls on the sensor `times` as long as its levels are stated for.
pub(super) fn read(sensor: &Sensor, light: &Canvas, times: f32, rng: &mut Pcg64) -> Image {
    let well = sensor.full_well_e as f32;
    let read = (sensor.read_noise_e * sensor.read_noise_e) as f32;
    let full = ((1u32 << sensor.bits) - 1) as f32;
    let mut grey = |l: &f32| {
        let electrons = times * l * well;
        let noise: f32 = StandardNormal.sample(rng);
        ((electrons + noise * (electrons + read).sqrt()) / well * full + 0.5).clamp(0.0, full)
    };
    if sensor.bits == 8 {
        Image::from_u8(light.width, light.height, light.pixels.iter().map(|l| grey(l) as u8).collect())
    } else {
        Image::from_u16(light.width, light.height, sensor.bits, light.pixels.iter().map(|l| grey(l) as u16).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// The contrast is the stated one, and neighbours are correlated as light through a blur is: exp(-d² / (4 s²)).
    #[test]
    fn speckle_has_the_stated_contrast_and_grains() {
        for (speckle, grain_px) in [(0.12, 0.0), (0.12, 1.5), (0.4, 0.8), (0.4, 2.5)] {
            let sensor =
                Sensor { speckle, grain_px, full_well_e: 1e6, read_noise_e: 0.0, bits: 16, ..Sensor::default() };
            let mut laser = Canvas::new(300, 300);
            laser.pixels.fill(0.2);
            let none = Canvas::new(300, 300);
            let grey = expose(&sensor, &laser, &none, 0.0, &[], &mut Pcg64::seed_from_u64(1)).to_f32();
            let mean = grey.iter().sum::<f32>() / 9e4;
            let apart = |d: usize| {
                let pairs = (0..300 * 300).filter(|i| i % 300 + d < 300);
                pairs.map(|i| (grey[i] - mean) * (grey[i + d] - mean)).sum::<f32>() / ((300 - d) * 300) as f32
            };
            let contrast = f64::from(apart(0).sqrt() / mean);
            let few = 1.0 + grain_px * grain_px;
            assert!((contrast / speckle - 1.0).abs() < 0.01 * few, "{speckle}, {grain_px}: {contrast}");
            for d in [1, 2, 4] {
                let expected = if grain_px > 0.0 { (-0.25 * (d as f64 / grain_px).powi(2)).exp() } else { 0.0 };
                let seen = f64::from(apart(d) / apart(0));
                assert!(
                    (seen - expected).abs() < 0.02 * few,
                    "{speckle}, {grain_px}, {d} px apart: {seen}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn noise_has_the_stated_size() {
        let sensor = Sensor { hot_per_million: 0.0, bits: 12, ..Sensor::default() };
        let mut flat = Canvas::new(200, 200);
        flat.pixels.fill(0.5);
        let none = Canvas::new(200, 200);
        let picture = expose(&sensor, &none, &flat, 1.0, &[], &mut Pcg64::seed_from_u64(1));
        let grey = picture.to_f32();
        let mean = grey.iter().sum::<f32>() / 4e4;
        let variance = grey.iter().map(|g| (g - mean).powi(2)).sum::<f32>() / 4e4;
        // 5000 electrons: shot noise 70.7, read noise 20, together 73.5 of 10,000 = 30.1 of 4095.
        assert!((mean - 2047.5).abs() < 1.0, "{mean}");
        assert!((variance.sqrt() - 30.1).abs() < 0.5, "{}", variance.sqrt());
    }

    #[test]
    fn blur_keeps_the_light() {
        let mut canvas = Canvas::new(41, 31);
        canvas.pixels[15 * 41 + 20] = 1.0;
        blur(&mut canvas, 1.5);
        assert!((canvas.pixels.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        let spread: f32 = (0..41).map(|x| (x as f32 - 20.0).powi(2) * canvas.pixels[15 * 41 + x]).sum();
        let row: f32 = canvas.pixels[15 * 41..16 * 41].iter().sum();
        assert!((spread / row - 2.25).abs() < 0.06, "{}", spread / row);
    }
}
