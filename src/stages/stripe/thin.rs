//! In: a mask. Out: the mask thinned to lines one pixel wide, nothing left to delete.
//! Frame and unit: pixels. Zhang and Suen 1984 \[zhang84\], Guo and Hall 1989 \[guo89\], as OpenCV has them.

use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::raster::Mask;
use crate::stages::frame;
use crate::stages::frame::{PX_LOG2, SHARED, frame_of, tile_unpack};
use crate::stages::listing::{self, mask_index, tile_index};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};
use glam::Vec2;

/// One sub-iteration over the listed tiles.
pub const STAGE: Stage = Stage {
    name: "thin",
    wgsl: include_str!("../../../shaders/thin.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "before", access: Texels },
        Binding { name: "after", access: ReadWrite },
        Binding { name: "stamps", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2, RULE],
};

/// One sub-iteration of thinning; a round binds other headers and turns the masks around.
pub const STEP: Step = Step {
    stage: &STAGE,
    twin: stage_twin,
    binds: &["frame", "lit header", "lit list", "mask", "other mask", "stamps"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

/// Selects the rule when the pipeline is built, [`Thinning::number`].
pub const RULE: &str = "rule";

/// The rule that decides which boundary pixels go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Thinning {
    /// Eats stripes two pixels wide that run at 45 degrees from their ends on, until two pixels are left.
    #[default]
    ZhangSuen,
    /// Keeps those; of speckled stripes along the image's axes it keeps more pixels beside the middle.
    GuoHall,
}

/// Sine of twice the angle, off the image's axes, from which a stripe counts as slanted: 22.5 degrees.
const SLANTED: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Whether a stripe that is crossed in this direction (a unit vector of the image) lies aslant.
pub(in crate::stages) fn slanted(Vec2 { x, y }: Vec2) -> bool {
    2.0 * (x * y).abs() > SLANTED
}

impl Thinning {
    /// The rule for a stripe that is crossed in this direction (a unit vector of the image).
    pub fn across(across: Vec2) -> Thinning {
        if slanted(across) { Thinning::GuoHall } else { Thinning::ZhangSuen }
    }
}

impl Thinning {
    /// The value of the override [`RULE`].
    pub fn number(self) -> u32 {
        match self {
            Thinning::ZhangSuen => 0,
            Thinning::GuoHall => 1,
        }
    }
    /// The rule that a pipeline was built with.
    fn of(overrides: &[(&'static str, f64)]) -> Thinning {
        let number = |rule: Thinning| f64::from(rule.number());
        let given = overrides.iter().find(|o| o.0 == RULE).map(|o| o.1);
        if given == Some(number(Thinning::GuoHall)) { Thinning::GuoHall } else { Thinning::ZhangSuen }
    }
}

/// The eight neighbours of 32 pixels, clockwise from north: p2 to p9 of the papers.
pub type Neighbours = [u32; 8];

/// Pixels to delete in one sub-iteration, 32 at a time; `second` is its parity.
#[inline]
pub fn deletions(rule: Thinning, p: &Neighbours, second: bool) -> u32 {
    let [p2, p3, p4, p5, p6, p7, p8, p9] = *p;
    match rule {
        Thinning::ZhangSuen => {
            // A(p) = 1: exactly one step from dark to lit on the way round.
            let (mut one, mut more) = (0, 0);
            for i in 0..8 {
                let step = !p[i] & p[(i + 1) % 8];
                more |= one & step;
                one |= step;
            }
            // 2 <= B(p) <= 6, counted with a chain of bit adders.
            let (mut b0, mut b1, mut b2) = (0, 0, 0);
            for &n in p {
                let c0 = b0 & n;
                b0 ^= n;
                let c1 = b1 & c0;
                b1 ^= c0;
                b2 ^= c1; // 8 lit neighbours wrap to 0, which is refused as well
            }
            let at_least_two = b1 | b2;
            let seven = b0 & b1 & b2;
            let stays = if second { (p2 & p4 & p8) | (p2 & p6 & p8) } else { (p2 & p4 & p6) | (p4 & p6 & p8) };
            one & !more & at_least_two & !seven & !stays
        }
        Thinning::GuoHall => {
            let c = [!p2 & (p3 | p4), !p4 & (p5 | p6), !p6 & (p7 | p8), !p8 & (p9 | p2)];
            let (mut one, mut more) = (0, 0);
            for c in c {
                more |= one & c;
                one |= c;
            }
            let n1 = [p9 | p2, p3 | p4, p5 | p6, p7 | p8];
            let n2 = [p2 | p3, p4 | p5, p6 | p7, p8 | p9];
            // min(N1, N2) is 2 or 3: both at least 2, and not both 4.
            let all = |n: [u32; 4]| n[0] & n[1] & n[2] & n[3];
            let two = |n: [u32; 4]| (n[0] & n[1]) | (n[2] & n[3]) | ((n[0] | n[1]) & (n[2] | n[3]));
            let stays = if second { (p2 | p3 | !p5) & p4 } else { (p6 | p7 | !p9) & p8 };
            one & !more & two(n1) & two(n2) & !(all(n1) & all(n2)) & !stays
        }
    }
}

/// The neighbours of word `i` of the middle row; rows are (above, own, below).
#[inline]
pub fn neighbours(rows: [&[u32]; 3], i: usize) -> Neighbours {
    let at = |r: usize, i: usize| rows[r].get(i).copied().unwrap_or(0);
    let east = |r: usize| at(r, i) >> 1 | at(r, i + 1) << 31;
    let west = |r: usize| at(r, i) << 1 | at(r, i.wrapping_sub(1)) >> 31;
    [at(0, i), east(0), east(1), east(2), at(2, i), west(2), west(1), west(0)]
}

/// Bits of word `i` that may be deleted: OpenCV never touches the outermost rows and columns.
#[inline]
pub fn interior(width: u32, i: usize) -> u32 {
    let first = 32 * i as u32;
    let mut bits = if i == 0 { !1 } else { !0 };
    // The last deletable pixel is width - 2.
    let keep = (width - 1).saturating_sub(first);
    if keep < 32 {
        bits &= (1u32 << keep) - 1;
    }
    bits
}

/// CPU twin: sub-iterations until two in a row delete nothing. A row whose surroundings did not
/// change in the last two is left alone, which cannot change the result: the same rule was applied
/// to the same pixels before.
pub fn twin(mask: &Mask, rule: Thinning) -> Mask {
    let (h, words) = (mask.height as usize, mask.words_per_row());
    let (mut now, mut next) = (mask.clone(), mask.clone());
    if h < 3 || mask.width < 3 {
        return now;
    }
    // The sub-iteration in which a row last changed, counted from 2 so that 0 means never.
    let mut changed = vec![2usize; h];
    let inside: Vec<u32> = (0..words).map(|i| interior(mask.width, i)).collect();
    for step in 0.. {
        let mut any = false;
        let stamps = changed.clone();
        for y in 1..h - 1 {
            if stamps[y - 1].max(stamps[y]).max(stamps[y + 1]) < step + 1 {
                continue;
            }
            let row = |y: usize| &now.words[y * words..(y + 1) * words];
            let rows = [row(y - 1), row(y), row(y + 1)];
            for i in 0..words {
                let own = rows[1][i];
                let left = if own == 0 {
                    0
                } else {
                    own & !(deletions(rule, &neighbours(rows, i), step % 2 == 1) & inside[i])
                };
                next.words[y * words + i] = left;
                if left != own {
                    changed[y] = step + 3;
                    any = true;
                }
            }
        }
        if !any && !stamps.iter().any(|&s| s == step + 2) {
            return next;
        }
        std::mem::swap(&mut now, &mut next);
    }
    unreachable!("every sub-iteration but the last two deletes a pixel")
}

pub(crate) fn stage_twin(b: &mut [Vec<u32>], overrides: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let rule = Thinning::of(overrides);
    let [_, listing, list, before, after, stamps] = b else { unreachable!() };
    // A row of the mask as words; beyond the last tile there is none, but it is never asked for: y + 1 < height.
    let line =
        |shot: u32, y: u32| -> Vec<u32> { (0..f.tiles_x).map(|i| before[f.mask_word(shot, 32 * i, y)]).collect() };
    for &tile in &list[..listing[listing::COUNT] as usize] {
        let (tx, ty, shot) = tile_unpack(tile);
        for row in 0..8 {
            let y = 8 * ty + row;
            let own = mask_index(&f, tile, row);
            if y == 0 || y + 1 >= f.height {
                after[own] = before[own];
                continue;
            }
            let lines = [line(shot, y - 1), line(shot, y), line(shot, y + 1)];
            let p = neighbours([&lines[0], &lines[1], &lines[2]], tx as usize);
            let gone = before[own] & deletions(rule, &p, f.step % 2 == 1) & interior(f.width, tx as usize);
            after[own] = before[own] & !gone;
            if gone != 0 {
                stamps[tile_index(&f, tile)] = f.step + 3;
            }
        }
    }
}
