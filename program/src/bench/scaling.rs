//! In: times per shot at several picture sizes, and pictures with increasing shares of bright pixels. Out: the
//! constant time per shot, and the time per further pixel or bright pixel. Frame and unit: ms a shot, megapixels,
//! per cent of the pixels.

use super::rows::Row;
use super::scenes::{Scene, noisy};
use super::steady::{THRESHOLD, steady};
use sheetlight::fault::Result;
use sheetlight::gpu::Device;
use sheetlight::raster::Image;
use sheetlight::stages::chain::batches::Chain;
use sheetlight::stages::chain::config::ChainConfig;

/// A line through times: `intercept_ms + slope_ms x`, with the deviations from it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Scaling {
    /// Description of the line, in words.
    pub what: String,
    /// Unit of x.
    pub unit: &'static str,
    /// Smallest measured x, in `unit`.
    pub from: f64,
    /// Largest measured x, in `unit`.
    pub to: f64,
    /// Slope, ms a shot per `unit`.
    pub slope_ms: f64,
    /// Time per shot at x = 0, ms.
    pub intercept_ms: f64,
    /// Smallest ratio of a measured time to the line's; sudden jumps show here.
    pub lowest: f64,
    /// Largest ratio of a measured time to the line's.
    pub highest: f64,
}

impl Scaling {
    /// Least squares of the relative deviations, so that short times count as much as long ones. `None` for fewer
    /// than two values of x.
    fn fit(what: String, unit: &'static str, points: &[(f64, f64)]) -> Option<Scaling> {
        // Fit of 1 = a / y + b x / y.
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

/// Lines over the picture's size, one for each scene.
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

/// Noise sigmas, grey levels, that make 0.4 to 30 % of the pixels bright, including the stripe.
const NOISE: [f64; 7] = [0.0, 2.5, 3.0, 4.0, 5.0, 7.0, 14.0];
const SIZE: (u32, u32) = (1280, 960);

/// Line over the share of bright pixels, `seconds` per share: pictures of one size, a stripe in increasing noise.
pub fn with_light(device: &Device, seconds: f64) -> Result<Scaling> {
    let config = ChainConfig { threshold: THRESHOLD, ..ChainConfig::new(SIZE.0, SIZE.1, 8).on(device) };
    let mut points = Vec::new();
    for noise in NOISE {
        let images: Vec<Image> = (0..u64::from(config.shots)).map(|seed| noisy(SIZE.0, SIZE.1, noise, seed)).collect();
        let batch: Vec<&Image> = images.iter().collect();
        let mut chain = Chain::new(device, &config)?;
        // Compiles the chain, and gives the number of bright pixels.
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
