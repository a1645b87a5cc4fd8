//! In: a picture. Out: which of its pixels are darker, or brighter, than their surroundings.
//! Frame and unit: pixels; grey levels.

use super::refine::Grey;

/// Share of the mean of their surroundings below which pixels are dark.
pub const DARK: f64 = 0.8;

/// Pixels below this share of the mean of their surroundings (an eighth of the picture), or above its inverse.
pub fn mask(grey: &Grey, dark: bool, share: f64) -> Vec<bool> {
    let (w, h) = (grey.width, grey.height);
    let mut sums = vec![0.0f64; (w + 1) * (h + 1)];
    for y in 0..h {
        let mut row = 0.0;
        for x in 0..w {
            row += f64::from(grey.levels[y * w + x]);
            sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
        }
    }
    let half = (w.max(h) / 16).max(4);
    let mut mask = vec![false; w * h];
    for y in 0..h {
        let (y0, y1) = (y.saturating_sub(half), (y + half + 1).min(h));
        for x in 0..w {
            let (x0, x1) = (x.saturating_sub(half), (x + half + 1).min(w));
            let at = |x: usize, y: usize| sums[y * (w + 1) + x];
            let mean = (at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0)) / ((x1 - x0) * (y1 - y0)) as f64;
            let level = f64::from(grey.levels[y * w + x]);
            mask[y * w + x] = if dark { level < share * mean } else { level * share > mean };
        }
    }
    mask
}
