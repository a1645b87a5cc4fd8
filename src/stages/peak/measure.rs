//! In: a picture with a stripe and its skeleton. Out: the stripe's width, its speckle contrast and the sensor's noise,
//! measured on the light itself. Frame and unit: Gaussian sigma in px; speckle is a ratio. docs/math.md, Stripe peak
//! (6).

use super::found::Peak;
use super::grey::{Grey, View};
use super::noise::grain::{self, Cell, Grains};
use super::noise::scatter::{Scatter, Sums, most};
use super::params::{Method, PeakParams, Stripe};
use super::{PeakFrame, twin};
use crate::raster::{Image, Pixels};
use crate::stages::stripe::choose_params::ChooseParams;
use glam::Vec2;
use nalgebra::{Matrix3, Vector3};

/// Skeleton pixels that are used, spread over the picture. The median of 400 has a standard deviation of 6 % of the
/// spread.
const SAMPLES: usize = 400;
/// Fewer usable peaks than this give no result.
const FEWEST: usize = 20;
/// Pairs of pixels over all windows that are used if grains correlate them.
const PAIRS: usize = 1_000_000;

/// Least amplitude over noise of the peaks that are used.
pub const CLEAR: f32 = 10.0;
/// The same for stripes so dim that no picture has enough peaks above [`CLEAR`].
pub const DIM: f32 = 4.0;

/// Width, speckle and noise of the stripe in one picture, and the dark pixels' noise as assumed. `None` if there is too
/// little of the stripe. `across` is the unit image direction of depth. The first estimate of the width is the number
/// of pixels above half maximum over 2.355. Three rounds of fits follow, each with the results of the round before.
pub fn measure(image: &Image, skeleton: &[u32], p: &PeakParams, across: Vec2, least_snr: f32) -> Option<Stripe> {
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
        stripe = match &image.pixels {
            Pixels::U8(pixels) => look(View { pixels, width, height }, &sample, &setup, (p, least_snr), stripe)?,
            Pixels::U16(pixels) => look(View { pixels, width, height }, &sample, &setup, (p, least_snr), stripe)?,
        };
    }
    Some(stripe)
}

/// One round: fits with sizes and weights from the stripe `before`, and what they give.
fn look<G: Grey>(
    image: G,
    sample: &[(i32, i32)],
    s: &PeakFrame,
    (p, least_snr): (&PeakParams, f32),
    before: Stripe,
) -> Option<Stripe> {
    let fits = fits(image, sample, s, least_snr);
    if fits.len() < FEWEST {
        return None;
    }
    let mut fits = of_one_surface(fits, before.grain_px);
    let width_px = width_of_most_light(&fits);
    let grain_px = Grains::sigma(fits.iter().map(|f| grains(image, f.at, &f.peak, s)).collect(), before.grain_px);
    let mut more = Vec::new();
    if grain_px > 0.0 {
        let columns = (2 * s.reach_along() + 1) as usize;
        let pairs = grain::pairs((6.0 * s.s0) as usize * columns, columns, grain_px);
        let few = (PAIRS / pairs.max(1)).clamp(FEWEST, SAMPLES);
        let step = fits.len().div_ceil(few);
        fits = fits.into_iter().step_by(step).collect();
        let mut all = Vec::new();
        more = fits.iter_mut().filter_map(|f| f.with_grains(image, s, grain_px, &mut all)).collect();
    }
    let factor = if more.is_empty() { 1.0 } else { median(more).max(1.0).sqrt() };
    let sums: Vec<Sums> = fits.iter().map(|f| f.sums).collect();
    let found = Scatter::fit(&sums, &Scatter::of(p), s.full_scale / p.levels.span);
    Some(Stripe {
        width_px: width_px.clamp(0.4, 12.0),
        speckle: found.speckle,
        grain_px,
        grain_factor: factor,
        read_noise: Some(found.read_noise),
        gain: Some(found.gain),
        ..before
    })
}

/// A usable peak, the skeleton pixel that it was fitted at, and its squared residuals.
struct Fit {
    at: (i32, i32),
    peak: Peak,
    sums: Sums,
}

/// The usable peaks. Clipped light hides width and noise, and a spot of one pixel is a hot pixel.
fn fits<G: Grey>(image: G, sample: &[(i32, i32)], s: &PeakFrame, least_snr: f32) -> Vec<Fit> {
    let mut pixels = Vec::new();
    let skeleton: Vec<u32> = sample.iter().map(|&(x, y)| x as u32 | (y as u32) << 16).collect();
    let peaks = twin::each(image, &skeleton, 0, s, Method::Gaussian);
    let usable = |k: &Peak| k.flags == 0 && k.snr > least_snr && (0.4 * s.s0..2.5 * s.s0).contains(&k.width_px);
    let peaks = peaks.into_iter().zip(sample).filter(|(k, _)| usable(k));
    peaks.filter_map(|(peak, &at)| Some(Fit { at, sums: residuals(image, at, &peak, s, &mut pixels)?, peak })).collect()
}

/// Fits whose residuals are noise. Where a stripe falls over an edge, two pieces of it lie in one window. On parts with
/// many small faces such windows are the majority, and their residuals grow with the light as speckle does. The best
/// quarter shows the usual level.
fn of_one_surface(mut fits: Vec<Fit>, grain: f32) -> Vec<Fit> {
    fits.sort_by(|a, b| a.sums.misfit().total_cmp(&b.sums.misfit()));
    let usual = fits[fits.len() / 4].sums.misfit();
    fits.retain(|f| {
        let free = f.sums.freedom() / grain::columns_of_a_grain(grain).powi(2);
        f.sums.misfit() <= usual * most(free)
    });
    fits
}

/// A pixel of a fit: its weight, its residual, its variance, and its terms of the fit.
struct Pixel {
    weight: f32,
    residual: f32,
    variance: f32,
    cell: Cell,
}

/// Stores the window's pixels in `all`; returns the covariance of the fit's three parameters. The share of a pixel's
/// noise that remains in its residual is 1 - leverage.
fn pixels<G: Grey>(image: G, at: (i32, i32), k: &Peak, s: &PeakFrame, all: &mut Vec<Pixel>) -> Option<Matrix3<f32>> {
    let n = (k.normal_u, k.normal_v);
    let m = middle(at, k);
    all.clear();
    window(image, at, n, m, s.reach_along(), s, |at, d, t, level| {
        let fade = (1.0 - s.along_factor * (t * t)).max(0.0);
        let weight = fade * fade;
        let z = (d - m) / k.width_px;
        let shape = (-0.5 * z * z).exp();
        let light = k.amplitude * shape;
        let j = Vector3::new(shape, light * z / k.width_px, light * z * z / k.width_px);
        let variance = s.read2 + s.gain * (light + k.background) + s.speckle2 * light * light;
        let cell = Cell { at, j, light, certainty: weight / variance };
        all.push(Pixel { weight, residual: level - k.background - light, variance, cell });
    });
    let mut normal = Matrix3::zeros();
    for Pixel { cell, .. } in all.iter() {
        normal += cell.j * cell.j.transpose() * cell.certainty;
    }
    normal.try_inverse()
}

/// The squared residuals of the window. `all` is reused memory.
fn residuals<G: Grey>(image: G, at: (i32, i32), k: &Peak, s: &PeakFrame, all: &mut Vec<Pixel>) -> Option<Sums> {
    let inverse = pixels(image, at, k, s, all)?;
    let mut sums = Sums::default();
    for p in all.iter() {
        let left = (1.0 - p.cell.certainty * (inverse * p.cell.j).dot(&p.cell.j)).max(0.0);
        sums.add(p.weight, (left, left), p.residual, (p.cell.light, k.background), p.variance);
    }
    Some(sums)
}

impl Fit {
    /// Recomputes the squared residuals for speckle with grains, of which a fit absorbs more. Returns the centre's
    /// variance over its variance without grains.
    fn with_grains<G: Grey>(&mut self, image: G, s: &PeakFrame, grain: f32, all: &mut Vec<Pixel>) -> Option<f32> {
        let inverse = pixels(image, self.at, &self.peak, s, all)?;
        let stride = grain::stride(grain);
        all.retain(|p| p.cell.at.iter().all(|k| k.rem_euclid(stride) == 0));
        let cells: Vec<&Cell> = all.iter().map(|p| &p.cell).collect();
        let (grained, more) = grain::grained(&cells, &inverse, grain);
        self.sums = Sums::default();
        for (p, grained) in all.iter().zip(grained) {
            let left = (1.0 - p.cell.certainty * (inverse * p.cell.j).dot(&p.cell.j)).max(0.0);
            let light = (p.cell.light, self.peak.background);
            self.sums.add(p.weight, (left, grained), p.residual, light, p.variance);
        }
        Some(more)
    }
}

/// Offset of a peak's line from its skeleton pixel, px across.
fn middle((x, y): (i32, i32), k: &Peak) -> f32 {
    (k.u - x as f32) * k.normal_u + (k.v - y as f32) * k.normal_v
}

/// The centres of the columns (or rows) along a peak's line relative to the model's centre, and their variance without
/// that of speckle. The weight falls with the distance from the line: with a sharp limit each pixel that enters or
/// leaves would move the centre.
fn grains<G: Grey>(image: G, at: (i32, i32), k: &Peak, s: &PeakFrame) -> Grains {
    let (n, m) = ((k.normal_u, k.normal_v), middle(at, k));
    let reach = Grains::reach(s.reach_along());
    let mut columns = vec![(0.0, 0.0, 0.0); 2 * reach as usize + 1];
    window(image, at, n, m, reach, s, |[i, _], d, _, level| {
        let (light, moment, white) = &mut columns[(i + reach) as usize];
        let z = (d - m) / k.width_px;
        let fade = (-0.25 * z * z).exp();
        *light += fade * (level - k.background);
        *moment += fade * z * (level - k.background);
        *white += (fade * z).powi(2) * (s.read2 + s.gain * level);
    });
    if columns.iter().any(|c| c.0 <= 0.0) {
        return Grains::default();
    }
    Grains::new(&columns.iter().map(|c| (c.1 / c.0, c.2 / (c.0 * c.0))).collect::<Vec<_>>())
}

/// Visits the pixels of a window: `reach` columns (or rows) along the stripe to both sides, and in each those within
/// three widths of the line. `visit` receives column and row from the skeleton pixel, offset across, offset along, grey
/// level.
#[inline(always)]
fn window<G: Grey>(
    image: G,
    (x, y): (i32, i32),
    (nx, ny): (f32, f32),
    m0: f32,
    reach: i32,
    s: &PeakFrame,
    mut visit: impl FnMut([i32; 2], f32, f32, f32),
) {
    // Steps follow the image axis that the stripe is closer to.
    let rows = ny >= nx.abs();
    let (na, nb) = if rows { (nx, ny) } else { (ny, nx) };
    let half = 3.0 * s.s0;
    let reach_across = (half / nb.abs()).ceil() as i32;
    for i in -reach..=reach {
        let centre = ((m0 - i as f32 * na) / nb + 0.5).floor() as i32;
        for j in centre - reach_across..=centre + reach_across {
            let (di, dj) = if rows { (i, j) } else { (j, i) };
            let d = di as f32 * nx + dj as f32 * ny;
            let t = dj as f32 * nx - di as f32 * ny;
            let (a, b) = (x + di, y + dj);
            if (d - m0).abs() <= half && a >= 0 && b >= 0 && a < s.width && b < s.height {
                visit([i, j], d, t, image.inside(a, b) as f32);
            }
        }
    }
}

/// Number of pixels above half of the local maximum, along the image axis on which there are fewer, as a sigma: the
/// median over the sample.
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

/// The width that separates the fitted light into two halves, of narrower and of wider peaks. If the sheet runs along
/// an edge, most peaks of a shot can come from light that falls over it. They are narrower than the stripe and have
/// only part of its light.
fn width_of_most_light(fits: &[Fit]) -> f32 {
    let mut fits: Vec<(f32, f32)> =
        fits.iter().map(|f| (f.peak.width_px, f.peak.amplitude * f.peak.width_px)).collect();
    fits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * fits.iter().map(|f| f.1).sum::<f32>();
    let mut light = 0.0;
    let narrower = |f: &&(f32, f32)| {
        light += f.1;
        light < half
    };
    let narrower = fits.iter().take_while(narrower).count();
    fits[narrower.min(fits.len() - 1)].0
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

    /// A quarter of a picture's stripe lies on a face, the rest runs along an edge. There nine tenths of the light fall
    /// over it, and a sliver remains (half as wide as the stripe, a fifth as bright).
    #[test]
    fn slivers_of_light_along_an_edge_are_not_the_stripe() {
        let mut noise = Noise(7);
        let (width, height) = (1200, 60);
        let pixels = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, f64::from(i / width) - 30.0);
                let (light, wide) = if x < 300 { (150.0, WIDE) } else { (30.0, 0.5 * WIDE) };
                let light = light * (-0.5 * (y / wide).powi(2)).exp();
                let scatter = (0.5f64.powi(2) + 0.02 * (light + 4.0) + (SPECKLE * light).powi(2)).sqrt();
                (4.0 + light + noise.normal() * scatter).round().clamp(0.0, 255.0) as u8
            })
            .collect();
        let skeleton: Vec<u32> = (10..width - 10).map(|x| x | 30 << 16).collect();
        let image = Image::from_u8(width, height, pixels);
        let found = measure(&image, &skeleton, &PeakParams::default(), Vec2::Y, CLEAR).unwrap();
        assert!((f64::from(found.width_px) / WIDE - 1.0).abs() < 0.05, "{found:?}");
        assert!((f64::from(found.speckle) / SPECKLE - 1.0).abs() < 0.15, "{found:?}");
    }

    /// A stripe that falls over an edge every `face` px, and its skeleton. In every `print` px it is half as bright
    /// over half of the distance, with transitions of 2 px.
    fn falling(face: u32, print: f64) -> (Image, Vec<u32>) {
        let mut noise = Noise(5);
        let middle = |x: u32| 60.0 + [0.0, 7.0, 3.0, 12.0][(x / face) as usize % 4];
        let (width, height) = (1200, 140);
        let pixels = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, f64::from(i / width));
                let edge = (0.5 * print - (f64::from(x) % print - 0.5 * print).abs()) - 0.25 * print;
                let white = 0.75 + 0.25 * (0.5 * edge).tanh();
                let light = 150.0 * white * (-0.5 * ((y - middle(x)) / WIDE).powi(2)).exp();
                let scatter = (0.5f64.powi(2) + 0.02 * (light + 4.0) + (SPECKLE * light).powi(2)).sqrt();
                (4.0 + light + noise.normal() * scatter).round().clamp(0.0, 255.0) as u8
            })
            .collect();
        let skeleton = (10..width - 10).map(|x| x | (middle(x).round() as u32) << 16).collect();
        (Image::from_u8(width, height, pixels), skeleton)
    }

    /// With faces of 30 px half of the windows contain an edge of a face. As many contain an edge of the print.
    #[test]
    fn edges_are_not_taken_for_speckle() {
        for (face, print) in [(1200, 1e6), (60, 1e6), (30, 1e6), (1200, 60.0), (60, 90.0)] {
            let (image, skeleton) = falling(face, print);
            let p = PeakParams { width_px: WIDE as f32, ..PeakParams::default() };
            let found = measure(&image, &skeleton, &p, Vec2::Y, CLEAR).unwrap();
            let off = |is: f32, of: f64| (f64::from(is) / of - 1.0).abs();
            assert!(off(found.width_px, WIDE) < 0.05, "faces of {face} px, print of {print}: {found:?}");
            assert!(off(found.speckle, SPECKLE) < 0.15, "faces of {face} px, print of {print}: {found:?}");
            assert_eq!(found.grain_px, 0.0, "faces of {face} px, print of {print}: {found:?}");
        }
    }

    /// The lower edge of a cylinder across the picture, up to 45 degrees steep, and its skeleton.
    fn bent(radius: f64, wide: f64, speckle: f64) -> (Image, Vec<u32>) {
        let mut noise = Noise(9);
        let half = (0.7 * radius) as u32;
        let (width, height) = (2 * half + 1, (0.3 * radius) as u32 + 80);
        let across = |x: u32| f64::from(x) - f64::from(half);
        let above = radius - f64::from(height) + 40.0;
        let pixels = (0..width * height)
            .map(|i| {
                let from = across(i % width).hypot(f64::from(i / width) + above) - radius;
                let light = 150.0 * (-0.5 * (from / wide).powi(2)).exp();
                let scatter = (0.5f64.powi(2) + 0.02 * (light + 4.0) + (speckle * light).powi(2)).sqrt();
                (4.0 + light + noise.normal() * scatter).round().clamp(0.0, 255.0) as u8
            })
            .collect();
        let middle = |x: u32| (radius * radius - across(x).powi(2)).sqrt() - above;
        let skeleton = (40..width - 40).map(|x| x | (middle(x).round() as u32) << 16).collect();
        (Image::from_u8(width, height, pixels), skeleton)
    }

    /// A bend moves columns that are far apart in the same way, as large grains do.
    #[test]
    fn a_bent_line_has_no_grains() {
        for (radius, wide, speckle) in [400.0, 700.0, 1500.0]
            .into_iter()
            .flat_map(|r| [(r, 1.5, 0.0), (r, 6.0, 0.0), (r, 3.0, SPECKLE), (r, 6.0, SPECKLE)])
        {
            let (image, skeleton) = bent(radius, wide, speckle);
            let p = PeakParams { width_px: wide as f32, ..PeakParams::default() };
            let found = measure(&image, &skeleton, &p, Vec2::Y, CLEAR).unwrap();
            let off = |is: f32, of: f64, least: f64| (f64::from(is) - of).abs() / of.max(least);
            let line = format!("{wide} px along {radius} px, speckle {speckle}: {found:?}");
            assert_eq!(found.grain_px, 0.0, "{line}");
            assert!(off(found.width_px, wide, 0.0) < 0.02 && off(found.speckle, speckle, 0.1) < 0.15, "{line}");
        }
    }
}
