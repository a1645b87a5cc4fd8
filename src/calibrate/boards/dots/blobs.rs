//! In: a picture. Out: its round spots.
//! Frame and unit: pixels.

use super::super::mask::{DARK, mask};
use super::super::refine::Grey;
use super::lattice::Blob;
use crate::geometry::Vec2;
use nalgebra::Matrix2;

/// Elliptic patches darker (or brighter) than their surroundings; with `holes` also those with a round hole in the
/// middle.
pub fn blobs(grey: &Grey, dark: bool, holes: bool) -> Vec<Blob> {
    let (w, h) = (grey.width, grey.height);
    let mask = mask(grey, dark, DARK);
    let mut seen = vec![false; w * h];
    let mut found = Vec::new();
    let mut stack = Vec::new();
    for first in 0..w * h {
        if seen[first] || !mask[first] {
            continue;
        }
        stack.push(first);
        seen[first] = true;
        let (mut n, mut sum, mut square, mut border, mut light) = (0.0, Vec2::zeros(), Matrix2::zeros(), false, 0.0);
        while let Some(k) = stack.pop() {
            let (x, y) = (k % w, k / w);
            let p = Vec2::new(x as f64, y as f64);
            n += 1.0;
            light += f64::from(grey.levels[k]);
            sum += p;
            square += p * p.transpose();
            border |= x == 0 || y == 0 || x + 1 == w || y + 1 == h;
            let neighbours =
                [(x > 0, k.wrapping_sub(1)), (x + 1 < w, k + 1), (y > 0, k.wrapping_sub(w)), (y + 1 < h, k + w)];
            for (inside, m) in neighbours {
                if inside && mask[m] && !seen[m] {
                    seen[m] = true;
                    stack.push(m);
                }
            }
        }
        if border || !(16.0..0.05 * (w * h) as f64).contains(&n) {
            continue;
        }
        let centre = sum / n;
        // The second moments of a filled ellipse are a quarter of its squared semi-axes; 1/12 is the pixel's own
        // moment.
        let moments = square / n - centre * centre.transpose();
        let axes = moments.symmetric_eigenvalues();
        let area = 4.0 * std::f64::consts::PI * (axes[0] * axes[1]).max(0.0).sqrt();
        let Some(inverse) = (moments * 4.0).try_inverse() else { continue };
        // The area of a filled ellipse follows from its moments; squares deviate by 5 %, crosses and rings by more.
        let hole = holes && is_holed(grey, dark, &centre, light / n);
        // A hole of four tenths of the diameter makes the area by the moments 1.4 times too large.
        let round = if hole { (0.92..2.2).contains(&(area / n)) } else { (area / n - 1.0).abs() < 0.08 };
        if round && axes.max() < 16.0 * axes.min() {
            found.push(Blob { centre, shape: inverse, hole });
        }
    }
    found
}

/// Whether the middle of a spot differs from the spot's mean level towards the ground. The middle of a plain one
/// differs the other way, because its rim is blurred.
fn is_holed(grey: &Grey, dark: bool, centre: &Vec2, mean: f64) -> bool {
    let (x, y) = (centre.x.round() as usize, centre.y.round() as usize);
    if x == 0 || y == 0 || x + 1 >= grey.width || y + 1 >= grey.height {
        return false;
    }
    let rows = (y - 1..=y + 1).flat_map(|y| &grey.levels[y * grey.width + x - 1..=y * grey.width + x + 1]);
    let level = rows.map(|l| f64::from(*l)).sum::<f64>() / 9.0;
    if dark { level > 1.25 * mean } else { level < 0.85 * mean }
}
