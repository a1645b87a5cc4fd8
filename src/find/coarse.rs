//! In: slope fields of one pyramid level and a shape model turned and scaled. Out: places where many of
//! the model's directions are met within a few pixels (quantised and spread as in [hinterstoisser12]).
//! Frame and unit: pixels of that level; scores are integers, 0 to 4 a feature.

use super::gradient::Field;
use super::model::{ModelPoint, thin};
use super::scene::Kind;
use rayon::prelude::*;

/// Directions over a full turn.
pub const BINS: usize = 16;
/// A picture is searched every `STRIDE` pixels and directions are spread over a window of that size.
pub const STRIDE: usize = 4;
/// A perfect feature. 63 features of 4 fill an 8-bit sum.
pub const FULL: u8 = 4;
pub const MAX_FEATURES: usize = 63;

/// The nearest of 16 directions.
pub fn bin(gx: f64, gy: f64) -> usize {
    let turn = gy.atan2(gx) / std::f64::consts::TAU * BINS as f64;
    turn.round().rem_euclid(BINS as f64) as usize % BINS
}

/// One bit a cell for the direction of its slope; 0 below `threshold`. Integer arithmetic after the
/// comparison with the bins' borders, so that a GPU gives the same bits.
pub fn quantise(field: &Field, threshold: f32) -> Vec<u16> {
    let limit = threshold * threshold;
    field
        .gx
        .par_iter()
        .zip(&field.gy)
        .map(
            |(&gx, &gy)| {
                if gx * gx + gy * gy < limit || limit <= 0.0 && gx == 0.0 && gy == 0.0 {
                    0
                } else {
                    1 << sector(gx, gy)
                }
            },
        )
        .collect()
}

/// As [`bin`], by comparisons only: tan(11.25 degrees) and tan(33.75 degrees) border the bins of an octant.
fn sector(gx: f32, gy: f32) -> u32 {
    const TAN_11: f32 = 0.198_912_37;
    const TAN_33: f32 = 0.668_178_6;
    let (ax, ay) = (gx.abs(), gy.abs());
    let (small, large) = if ax < ay { (ax, ay) } else { (ay, ax) };
    let within = u32::from(small > TAN_11 * large) + u32::from(small > TAN_33 * large);
    let quarter = if ax < ay { 4 - within } else { within };
    match (gx < 0.0, gy < 0.0) {
        (false, false) => quarter,
        (true, false) => 8 - quarter,
        (true, true) => 8 + quarter,
        (false, true) => (16 - quarter) % 16,
    }
}

/// Every cell gets the bits of the window from -STRIDE/2 to STRIDE/2 - 1 around it.
pub fn spread(bits: &[u16], width: usize, height: usize) -> Vec<u16> {
    let half = STRIDE / 2;
    let mut rows = vec![0u16; bits.len()];
    rows.par_chunks_mut(width).zip(bits.par_chunks(width)).for_each(|(out, row)| {
        for (x, o) in out.iter_mut().enumerate() {
            *o = row[x.saturating_sub(half)..(x + half).min(width)].iter().fold(0, |a, b| a | b);
        }
    });
    let mut out = vec![0u16; bits.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, o)| {
        for yy in y.saturating_sub(half)..(y + half).min(height) {
            for (a, b) in o.iter_mut().zip(&rows[yy * width..(yy + 1) * width]) {
                *a |= b;
            }
        }
    });
    out
}

/// How well a set of directions meets direction `want`: 4 the same, 3 and 1 for one and two bins off.
pub fn response(bits: u16, want: usize) -> u8 {
    let near = |k: usize| bits & ((1 << ((want + k) % BINS)) | (1 << ((want + BINS - k) % BINS))) != 0;
    if near(0) {
        4
    } else if near(1) {
        3
    } else if near(2) {
        1
    } else {
        0
    }
}

/// Both polarities of a set of directions.
pub fn both_polarities(bits: u16) -> u16 {
    bits | bits.rotate_left(8)
}

/// Responses of one layer, laid out so that the cells of one phase (x mod STRIDE, y mod STRIDE) lie
/// side by side: the sum over a model's features is then a sum of contiguous rows.
struct Memory {
    kind: Kind,
    /// [direction][phase y][phase x][row][column]
    cells: Vec<u8>,
}

/// The prepared level.
pub struct Coarse {
    memories: Vec<Memory>,
    /// Columns and rows of the strided grid, margin included.
    columns: usize,
    rows: usize,
    margin: usize,
}

/// A coarse hit: pixels of the level, index of the pose, and the share of the full score.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub x: f64,
    pub y: f64,
    pub pose: usize,
    pub score: f32,
}

/// A turn (rad) and scale to be tried.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    pub angle: f64,
    pub scale: f64,
}

impl Coarse {
    /// Prepares the layers of a level; `margin` px around the picture count as empty, so that parts that
    /// reach beyond the border are found.
    pub fn new(layers: &[(Kind, &Field, f32)], ignore_polarity: bool, margin: usize) -> Coarse {
        let margin = margin.div_ceil(STRIDE) * STRIDE;
        let (w, h) = (layers[0].1.width, layers[0].1.height);
        let (columns, rows) = ((w + 2 * margin).div_ceil(STRIDE), (h + 2 * margin).div_ceil(STRIDE));
        let memories = layers
            .iter()
            .map(|(kind, field, threshold)| {
                let bits = spread(&quantise(field, *threshold), w, h);
                let plane = columns * rows;
                let mut cells = vec![0u8; BINS * STRIDE * STRIDE * plane];
                cells.par_chunks_mut(STRIDE * STRIDE * plane).enumerate().for_each(|(want, of_direction)| {
                    let mut table = vec![0u8; 1 << 16];
                    for (b, t) in table.iter_mut().enumerate() {
                        let b = b as u16;
                        *t = response(if ignore_polarity { both_polarities(b) } else { b }, want);
                    }
                    for y in 0..h {
                        let yy = y + margin;
                        for x in 0..w {
                            let xx = x + margin;
                            let phase = (yy % STRIDE) * STRIDE + xx % STRIDE;
                            of_direction[phase * plane + (yy / STRIDE) * columns + xx / STRIDE] =
                                table[bits[y * w + x] as usize];
                        }
                    }
                });
                Memory { kind: *kind, cells }
            })
            .collect();
        Coarse { memories, columns, rows, margin }
    }

    /// The share of the full score of every strided place for one pose of the features.
    fn scores(&self, features: &[ModelPoint], turn: Turn, px: f64, sums: &mut Vec<u8>) -> usize {
        let plane = self.columns * self.rows;
        sums.clear();
        sums.resize(plane, 0);
        let (s, c) = turn.angle.sin_cos();
        let mut used = 0;
        for f in features {
            let Some(memory) = self.memories.iter().find(|m| m.kind == f.kind) else { continue };
            let (fx, fy) = (f.x * turn.scale / px, f.y * turn.scale / px);
            let dx = (c * fx - s * fy).round() as i64 + STRIDE as i64 / 2;
            let dy = (s * fx + c * fy).round() as i64 + STRIDE as i64 / 2;
            let want = bin(c * f.gx - s * f.gy, s * f.gx + c * f.gy);
            used += 1;
            let t = STRIDE as i64;
            let phase = (dy.rem_euclid(t) * t + dx.rem_euclid(t)) as usize;
            let source = &memory.cells[(want * STRIDE * STRIDE + phase) * plane..][..plane];
            let (cx, cy) = (dx.div_euclid(t), dy.div_euclid(t));
            let (x0, x1) = (0.max(-cx) as usize, (self.columns as i64).min(self.columns as i64 - cx).max(0) as usize);
            let (y0, y1) = (0.max(-cy) as usize, (self.rows as i64).min(self.rows as i64 - cy).max(0) as usize);
            if x0 >= x1 {
                continue;
            }
            for y in y0..y1 {
                let from = ((y as i64 + cy) as usize * self.columns) as i64 + x0 as i64 + cx;
                let from = &source[from as usize..from as usize + (x1 - x0)];
                for (a, b) in sums[y * self.columns + x0..y * self.columns + x1].iter_mut().zip(from) {
                    *a += b;
                }
            }
        }
        used
    }

    /// Hits above `limit` (share of the full score), best first: at most `most`, none within one cell and
    /// `apart` rad of a better one.
    pub fn search(
        &self,
        level: &[ModelPoint],
        turns: &[Turn],
        px: f64,
        limit: f32,
        most: usize,
        apart: f64,
    ) -> Vec<Hit> {
        let features = thin(level, 1.5 * px, MAX_FEATURES);
        let mut hits: Vec<Hit> = turns
            .par_iter()
            .enumerate()
            .map_init(Vec::new, |sums, (pose, turn)| {
                let used = self.scores(&features, *turn, px, sums);
                let full = (used * FULL as usize).max(1) as f32;
                let least = (limit * full).ceil() as u8;
                let mut found = Vec::new();
                for y in 0..self.rows {
                    for x in 0..self.columns {
                        let v = sums[y * self.columns + x];
                        if v >= least.max(1) && self.is_peak(sums, x, y) {
                            let place = |k: usize| (k * STRIDE + STRIDE / 2) as f64 - self.margin as f64 - 0.5;
                            found.push(Hit { x: place(x), y: place(y), pose, score: f32::from(v) / full });
                        }
                    }
                }
                found
            })
            .flatten_iter()
            .collect();
        hits.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.pose.cmp(&b.pose)));
        let mut kept: Vec<Hit> = Vec::new();
        for h in hits {
            let reach = STRIDE as f64 + 0.5;
            let taken = kept.iter().any(|k| {
                (k.x - h.x).abs() < reach
                    && (k.y - h.y).abs() < reach
                    && turn_between(turns[k.pose].angle, turns[h.pose].angle) < apart
                    && (turns[k.pose].scale / turns[h.pose].scale).ln().abs() < 0.05
            });
            if !taken {
                kept.push(h);
                if kept.len() == most {
                    break;
                }
            }
        }
        kept
    }

    fn is_peak(&self, sums: &[u8], x: usize, y: usize) -> bool {
        let v = sums[y * self.columns + x];
        for yy in y.saturating_sub(1)..(y + 2).min(self.rows) {
            for xx in x.saturating_sub(1)..(x + 2).min(self.columns) {
                if sums[yy * self.columns + xx] > v {
                    return false;
                }
            }
        }
        true
    }
}

/// Smallest angle between two directions, rad.
pub fn turn_between(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(std::f64::consts::TAU);
    d.min(std::f64::consts::TAU - d)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_are_the_nearest_bins() {
        for k in 0..3600 {
            let a = (f64::from(k) + 0.5) * std::f64::consts::TAU / 3600.0;
            let (x, y) = (a.cos(), a.sin());
            let border = (a / std::f64::consts::TAU * 16.0).fract() - 0.5;
            if border.abs() > 1e-5 {
                assert_eq!(sector(x as f32, y as f32) as usize, bin(x, y), "at {a}");
            }
        }
    }

    #[test]
    fn responses_fall_with_the_angle_and_forget_polarity_on_request() {
        assert_eq!([0, 1, 2, 3, 8].map(|k| response(1 << k, 0)), [4, 3, 1, 0, 0]);
        assert_eq!(response(1 << 15, 0), 3);
        assert_eq!(response(both_polarities(1 << 8), 0), 4);
        assert_eq!(response(0, 5), 0);
    }

    #[test]
    fn spreading_reaches_two_back_and_one_ahead() {
        let mut bits = vec![0u16; 81];
        bits[4 * 9 + 4] = 2;
        let s = spread(&bits, 9, 9);
        for y in 0..9 {
            for x in 0..9 {
                let near = (3..=6).contains(&x) && (3..=6).contains(&y);
                assert_eq!(s[y * 9 + x] == 2, near, "{x} {y}");
            }
        }
    }
}
