//! In: a picture with a stripe and its skeleton. Out: the stripe's width, its speckle contrast and the sensor's noise, from the light itself.
//! Frame and unit: Gaussian sigma in px; speckle is a ratio. docs/math.md, Stripe peak (6).

use super::found::Peak;
use super::grey::{Grey, View};
use super::noise::scatter::{Scatter, Sums};
use super::params::{Method, PeakParams, Stripe};
use super::{PeakFrame, twin};
use crate::raster::{Image, Pixels};
use crate::stages::stripe::choose_params::ChooseParams;
use glam::Vec2;

/// Skeleton pixels looked at, spread over the picture; the median of 400 is good to 6 % of the spread.
const SAMPLES: usize = 400;
/// Fewer than this many usable peaks say nothing.
const FEWEST: usize = 20;
/// A sum of squares farther out than so many of its standard deviations is not noise alone.
const SURE: f64 = 3.0;
/// The lower quarter of a normal distribution ends so many standard deviations below its middle.
const QUARTILE: f64 = 0.674;

/// Width, speckle and noise of the stripe in one picture, and the dark pixels' noise as it was assumed; `None` where there is too little of it.
/// `across` is the unit image direction of depth. Start: half the pixels above half maximum. Then three rounds of fitting with the medians of the round before.
pub fn measure(image: &Image, skeleton: &[u32], p: &PeakParams, across: Vec2) -> Option<Stripe> {
    let step = (skeleton.len() / SAMPLES).max(1);
    let sample: Vec<(i32, i32)> =
        skeleton.iter().step_by(step).map(|&q| ((q & 0xffff) as i32, (q >> 16) as i32)).collect();
    let mut stripe = Stripe {
        width_px: half_maximum(image, &sample)?.clamp(0.4, 12.0),
        speckle: p.speckle,
        noise: p.read_noise,
        ..Stripe::default()
    };
    for _ in 0..3 {
        let size = (image.width, image.height, image.bits);
        let setup = PeakFrame::new(size, 1, &p.with(&stripe), &ChooseParams::default(), across);
        let (width, height) = (setup.width, setup.height);
        let fits = match &image.pixels {
            Pixels::U8(pixels) => fits(View { pixels, width, height }, &sample, &setup),
            Pixels::U16(pixels) => fits(View { pixels, width, height }, &sample, &setup),
        };
        if fits.len() < FEWEST {
            return None;
        }
        let fits = of_one_surface(fits);
        let width_px = median(fits.iter().map(|f| f.0).collect());
        let sums: Vec<Sums> = fits.iter().map(|f| f.1).collect();
        let found = Scatter::fit(&sums, &Scatter::of(p), setup.full_scale);
        stripe = Stripe {
            width_px: width_px.clamp(0.4, 12.0),
            speckle: found.speckle,
            read_noise: Some(found.read_noise),
            gain: Some(found.gain),
            ..stripe
        };
    }
    Some(stripe)
}

/// Width and squared residuals of the peaks that can be believed: clipped light hides both, and a spot of one pixel is a hot pixel.
fn fits<G: Grey>(image: G, sample: &[(i32, i32)], s: &PeakFrame) -> Vec<(f32, Sums)> {
    let (mut pixels, mut fits) = (Vec::new(), Vec::new());
    let skeleton: Vec<u32> = sample.iter().map(|&(x, y)| x as u32 | (y as u32) << 16).collect();
    for (k, &(x, y)) in twin::each(image, &skeleton, 0, s, Method::Gaussian).iter().zip(sample) {
        let usable = k.flags == 0 && k.snr > 10.0 && (0.4 * s.s0..2.5 * s.s0).contains(&k.width_px);
        if usable && let Some(sums) = residuals(image, x, y, k, s, &mut pixels) {
            fits.push((k.width_px, sums));
        }
    }
    fits
}

/// Fits whose residuals are noise. Where a stripe falls over an edge two pieces of it lie in one window, and on parts with many small
/// faces such windows are the greater number: what they leave grows with the light as speckle does. A quarter shows what is usual;
/// a sum of n squares of noise, in units of n, scatters by sqrt(2 / n).
fn of_one_surface(mut fits: Vec<(f32, Sums)>) -> Vec<(f32, Sums)> {
    fits.sort_by(|a, b| a.1.misfit().total_cmp(&b.1.misfit()));
    let usual = fits[fits.len() / 4].1.misfit();
    fits.retain(|(_, sums)| {
        let scatter = (2.0 / sums.freedom().max(1.0)).sqrt().min(1.0);
        sums.misfit() <= usual * (1.0 + SURE * scatter) / (1.0 - QUARTILE * scatter)
    });
    fits
}

/// A pixel that takes part: its weight, its residual, and what the model says of it: derivatives, light, variance.
struct Pixel {
    weight: f32,
    residual: f32,
    j: nalgebra::Vector3<f32>,
    light: f32,
    variance: f32,
}

/// The squared residuals of the window. Three fitted numbers have eaten part of the noise, most where the light is: pixel by
/// pixel the share that is left is 1 - leverage. `pixels` is memory that is used again.
fn residuals<G: Grey>(image: G, x: i32, y: i32, k: &Peak, s: &PeakFrame, pixels: &mut Vec<Pixel>) -> Option<Sums> {
    let n = (k.normal_u, k.normal_v);
    let m = (k.u - x as f32) * n.0 + (k.v - y as f32) * n.1;
    pixels.clear();
    window(image, (x, y), n, m, s, |d, weight, level| {
        let z = (d - m) / k.width_px;
        let shape = (-0.5 * z * z).exp();
        let light = k.amplitude * shape;
        let j = nalgebra::Vector3::new(shape, light * z / k.width_px, light * z * z / k.width_px);
        let variance = s.read2 + s.gain * (light + k.background) + s.speckle2 * light * light;
        pixels.push(Pixel { weight, residual: level - k.background - light, j, light, variance });
    });
    let mut normal = nalgebra::Matrix3::zeros();
    for p in pixels.iter() {
        normal += p.j * p.j.transpose() * (p.weight / p.variance);
    }
    let inverse = normal.try_inverse()?;
    let mut sums = Sums::default();
    for p in pixels.iter() {
        let left = (1.0 - p.weight / p.variance * (inverse * p.j).dot(&p.j)).max(0.0);
        sums.add(p.weight, left, p.residual, (p.light, k.background), p.variance);
    }
    Some(sums)
}

/// The pixels that take part: columns (or rows) along the stripe, in each those within three widths of the line.
/// `visit` gets offset across, offset along, weight, grey level.
#[inline(always)]
fn window<G: Grey>(
    image: G,
    (x, y): (i32, i32),
    (nx, ny): (f32, f32),
    m0: f32,
    s: &PeakFrame,
    mut visit: impl FnMut(f32, f32, f32),
) {
    // Walk along the image axis that is nearer to the stripe.
    let rows = ny >= nx.abs();
    let (na, nb) = if rows { (nx, ny) } else { (ny, nx) };
    let half = 3.0 * s.s0;
    let reach = (half / nb.abs()).ceil() as i32;
    let mut i = -s.reach_along;
    while i <= s.reach_along {
        let centre = ((m0 - i as f32 * na) / nb + 0.5).floor() as i32;
        for j in centre - reach..=centre + reach {
            let (di, dj) = if rows { (i, j) } else { (j, i) };
            let d = di as f32 * nx + dj as f32 * ny;
            let t = dj as f32 * nx - di as f32 * ny;
            let (a, b) = (x + di, y + dj);
            if (d - m0).abs() <= half && a >= 0 && b >= 0 && a < s.width && b < s.height {
                let fade = (1.0 - s.along_factor * (t * t)).max(0.0);
                visit(d, fade * fade, image.inside(a, b) as f32);
            }
        }
        i += 1;
    }
}

/// Median over the sample of the pixels above half of the local maximum, along the shorter image axis, as a sigma.
fn half_maximum(image: &Image, sample: &[(i32, i32)]) -> Option<f32> {
    let (w, h) = (image.width as i32, image.height as i32);
    let at = |x: i32, y: i32| f32::from(image.get(x.clamp(0, w - 1) as u32, y.clamp(0, h - 1) as u32));
    let mut widths: Vec<f32> = Vec::new();
    for &(x, y) in sample {
        let top = (-1..=1).flat_map(|j| (-1..=1).map(move |i| at(x + i, y + j))).fold(0f32, f32::max);
        let run = |dx: i32, dy: i32| {
            (1..60).take_while(|&k| at(x + k * dx, y + k * dy) > 0.5 * top).count()
                + (1..60).take_while(|&k| at(x - k * dx, y - k * dy) > 0.5 * top).count()
                + 1
        };
        widths.push(run(1, 0).min(run(0, 1)) as f32);
    }
    (widths.len() >= FEWEST).then(|| median(widths) / 2.355)
}

fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values[values.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::noise::Noise;

    const WIDE: f64 = 3.0;
    const SPECKLE: f64 = 0.08;

    /// A stripe that falls over an edge every `face` px, and its middle.
    fn falling(face: u32) -> (Image, Vec<u32>) {
        let mut noise = Noise(5);
        let middle = |x: u32| 60.0 + [0.0, 7.0, 3.0, 12.0][(x / face) as usize % 4];
        let (width, height) = (1200, 140);
        let pixels = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, f64::from(i / width));
                let light = 150.0 * (-0.5 * ((y - middle(x)) / WIDE).powi(2)).exp();
                let scatter = (0.5f64.powi(2) + 0.02 * (light + 4.0) + (SPECKLE * light).powi(2)).sqrt();
                (4.0 + light + noise.normal() * scatter).round().clamp(0.0, 255.0) as u8
            })
            .collect();
        let skeleton = (10..width - 10).map(|x| x | (middle(x).round() as u32) << 16).collect();
        (Image::from_u8(width, height, pixels), skeleton)
    }

    /// Half of the windows hold an edge on faces of 30 px.
    #[test]
    fn edges_are_not_taken_for_speckle() {
        for face in [1200, 60, 30] {
            let (image, skeleton) = falling(face);
            let p = PeakParams { width_px: WIDE as f32, ..PeakParams::default() };
            let found = measure(&image, &skeleton, &p, Vec2::Y).unwrap();
            let off = |is: f32, of: f64| (f64::from(is) / of - 1.0).abs();
            assert!(off(found.width_px, WIDE) < 0.05, "faces of {face} px: {found:?}");
            assert!(off(found.speckle, SPECKLE) < 0.15, "faces of {face} px: {found:?}");
        }
    }
}
