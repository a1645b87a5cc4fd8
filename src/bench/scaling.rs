//! In: times a shot at several picture sizes, and pictures with more and more lit pixels. Out: what a shot costs by
//! itself and what every further pixel, or lit pixel, adds. Frame and unit: ms a shot, megapixels, per cent of the
//! pixels.

use super::rows::Row;
use super::scenes::{Scene, noisy};
use super::steady::{THRESHOLD, steady};
use crate::fault::Result;
use crate::gpu::Device;
use crate::raster::Image;
use crate::stages::chain::batches::Chain;
use crate::stages::chain::config::ChainConfig;

/// A line through times: `intercept_ms + slope_ms x`, and how far from it they lie.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Scaling {
    /// What the line is about, in words.
    pub what: String,
    /// What x counts, and the values of it that were measured.
    pub unit: &'static str,
    /// Smallest measured x, in `unit`.
    pub from: f64,
    /// Largest measured x, in `unit`.
    pub to: f64,
    /// ms a shot that one `unit` more adds.
    pub slope_ms: f64,
    /// ms a shot at x = 0.
    pub intercept_ms: f64,
    /// Smallest and largest measured time over the line's: a cliff shows here.
    pub lowest: f64,
    /// Largest measured time over the line's.
    pub highest: f64,
}

impl Scaling {
    /// Least squares of the relative deviations, so that short times count as much as long ones. `None` where the
    /// values of x are fewer than two.
    fn fit(what: String, unit: &'static str, points: &[(f64, f64)]) -> Option<Scaling> {
        // Of 1 = a / y + b x / y.
        let (mut aa, mut ab, mut bb, mut a1, mut b1) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for &(x, y) in points {
            let (a, b) = (1.0 / y, x / y);
            aa += a * a;
            ab += a * b;
            bb += b * b;
            a1 += a;
            b1 += b;
        }
        let det = aa * bb - ab * ab;
        if !(det > 1e-12 * aa * bb) {
            return None;
        }
        let (intercept_ms, slope_ms) = ((a1 * bb - b1 * ab) / det, (b1 * aa - a1 * ab) / det);
        let over = |&(x, y): &(f64, f64)| y / (intercept_ms + slope_ms * x);
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let (from, to) = range(&mut points.iter().map(|p| p.0));
        let (lowest, highest) = range(&mut points.iter().map(over));
        Some(Scaling { what, unit, from, to, slope_ms, intercept_ms, lowest, highest })
    }
}

/// Over the picture's size, a scene at a time.
pub fn with_pixels(rows: &[Row]) -> Vec<Scaling> {
    let of = |scene: Scene| {
        let points: Vec<_> = rows
            .iter()
            .filter(|r| r.scene == scene)
            .map(|r| (1e-6 * f64::from(r.width) * f64::from(r.height), r.ms_per_shot))
            .collect();
        Scaling::fit(format!("with the pixels, {}", scene.name()), "Mpx", &points)
    };
    Scene::ALL.into_iter().filter_map(of).collect()
}

/// Noise of these sigmas, grey levels, lights up 0.4 to 30 % of the pixels, stripe included.
const NOISE: [f64; 7] = [0.0, 2.5, 3.0, 4.0, 5.0, 7.0, 14.0];
const SIZE: (u32, u32) = (1280, 960);

/// Over the share of lit pixels, `seconds` a share: pictures of one size, a stripe in more and more noise.
pub fn with_light(device: &Device, seconds: f64) -> Result<Scaling> {
    let config = ChainConfig { threshold: THRESHOLD, ..ChainConfig::new(SIZE.0, SIZE.1, 8).on(device) };
    let mut points = Vec::new();
    for noise in NOISE {
        let images: Vec<Image> = (0..u64::from(config.shots)).map(|seed| noisy(SIZE.0, SIZE.1, noise, seed)).collect();
        let batch: Vec<&Image> = images.iter().collect();
        let mut chain = Chain::new(device, &config)?;
        // Compiles, and tells how many pixels are lit.
        chain.submit(0, &batch)?;
        chain.collect(true)?;
        let lit = 100.0 * chain.lit(0)?.count() as f64 / f64::from(SIZE.0 * SIZE.1);
        points.push((lit, steady(&mut chain, seconds, &|_| batch.clone(), &[])?.ms_per_shot));
    }
    let what = format!("with the light, {}x{}", SIZE.0, SIZE.1);
    Ok(Scaling::fit(what, "% lit", &points).expect("shares that differ"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_and_a_cliff_is_seen() {
        let line = |x: f64| (x, 0.3 + 0.8 * x);
        let fit = Scaling::fit(String::new(), "Mpx", &[0.3, 1.2, 12.6, 26.2].map(line)).unwrap();
        assert!((fit.intercept_ms - 0.3).abs() < 1e-9 && (fit.slope_ms - 0.8).abs() < 1e-9);
        assert!((fit.lowest - 1.0).abs() < 1e-9 && (fit.highest - 1.0).abs() < 1e-9);
        assert_eq!((fit.from, fit.to), (0.3, 26.2));
        let cliff = [line(0.3), line(1.2), line(12.6), (26.2, 60.0)];
        assert!(Scaling::fit(String::new(), "Mpx", &cliff).unwrap().highest > 1.2);
        assert!(Scaling::fit(String::new(), "Mpx", &[line(2.0), line(2.0)]).is_none());
        assert!(Scaling::fit(String::new(), "Mpx", &[line(2.0)]).is_none());
    }
}
