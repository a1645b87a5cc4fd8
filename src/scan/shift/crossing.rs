//! In: a picture of a stripe that runs along its columns. Out: the stripe's column in each row, between its flanks.
//! Frame and unit: pixels, grey levels; docs/math.md, Shift.

use crate::raster::Image;
use crate::stages::stripe::{skeleton, thin, threshold};
use crate::stages::{Thinning, ThresholdParams};

/// The stripe in one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Middle between the flanks, px.
    pub u: f64,
    /// Its standard deviation, px.
    pub sigma_px: f64,
    /// Grey levels above the row's background.
    pub amplitude: f64,
    pub saturated: bool,
}

/// Grey levels that a stripe must rise above its row's background: ten times a webcam's noise.
const FAINTEST: f64 = 30.0;
/// Noise of a grey level on a flank, used for the sigma: photographs are compressed and speckled.
const NOISE: f64 = 5.0;
/// Half width in px of the window whose light distinguishes the stripe from glow: a glow is wide and faint, a stripe
/// narrow and bright.
const CORE: usize = 2;

/// The stripe of each row. Of the skeleton's pixels it takes the one with most light in a narrow window. It refines
/// the column to the middle between the positions where the flanks cross half height. On glossy metal saturation
/// cuts off the top, and the width changes tenfold within a picture; the flanks remain usable.
pub fn stripe_by_row(image: &Image) -> Vec<Option<Crossing>> {
    let window = ThresholdParams { size: 101, ..ThresholdParams::default() };
    let skeleton = skeleton::twin(&thin::twin(&threshold::twin(image, &window), Thinning::default()));
    let (width, grey, full) = (image.width as usize, image.to_f32(), f64::from(image.full_scale()));
    let mut best: Vec<Option<(Rank, Crossing)>> = vec![None; image.height as usize];
    let backgrounds: Vec<f64> = grey.chunks_exact(width).map(middle_level).collect();
    for pixel in skeleton {
        let (x, y) = ((pixel & 0xffff) as usize, (pixel >> 16) as usize);
        let row = &grey[y * width..(y + 1) * width];
        let Some((crossing, rank)) = flanks(row, x, backgrounds[y], full) else { continue };
        if best[y].is_none_or(|(most, _)| rank > most) {
            best[y] = Some((rank, crossing));
        }
    }
    best.into_iter().map(|b| b.map(|(_, crossing)| crossing)).collect()
}

/// Light of the brightest narrow window, then the distance between the flanks, which decides between saturated runs.
type Rank = (f64, f64);

fn middle_level(row: &[f32]) -> f64 {
    let mut sorted = row.to_vec();
    let middle = sorted.len() / 2;
    f64::from(*sorted.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// The middle between the half-height positions of the stripe that pixel `x` belongs to.
fn flanks(row: &[f32], mut x: usize, background: f64, full: f64) -> Option<(Crossing, Rank)> {
    let at = |i: usize| f64::from(row[i]);
    let mut top = (x.saturating_sub(CORE)..(x + CORE + 1).min(row.len())).map(at).fold(0.0, f64::max);
    if at(x) < 0.5 * (background + top) {
        return None;
    }
    // From a pixel in the neighbouring glow the run reaches across the stripe itself; then the stripe's top and
    // flanks count.
    let (a, b) = loop {
        let half = 0.5 * (background + top);
        let (mut a, mut b) = (x, x);
        while a > 0 && at(a) >= half {
            a -= 1;
        }
        while b + 1 < row.len() && at(b) >= half {
            b += 1;
        }
        match (a..=b).max_by(|i, k| row[*i].total_cmp(&row[*k])).filter(|i| at(*i) > top) {
            Some(brightest) => (x, top) = (brightest, at(brightest)),
            None => break (a, b),
        }
    };
    let (amplitude, half) = (top - background, 0.5 * (background + top));
    // A stripe that leaves the picture has only one flank.
    if amplitude < FAINTEST || at(a) >= half || at(b) >= half {
        return None;
    }
    let (rise, fall) = (at(a + 1) - at(a), at(b - 1) - at(b));
    let left = a as f64 + (half - at(a)) / rise;
    let right = b as f64 - (half - at(b)) / fall;
    let sigma_px = 0.5 * NOISE * (1.0 / rise).hypot(1.0 / fall);
    let light = row[a..=b]
        .windows(2 * CORE + 1)
        .map(|w| w.iter().map(|&v| f64::from(v) - background).sum())
        .fold(0.0, f64::max);
    let light = if b - a < 2 * CORE { (a..=b).map(|i| at(i) - background).sum() } else { light };
    let crossing = Crossing { u: (left + right) / 2.0, sigma_px, amplitude, saturated: top >= full };
    Some((crossing, (light, right - left)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A saturated stripe with a wide, lopsided glow, as a red channel shows it, and a faint broad reflection beside
    /// it.
    #[test]
    fn neither_glow_nor_reflection_moves_the_middle() {
        for (sigma, glow, reflection) in [(1.6, 0.0, 0.0), (1.6, 90.0, 0.0), (2.5, 120.0, 80.0), (4.0, 60.0, 100.0)] {
            let mut pixels = vec![0u8; 300 * 40];
            for (i, p) in pixels.iter_mut().enumerate() {
                let x = (i % 300) as f64;
                let gauss = |u: f64, s: f64| (-0.5 * ((x - u) / s).powi(2)).exp();
                let level =
                    4.0 + 400.0 * gauss(120.4, sigma) + glow * gauss(132.0, 12.0) + reflection * gauss(220.0, 25.0);
                *p = level.min(255.0) as u8;
            }
            let found: Vec<f64> =
                stripe_by_row(&Image::from_u8(300, 40, pixels)).into_iter().flatten().map(|c| c.u).collect();
            assert!(found.len() > 36, "{} rows", found.len());
            // The glow raises the flank on its side, in proportion to its level there.
            let allowed = 0.05 + 0.02 * glow * sigma / 4.0;
            assert!(found.iter().all(|u| (u - 120.4).abs() < allowed), "{sigma} {glow} {reflection}: {found:?}");
        }
    }
}
