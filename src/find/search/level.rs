//! In: slope fields of one pyramid level; the positions of a turned model's features. Out: the level in the form that
//! the stages use, and the peaks of the features' sums on the CPU (quantised and spread as in \[hinterstoisser12\]).
//! Frame and unit: cells of the level; scores are integers, 0 to 4 a feature.

use crate::find::model::gradient::Field;
use crate::find::scene::Kind;
use crate::stages::shape::frame::{BINS, STRIDE, ShapeFrame};
use crate::stages::shape::maps::{both_polarities, direction, pack, response};
use crate::stages::shape::sums::{Peak, peaks};
use rayon::prelude::*;

/// Gives every cell the bits of the window from -STRIDE/2 to STRIDE/2 - 1 around it.
fn spread(bits: &[u16], width: usize, height: usize) -> Vec<u16> {
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

/// A level and its layers in the form that the stages use.
pub struct Level {
    pub(in crate::find) frame: ShapeFrame,
    pub(in crate::find) kinds: Vec<Kind>,
    /// Packed slopes of each layer.
    pub(in crate::find) slopes: Vec<Vec<u32>>,
}

/// Where a feature is read: the layer, the expected direction, and its offset from the model's place in cells.
#[derive(Clone, Copy, Debug)]
pub(in crate::find) struct Placed {
    pub layer: usize,
    pub want: usize,
    pub dx: i64,
    pub dy: i64,
}

impl Level {
    /// Prepares the layers of a level; `margin` px around the picture count as empty, so that parts that extend beyond
    /// the border are found.
    pub fn new(layers: &[(Kind, &Field, f32)], ignore_polarity: bool, margin: usize) -> Level {
        let mut frame = ShapeFrame::new(layers[0].1.width, layers[0].1.height, margin);
        frame.ignore = u32::from(ignore_polarity);
        let packed = |field: &Field, threshold: f32| {
            field.gx.par_iter().zip(&field.gy).map(|(&gx, &gy)| pack(gx, gy, threshold)).collect()
        };
        Level {
            frame,
            kinds: layers.iter().map(|l| l.0).collect(),
            slopes: layers.iter().map(|(_, field, threshold)| packed(field, *threshold)).collect(),
        }
    }

    /// An artificial level of `side` cells with which the accelerator is timed.
    pub(in crate::find) fn trial(side: usize) -> Level {
        let slopes = (0..side * side).map(|i| pack((i % 7) as f32 - 3.0, (i / side % 5) as f32 - 2.0, 2.0)).collect();
        Level { frame: ShapeFrame::new(side, side, 0), kinds: vec![Kind::Height], slopes: vec![slopes] }
    }

    /// The given number of features at the given number of turns, within the trial level's middle.
    pub(in crate::find) fn trial_turns(turns: usize, features: usize) -> Vec<Vec<Placed>> {
        let feature = |t: usize, f: usize| {
            let (s, c) = (0.3 * f as f64 + 0.01 * t as f64).sin_cos();
            Placed { layer: 0, want: (t + f) % BINS, dx: (40.0 * c) as i64, dy: (40.0 * s) as i64 }
        };
        (0..turns).map(|t| (0..features).map(|f| feature(t, f)).collect()).collect()
    }

    /// The peaks of all turns on the CPU, in the order of turn, row, column.
    pub(in crate::find) fn peaks(&self, placed: &[Vec<Placed>], least: u8) -> Vec<Peak> {
        let (columns, rows) = (self.frame.columns as usize, self.frame.rows as usize);
        let memories: Vec<Vec<u8>> = self.slopes.iter().map(|s| self.memory(s)).collect();
        placed
            .par_iter()
            .enumerate()
            .map_init(Vec::new, |sums, (turn, features)| {
                self.scores(&memories, features, sums);
                peaks(sums, columns, columns, rows, least, turn as u32)
            })
            .flatten_iter()
            .collect()
    }

    /// Responses of a layer, laid out so that the cells of one phase (x mod STRIDE, y mod STRIDE) lie side by side: the
    /// sum over a model's features is then a sum of contiguous rows. [direction][phase y][phase x][row][column]
    fn memory(&self, slopes: &[u32]) -> Vec<u8> {
        let frame = &self.frame;
        let (w, h, margin) = (frame.width as usize, frame.height as usize, frame.margin as usize);
        let (columns, plane) = (frame.columns as usize, (frame.columns * frame.rows) as usize);
        let bits: Vec<u16> = slopes.par_iter().map(|&s| direction(s)).collect();
        let bits = spread(&bits, w, h);
        // The phases of the direction sets come first: each direction's responses are then computed in one pass.
        let mut phases = vec![0u16; STRIDE * STRIDE * plane];
        phases.par_chunks_mut(plane).enumerate().for_each(|(phase, of_phase)| {
            // The first row and column of the picture in this phase, and where it lies in the plane.
            let first = |phase: usize| (phase + STRIDE - margin % STRIDE) % STRIDE;
            let (py, px) = (phase / STRIDE, phase % STRIDE);
            for y in (first(py)..h).step_by(STRIDE) {
                let from = bits[y * w..(y + 1) * w].iter().skip(first(px)).step_by(STRIDE);
                let start = (y + margin) / STRIDE * columns + (first(px) + margin) / STRIDE;
                for (out, &b) in of_phase[start..].iter_mut().zip(from) {
                    *out = if frame.ignore != 0 { both_polarities(b) } else { b };
                }
            }
        });
        let mut cells = vec![0u8; BINS * STRIDE * STRIDE * plane];
        cells.par_chunks_mut(STRIDE * STRIDE * plane).enumerate().for_each(|(want, of_direction)| {
            for (out, &b) in of_direction.iter_mut().zip(&phases) {
                *out = response(b, want);
            }
        });
        cells
    }

    /// The sums at all strided places for one turn.
    fn scores(&self, memories: &[Vec<u8>], features: &[Placed], sums: &mut Vec<u8>) {
        let (columns, rows) = (self.frame.columns as i64, self.frame.rows as i64);
        let plane = (columns * rows) as usize;
        sums.clear();
        sums.resize(plane, 0);
        for f in features {
            let t = STRIDE as i64;
            let phase = (f.dy.rem_euclid(t) * t + f.dx.rem_euclid(t)) as usize;
            let source = &memories[f.layer][(f.want * STRIDE * STRIDE + phase) * plane..][..plane];
            let (cx, cy) = (f.dx.div_euclid(t), f.dy.div_euclid(t));
            let (x0, x1) = (0.max(-cx), columns.min(columns - cx));
            for y in 0.max(-cy)..rows.min(rows - cy) {
                if x0 >= x1 {
                    break;
                }
                let from = ((y + cy) * columns + x0 + cx) as usize;
                let from = &source[from..from + (x1 - x0) as usize];
                let to = (y * columns + x0) as usize;
                for (a, b) in sums[to..to + from.len()].iter_mut().zip(from) {
                    *a += b;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
