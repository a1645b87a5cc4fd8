//! In: block statistics. Out: per block what its column of blocks gives to the windows around it: (least sum of
//! their rows over its width, the same over one column of pixels | its largest pixel << 16).
//! Frame and unit: blocks of 16 x 8 pixels, 256ths of full scale.

use super::frame::{self, Frame, PX_LOG2, SHARED, frame_of};
use super::stats::Block;
use crate::gpu::{Access::*, Binding, Stage};

pub const STAGE: Stage = Stage {
    name: "bands",
    wgsl: include_str!("../../shaders/bands.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "stats", access: Read },
        Binding { name: "bands", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

/// One invocation four tiles, one below the other.
pub fn groups(f: &Frame) -> [u32; 3] {
    STAGE.groups([f.tiles_x * f.tiles_y.div_ceil(4) * f.shots, 1, 1])
}

/// How the windows of all pixels of a block lie over blocks of `edge` pixels, along one axis: blocks up to `full` away
/// are covered whole, `rest` pixels more lie in the blocks beyond them up to `reach` away.
#[derive(Clone, Copy, Debug)]
pub struct Cover {
    pub full: i32,
    pub reach: i32,
    pub rest: u32,
}

impl Cover {
    pub fn new(size: u32, edge: i32) -> Cover {
        let r = (size / 2) as i32;
        let full = if r >= edge - 1 { (r - edge + 1) / edge } else { -1 };
        let rest = size as i32 - if full >= 0 { edge * (2 * full + 1) } else { 0 };
        Cover { full, reach: (r + edge - 1) / edge, rest: rest as u32 }
    }
    /// Distances of the blocks that are covered in part.
    pub fn partial(self) -> impl Iterator<Item = i32> {
        (-self.reach..=self.reach).filter(move |d| d.abs() > self.full)
    }
    pub fn whole(self) -> impl Iterator<Item = i32> {
        -self.full..=self.full
    }
}

pub fn twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, stats, bands] = b else { unreachable!() };
    let (blocks_x, blocks_y) = (2 * f.tiles_x as usize, f.tiles_y as i32);
    let cover = Cover::new(f.size, 8);
    for (at, out) in bands.chunks_exact_mut(2).enumerate().take(2 * f.tiles() as usize) {
        let (x, row) = (at % blocks_x, (at / blocks_x) as i32);
        let (shot, y) = (row / blocks_y, row % blocks_y);
        // (sum, column, row, smallest); above and below the picture its border's pixels repeat.
        let block = |dy: i32| {
            let near = (y + dy).clamp(0, blocks_y - 1);
            let at = 2 * ((shot * blocks_y + near) as usize * blocks_x + x);
            let b = Block::unpack(&stats[at..at + 2]);
            let beyond = near != y + dy;
            [if beyond { 8 * b.row } else { b.sum }, if beyond { 8 * b.smallest } else { b.column }, b.row, b.smallest]
        };
        let total = |whole: usize, part: usize| {
            let rest = cover.partial().map(|dy| block(dy)[part]).min().expect("no window ends with a block");
            cover.whole().map(|dy| block(dy)[whole]).sum::<u32>() + cover.rest * rest
        };
        let largest = Block::unpack(&stats[2 * at..2 * at + 2]).largest;
        out.copy_from_slice(&[total(0, 2), total(1, 3) | largest << 16]);
    }
}
