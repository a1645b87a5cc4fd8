//! In: a picture, a skeleton pixel, the expected stripe. Out: the pixel in the stripe's middle, if the skeleton runs
//! beside it. Frame and unit: pixels. docs/math.md, Stripe peak (0).

use crate::stages::peak::PeakFrame;
use crate::stages::peak::grey::Grey;

/// The skeleton of a stripe narrower than this, px, is close enough to the middle. At 4 px (rendered LED at 4096x3072)
/// moving the pixel makes the median error 2 % smaller, and the large errors beside edges 3 % larger.
pub(in crate::stages) const BROAD: f32 = 4.5;

/// The middle of a wide stripe on a skeleton pixel's line across. Thinning removes a stripe from its edges inwards, and
/// speckle makes the edges ragged: the skeleton of a stripe of 9 px runs 10 px and more beside its middle. A profile of
/// three widths there excludes a flank, and takes the stripe's own light for the level beside it. The middle is the
/// centre of gravity of three widths on three lines, in whole numbers. A pixel within half a width of it stays. A
/// centre that lies in the dark between two stripes is not accepted.
#[inline(always)]
pub(in crate::stages::peak) fn centred<G: Grey>(image: G, (x, y): (i32, i32), s: &PeakFrame) -> (i32, i32) {
    if s.s0 < BROAD {
        return (x, y);
    }
    let columns = s.columns > 0;
    let step = ((0.34 * s.s0) as i32).max(1);
    let reach = (3.0 * s.s0) as i32 / step;
    let beside = (1.2 * s.s0) as i32;
    // Light on three lines, `d` pixels across from the skeleton pixel.
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
    // Between two stripes it is darker than on the skeleton pixel.
    let crest = |d: i32| light(d - step) + light(d) + light(d + step);
    if (2 * off.abs()) as f32 <= s.s0 || crest(off) <= crest(0) {
        return (x, y);
    }
    if columns { (x, (y + off).clamp(0, s.height - 1)) } else { ((x + off).clamp(0, s.width - 1), y) }
}
