//! In: a mask. Out: the mask thinned to lines one pixel wide, from which nothing more can be deleted. Frame and unit:
//! pixels. Zhang and Suen 1984 \[zhang84\], Guo and Hall 1989 \[guo89\], with OpenCV's details.

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

/// One sub-iteration of thinning; a round binds different headers and exchanges the masks.
pub const STEP: Step = Step {
    stage: &STAGE,
    twin: stage_twin,
    binds: &["frame", "lit header", "lit list", "mask", "other mask", "stamps"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

/// Override constant that selects the rule when the pipeline is built, [`Thinning::number`].
pub const RULE: &str = "rule";

/// The rule by which boundary pixels are deleted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Thinning {
    /// Shortens stripes two pixels wide that run at 45 degrees from their ends, until two pixels remain.
    #[default]
    ZhangSuen,
    /// Preserves those. On speckled stripes along the image's axes it leaves more pixels beside the middle.
    GuoHall,
}

/// Sine of twice the angle to the image's axes from which a stripe counts as slanted: 22.5 degrees.
const SLANTED: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Whether a stripe is slanted; the argument is the direction across it (a unit vector of the image).
pub(in crate::stages) fn slanted(Vec2 { x, y }: Vec2) -> bool {
    2.0 * (x * y).abs() > SLANTED
}

impl Thinning {
    /// The rule for a stripe with this direction across it (a unit vector of the image).
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
            // A(p) = 1: exactly one step from dark to lit around the pixel.
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

/// Bits of word `i` that may be deleted. As in OpenCV, the outermost rows and columns stay.
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

/// CPU twin: sub-iterations until two in a row delete nothing. A row is skipped if its neighbourhood did not change in
/// the last two. That cannot change the result, because the same rule was already applied to the same pixels.
pub fn twin(mask: &Mask, rule: Thinning) -> Mask {
    let (h, words) = (mask.height as usize, mask.words_per_row());
    let (mut now, mut next) = (mask.clone(), mask.clone());
    if h < 3 || mask.width < 3 {
        return now;
    }
    // 3 plus the sub-iteration in which a row last changed; 2 before that, so that the first two sub-iterations examine
    // every row.
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
    // A row of the mask as words. Only rows of the picture are requested, because y + 1 < height.
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
