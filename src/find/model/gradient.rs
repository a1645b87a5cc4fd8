//! In: a layer with missing cells. Out: at every cell the slope of the weighted plane through its
//! 5x5 neighbourhood (docs/math.md, Shape matching (1)); missing cells have no weight, so a gap in a
//! level surface has slope zero and never looks like an edge.
//! Frame and unit: pixels; slopes in the layer's unit per pixel.

use crate::find::scene::Layer;
use rayon::prelude::*;

/// Gaussian weights with sigma 1 px at -2..2.
const WEIGHT: [f32; 5] = [0.135_335_28, 0.606_530_66, 1.0, 0.606_530_66, 0.135_335_28];
/// A neighbourhood with less than this share of the full weight gives no slope.
const MIN_WEIGHT: f32 = 0.35;
/// Below this share of the full determinant the neighbourhood is nearly a line.
const MIN_SPREAD: f32 = 0.10;

/// Slopes of a layer; where they are unknown, both are 0 and `seen` is false.
#[derive(Clone, Debug)]
pub struct Field {
    /// Columns, px.
    pub width: usize,
    /// Rows, px.
    pub height: usize,
    /// Slope towards larger columns, the layer's unit per px; row-major.
    pub gx: Vec<f32>,
    /// Slope towards larger rows, the layer's unit per px; row-major.
    pub gy: Vec<f32>,
    /// Whether the slope is known; row-major.
    pub seen: Vec<bool>,
}

impl Field {
    /// Steepness at cell `i` (row-major), the layer's unit per px.
    pub fn magnitude(&self, i: usize) -> f32 {
        self.gx[i].hypot(self.gy[i])
    }

    /// Bilinear slope at a place; `None` where one of the four cells is unseen or outside.
    pub fn at(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (fx, fy) = (x.floor(), y.floor());
        if fx < 0.0 || fy < 0.0 || fx + 1.0 >= self.width as f64 || fy + 1.0 >= self.height as f64 {
            return None;
        }
        let (i, a, b) = (fy as usize * self.width + fx as usize, x - fx, y - fy);
        let corners = [i, i + 1, i + self.width, i + self.width + 1];
        if corners.iter().any(|&c| !self.seen[c]) {
            return None;
        }
        let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
        let mut g = (0.0, 0.0);
        for (c, w) in corners.into_iter().zip(weights) {
            g.0 += w * f64::from(self.gx[c]);
            g.1 += w * f64::from(self.gy[c]);
        }
        Some(g)
    }

    /// Standard deviation of a slope component over featureless cells, from the lower quartile of the
    /// magnitudes (Rayleigh: 0.7585 sigma).
    pub fn noise(&self) -> f32 {
        let step = (self.gx.len() / 20_000).max(1);
        let mut m: Vec<f32> =
            (0..self.gx.len()).step_by(step).filter(|&i| self.seen[i]).map(|i| self.magnitude(i)).collect();
        if m.is_empty() {
            return 0.0;
        }
        let q = m.len() / 4;
        *m.select_nth_unstable_by(q, f32::total_cmp).1 / 0.7585
    }
}

/// The slopes of a layer.
pub fn slopes(layer: &Layer) -> Field {
    if layer.complete() { complete(layer) } else { with_gaps(layer) }
}

/// Without gaps the plane fit is two separable filters.
fn complete(layer: &Layer) -> Field {
    let (w, h) = (layer.width, layer.height);
    let (s0, s2) = sums();
    let mut smooth = vec![0f32; w * h];
    let mut slope = vec![0f32; w * h];
    smooth.par_chunks_mut(w).zip(slope.par_chunks_mut(w)).enumerate().for_each(|(y, (a, b))| {
        let row = &layer.values[y * w..(y + 1) * w];
        if w < 5 {
            return;
        }
        let inner = a[2..w - 2].iter_mut().zip(&mut b[2..w - 2]);
        for ((sm, sl), v) in inner.zip(row.windows(5)) {
            *sm = WEIGHT[0] * (v[0] + v[4]) + WEIGHT[1] * (v[1] + v[3]) + v[2];
            *sl = 2.0 * WEIGHT[0] * (v[4] - v[0]) + WEIGHT[1] * (v[3] - v[1]);
        }
    });
    let mut field = empty(w, h);
    let norm = 1.0 / (s0 * s2);
    let rows = field.gx.par_chunks_mut(w).zip(field.gy.par_chunks_mut(w)).zip(field.seen.par_chunks_mut(w));
    rows.enumerate().for_each(|(y, ((gx, gy), seen))| {
        if y < 2 || y + 2 >= h || w < 5 {
            return;
        }
        let s: [&[f32]; 5] = std::array::from_fn(|k| &smooth[(y + k - 2) * w..(y + k - 1) * w]);
        let d: [&[f32]; 5] = std::array::from_fn(|k| &slope[(y + k - 2) * w..(y + k - 1) * w]);
        for x in 2..w - 2 {
            gx[x] = norm * (WEIGHT[0] * (d[0][x] + d[4][x]) + WEIGHT[1] * (d[1][x] + d[3][x]) + d[2][x]);
            gy[x] = norm * (2.0 * WEIGHT[0] * (s[4][x] - s[0][x]) + WEIGHT[1] * (s[3][x] - s[1][x]));
            seen[x] = true;
        }
    });
    field
}

/// With gaps each neighbourhood has its own normal equations.
fn with_gaps(layer: &Layer) -> Field {
    let (w, h) = (layer.width, layer.height);
    let (s0, s2) = sums();
    let mut field = empty(w, h);
    let full = s0 * s2;
    let rows = field.gx.par_chunks_mut(w).zip(field.gy.par_chunks_mut(w)).zip(field.seen.par_chunks_mut(w));
    rows.enumerate().for_each(|(y, ((gx, gy), seen))| {
        for x in 0..w {
            let centre = layer.values[y * w + x];
            if centre.is_nan() {
                continue;
            }
            let mut m = [0f32; 9];
            for dy in -2i64..=2 {
                for dx in -2i64..=2 {
                    let (xx, yy) = (x as i64 + dx, y as i64 + dy);
                    if xx < 0 || yy < 0 || xx >= w as i64 || yy >= h as i64 {
                        continue;
                    }
                    let v = layer.values[yy as usize * w + xx as usize];
                    if v.is_nan() {
                        continue;
                    }
                    let k = WEIGHT[(dx + 2) as usize] * WEIGHT[(dy + 2) as usize];
                    let (fx, fy, z) = (dx as f32, dy as f32, v - centre);
                    let terms = [1.0, fx, fy, fx * fx, fx * fy, fy * fy, z, fx * z, fy * z];
                    for (sum, t) in m.iter_mut().zip(terms) {
                        *sum += k * t;
                    }
                }
            }
            if m[0] < MIN_WEIGHT * s0 * s0 {
                continue;
            }
            let (xx, xy, yy) = (m[3] - m[1] * m[1] / m[0], m[4] - m[1] * m[2] / m[0], m[5] - m[2] * m[2] / m[0]);
            let (xz, yz) = (m[7] - m[1] * m[6] / m[0], m[8] - m[2] * m[6] / m[0]);
            let det = xx * yy - xy * xy;
            if det < MIN_SPREAD * full * full {
                continue;
            }
            gx[x] = (xz * yy - yz * xy) / det;
            gy[x] = (yz * xx - xz * xy) / det;
            seen[x] = true;
        }
    });
    field
}

fn sums() -> (f32, f32) {
    (WEIGHT.iter().sum(), 2.0 * (4.0 * WEIGHT[0] + WEIGHT[1]))
}

fn empty(w: usize, h: usize) -> Field {
    Field { width: w, height: h, gx: vec![0.0; w * h], gy: vec![0.0; w * h], seen: vec![false; w * h] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::scene::Kind;

    fn layer(f: impl Fn(usize, usize) -> f32) -> Layer {
        let values = (0..40 * 30).map(|i| f(i % 40, i / 40)).collect();
        Layer::new(Kind::Height, 40, 30, values).unwrap()
    }

    #[test]
    fn a_ramp_has_its_slope_with_and_without_gaps() {
        let ramp = |x: usize, y: usize| 0.3 * x as f32 - 0.7 * y as f32;
        let whole = slopes(&layer(ramp));
        let gaps = slopes(&layer(|x, y| if (x * 7 + y * 3) % 5 == 0 { f32::NAN } else { ramp(x, y) }));
        let mut compared = 0;
        for i in 0..whole.gx.len() {
            if whole.seen[i] {
                assert!((whole.gx[i] - 0.3).abs() < 1e-4 && (whole.gy[i] + 0.7).abs() < 1e-4);
            }
            if gaps.seen[i] {
                compared += 1;
                assert!((gaps.gx[i] - 0.3).abs() < 1e-4 && (gaps.gy[i] + 0.7).abs() < 1e-4);
            }
        }
        assert!(compared > 700);
    }

    #[test]
    fn a_hole_in_a_level_surface_is_no_edge() {
        let hole = slopes(&layer(|x, y| if (12..25).contains(&x) && (8..20).contains(&y) { f32::NAN } else { 5.0 }));
        assert!((0..hole.gx.len()).all(|i| hole.magnitude(i) == 0.0));
        assert!(hole.seen.iter().filter(|s| **s).count() > 700);
    }

    #[test]
    fn both_paths_agree_on_a_complete_map() {
        let bumps = layer(|x, y| ((x * x) as f32 * 0.01).sin() + (y as f32 * 0.3).cos());
        let (a, b) = (complete(&bumps), with_gaps(&bumps));
        for y in 2..28 {
            for x in 2..38 {
                let i = y * 40 + x;
                assert!((a.gx[i] - b.gx[i]).abs() < 1e-5 && (a.gy[i] - b.gy[i]).abs() < 1e-5);
            }
        }
    }
}
