//! In: responses of a level and the features of a model at many turns. Out: sums at every strided place and their
//! peaks, as WGSL stages with their CPU twins (docs/math.md, Shape matching, coarse search). Frame and unit: strided
//! places; a perfect feature scores 4.

use super::frame::{SHARED, ShapeFrame, UNIFORM};
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::listing;

/// Sums of all features at every strided place and turn; one invocation for four places of one turn.
pub const SCORE: Stage = Stage {
    name: "shape_score",
    wgsl: include_str!("../../../shaders/shape_score.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "responses", access: Texels },
        Binding { name: "features", access: Read },
        Binding { name: "sums", access: ReadWrite },
    ],
    uniform: UNIFORM,
    overrides: &[],
};

/// The places with a sum of at least the least sum that no neighbour exceeds; one invocation for four places of one
/// turn.
pub const PEAKS: Stage = Stage {
    name: "shape_peaks",
    wgsl: include_str!("../../../shaders/shape_peaks.wgsl"),
    shared: &[SHARED, listing::SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "sums", access: Texels },
        Binding { name: "header", access: ReadWrite },
        Binding { name: "hits", access: ReadWrite },
    ],
    uniform: UNIFORM,
    overrides: &[],
};

/// A peak of the sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Peak {
    /// Number of the turn within the run.
    pub turn: u32,
    /// Strided place from the top, including the border.
    pub row: u32,
    /// Strided place from the left, including the border.
    pub column: u32,
    /// Sum over the features, each 0..=4.
    pub sum: u32,
}

impl Peak {
    /// A peak from the two words of the list: turn | sum << 24, column | row << 16.
    pub fn unpack([a, b]: [u32; 2]) -> Peak {
        Peak { turn: a & 0xff_ffff, sum: a >> 24, column: b & 0xffff, row: b >> 16 }
    }
    fn pack(&self) -> [u32; 2] {
        [self.turn | self.sum << 24, self.column | self.row << 16]
    }
}

/// The peaks of one turn's sums, with `stride` bytes in a row, of which `columns` are used.
pub fn peaks(sums: &[u8], stride: usize, columns: usize, rows: usize, least: u8, turn: u32) -> Vec<Peak> {
    let mut found = Vec::new();
    for y in 0..rows {
        for (x, &v) in sums[y * stride..y * stride + columns].iter().enumerate() {
            if v < least {
                continue;
            }
            let higher = (y.saturating_sub(1)..(y + 2).min(rows)).any(|yy| {
                let row = &sums[yy * stride..yy * stride + columns];
                row[x.saturating_sub(1)..(x + 2).min(columns)].iter().any(|&n| n > v)
            });
            if !higher {
                found.push(Peak { turn, row: y as u32, column: x as u32, sum: u32::from(v) });
            }
        }
    }
    found
}

pub(crate) fn score_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let frame = ShapeFrame::read(&b[0]);
    let [_, responses, features, sums] = b else { unreachable!() };
    let responses: &[u8] = bytemuck::cast_slice(responses);
    let sums: &mut [u8] = bytemuck::cast_slice_mut(sums);
    let (stride, rows) = (4 * i64::from(frame.words), i64::from(frame.rows));
    let plane = (stride * rows) as usize;
    for (turn, list) in features.chunks_exact(4 * frame.features as usize).take(frame.turns as usize).enumerate() {
        for f in list.chunks_exact(4).map(|f| [0, 1, 2].map(|k| i64::from(f[k] as i32))) {
            for y in 0.max(-f[2])..rows.min(rows - f[2]) {
                for x in 0.max(-f[1])..stride.min(stride - f[1]) {
                    let from = 4 * f[0] + (y + f[2]) * stride + x + f[1];
                    sums[turn * plane + (y * stride + x) as usize] += responses[from as usize];
                }
            }
        }
    }
}

pub(crate) fn peaks_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let frame = ShapeFrame::read(&b[0]);
    let [_, sums, header, hits] = b else { unreachable!() };
    let sums: &[u8] = bytemuck::cast_slice(sums);
    let least = frame.least.min(255) as u8;
    for (turn, sums) in sums.chunks_exact(4 * frame.plane()).take(frame.turns as usize).enumerate() {
        let (stride, columns, rows) = (4 * frame.words as usize, frame.columns as usize, frame.rows as usize);
        for peak in peaks(sums, stride, columns, rows, least, turn as u32) {
            if header[listing::COUNT] < frame.capacity {
                hits[2 * header[listing::COUNT] as usize..][..2].copy_from_slice(&peak.pack());
            }
            header[listing::COUNT] += 1;
        }
    }
}

/// Number of words that differ; the order of the hits does not count.
pub fn differing_hits(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64 {
    let sorted = |b: &[Vec<u32>]| {
        let mut b = b.to_vec();
        let list: &mut [[u32; 2]] = bytemuck::cast_slice_mut(b.last_mut().expect("bindings"));
        list.sort_unstable();
        b
    };
    crate::stages::differing_words(&sorted(gpu), &sorted(twin))
}
