//! In: a picture, a skeleton pixel, the expected stripe. Out: the pixel of its middle, where the skeleton runs beside
//! that.
//! Frame and unit: pixels. docs/math.md, Stripe peak (0).

use crate::stages::peak::PeakFrame;
use crate::stages::peak::grey::Grey;

/// Of narrower stripes the skeleton is near enough to the middle, px: at 4 px (rendered LED at 4096x3072) half of the
/// errors are 2 % smaller where it is moved, and beside edges the large ones 3 % larger.
pub(in crate::stages) const BROAD: f32 = 4.5;

/// The middle of a wide stripe on a skeleton pixel's line across. Thinning wears a stripe off from its edges, and
/// speckle makes those ragged: the skeleton of a stripe of 9 px runs 10 px and more beside its middle, where a
/// profile of three widths leaves a flank out and the level beside the stripe is that of its own light. Centre of
/// gravity of three widths on three lines, in whole numbers; what is nearer than half a width stays where it is, and
/// what lies between two stripes is no middle.
#[inline(always)]
pub(in crate::stages::peak) fn centred<G: Grey>(image: G, (x, y): (i32, i32), s: &PeakFrame) -> (i32, i32) {
    if s.s0 < BROAD {
        return (x, y);
    }
    let columns = s.columns > 0;
    let step = ((0.34 * s.s0) as i32).max(1);
    let reach = (3.0 * s.s0) as i32 / step;
    let beside = (1.2 * s.s0) as i32;
    // So many pixels across.
    let light = |d: i32| {
        let at = |t: i32| if columns { image.whole(x + t, y + d) } else { image.whole(x + d, y + t) };
        at(-beside) + at(0) + at(beside)
    };
    let base = light(-reach * step).min(light(reach * step));
    let (mut all, mut moment) = (0, 0);
    for k in -reach..=reach {
        let lit = (light(k * step) - base).max(0);
        all += lit;
        moment += k * lit;
    }
    if all == 0 {
        return (x, y);
    }
    let most = (2.0 * s.s0) as i32;
    let off = (2 * step * moment + all).div_euclid(2 * all).clamp(-most, most);
    // Between two stripes it is darker.
    let crest = |d: i32| light(d - step) + light(d) + light(d + step);
    if (2 * off.abs()) as f32 <= s.s0 || crest(off) <= crest(0) {
        return (x, y);
    }
    if columns { (x, (y + off).clamp(0, s.height - 1)) } else { ((x + off).clamp(0, s.width - 1), y) }
}
