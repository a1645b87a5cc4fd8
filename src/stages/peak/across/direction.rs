//! In: a picture, a skeleton pixel. Out: the unit vector across the stripe there.
//! Frame and unit: pixels. docs/math.md, Stripe peak (1).

use super::turn::{DIAGONAL, EVEN_ROW, MIDDLE_ROW, deep};
use crate::stages::peak::PeakFrame;
use crate::stages::peak::grey::Grey;

/// Most directions computed in turn beside a border, each at the place that the one before gave.
pub(in crate::stages) const BORDER_STEPS: u32 = 2;
/// Share of a stripe's direction that points out of the picture. From this share on the stripe counts as leaving the
/// picture; below it, as running along the border.
pub(in crate::stages) const LEAVES: f32 = 0.3;

/// Weight of the rig's direction against that of the gradients. It is multiplied by (l / l0)² - 1, where l / l0 is how
/// much worse the gradients agree than on a straight stripe. Two surfaces, an end or print in the window make that 2 to
/// 20, and turn the direction by 5 to 50 degrees if they cut the stripe aslant.
pub(in crate::stages) const DISUNITED: f32 = 0.04;

/// Direction across the stripe. Beside the picture's border the differences reach beyond it, where all levels repeat
/// those on the border, and a slanted stripe would seem less slanted. There the direction is that of the stripe's next
/// piece whose differences lie in the picture.
#[inline(always)]
pub(in crate::stages::peak) fn direction<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> (f32, f32) {
    let mut n = direction_at(image, x, y, s);
    for _ in 0..BORDER_STEPS {
        let (inner_x, inner_y) = inward(x, y, n, s);
        if (inner_x, inner_y) == (x, y) {
            break;
        }
        n = direction_at(image, inner_x, inner_y, s);
    }
    n
}

/// The next place along the stripe whose differences lie in the picture. It is the place itself if its differences do,
/// or if the stripe runs along the border and there is no such place.
#[inline(always)]
fn inward(x: i32, y: i32, n: (f32, f32), s: &PeakFrame) -> (i32, i32) {
    let reach = 3 * s.lattice_u.max(s.lattice_v);
    let du = x.min(s.width - 1 - reach).max(reach) - x;
    let dv = y.min(s.height - 1 - reach).max(reach) - y;
    let (tu, tv) = (n.1, -n.0);
    let by_u = if tu.abs() >= LEAVES { du as f32 / tu } else { 0.0 };
    let by_v = if tv.abs() >= LEAVES { dv as f32 / tv } else { 0.0 };
    let along = if by_u.abs() >= by_v.abs() { by_u } else { by_v };
    // Not 0.5, so that rounding errors do not decide.
    (x + (along * tu + 0.47).floor() as i32, y + (along * tv + 0.47).floor() as i32)
}

/// The strongest eigenvector of the structure tensor. Its grey levels are so far apart that noise of single pixels does
/// not turn it. The error that such long differences make in the direction is corrected (docs/math.md, Stripe peak
/// (1)).
#[inline(always)]
fn direction_at<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> (f32, f32) {
    let deep = deep(s.full_scale);
    let (mut h, mut xy, mut q, mut p) = tensor(image, x, y, s.lattice_u, s.lattice_v, deep);
    // Sine and cosine of twice the angle of a tensor's direction; sum of c sin(k a), k = 2, 4, 6, 8.
    let twice = |h: f32, xy: f32, q: f32| (xy / q.max(1e-12), -h / q.max(1e-12));
    let turn_of = |(s2, c2): (f32, f32), c: [f32; 4]| {
        let (s4, c4) = (2.0 * s2 * c2, c2 * c2 - s2 * s2);
        c[0] * s2 + (c[1] * s4 + (c[2] * (s4 * c2 + c4 * s2) + c[3] * (2.0 * (s4 * c4))))
    };
    let seen = twice(h, xy, q);
    let mut turn = turn_of(seen, [s.turn_2, s.turn_4, s.turn_6, s.turn_8]);
    // On a steep stripe the longer differences would span its whole width.
    if (if s.lattice_u > s.lattice_v { seen.1 } else { -seen.1 }) < s.flat {
        let side = s.lattice_u.min(s.lattice_v);
        (h, xy, q, p) = tensor(image, x, y, side, side, deep);
        turn = turn_of(twice(h, xy, q), [0.0, s.square_4, 0.0, s.square_8]);
    }
    let (nx, ny) = if h > 0.0 { (h + q, xy) } else { (xy, q - h) };
    if (nx * nx + ny * ny).sqrt() < 1e-9 {
        return (0.0, 1.0);
    }
    let (nx, ny) = (nx + turn * ny, ny - turn * nx);
    // The direction at twice its angle: that of the gradients plus that of the rig, which has more weight the less the
    // gradients agree.
    let (one, other) = (2.0 * q / (p + q), (p - q) / (s.ragged * (p + q) + s.restless));
    let length2 = nx * nx + ny * ny;
    let (s2, c2) = (2.0 * nx * ny / length2, (ny * ny - nx * nx) / length2);
    let (across_u, across_v) = (s.across_u, s.across_v);
    let (rig_s2, rig_c2) = (2.0 * across_u * across_v, across_v * across_v - across_u * across_u);
    // The rig's weight falls if the stripe is more than 45 degrees off the rig's direction, to 0 at 90: no edge causes
    // that.
    let near = (1.0 + (s2 * rig_s2 + c2 * rig_c2)).min(1.0);
    let rig = DISUNITED * (other * other - 1.0).max(0.0) * near;
    let (sine, cosine) = (one * s2 + rig * rig_s2, one * c2 + rig * rig_c2);
    let both = (sine * sine + cosine * cosine).sqrt();
    let (nx, ny) = if cosine > 0.0 { (sine, cosine + both) } else { (both - cosine, sine) };
    let l = (nx * nx + ny * ny).sqrt();
    let sign = if ny < 0.0 { -1.0 } else { 1.0 };
    (sign * nx / l, sign * ny / l)
}

/// Every other place of a lattice's row, from which the gradients are computed.
#[inline(always)]
fn odd<G: Grey>(image: G, x: i32, y: i32, u: i32) -> [i32; 3] {
    [image.whole(x - 2 * u, y), image.whole(x, y), image.whole(x + 2 * u, y)]
}

/// The places between those of [`odd`].
#[inline(always)]
fn even<G: Grey>(image: G, x: i32, y: i32, u: i32) -> [i32; 4] {
    [image.whole(x - 3 * u, y), image.whole(x - u, y), image.whole(x + u, y), image.whole(x + 3 * u, y)]
}

/// Half the difference of the diagonal, the other element, half the difference of the eigenvalues and half their sum.
/// They are sums of whole numbers, with ten bits a gradient. The direction decides which pixels form a profile, and
/// must not depend on rounding.
#[inline(always)]
fn tensor<G: Grey>(image: G, x: i32, y: i32, u: i32, v: i32, deep: u32) -> (f32, f32, f32, f32) {
    let half = 1 << deep >> 1;
    let (a, b, c) = (odd(image, x, y - 3 * v, u), even(image, x, y - 2 * v, u), odd(image, x, y - v, u));
    let (d, e) = (even(image, x, y, u), odd(image, x, y + v, u));
    let (f, g) = (even(image, x, y + 2 * v, u), odd(image, x, y + 3 * v, u));
    let mut sums = [0i32; 3];
    for (above, row, below, weights) in [(a, b, c, EVEN_ROW), (c, d, e, MIDDLE_ROW), (e, f, g, EVEN_ROW)] {
        for i in 0..3 {
            let (gx, gy) = ((row[i + 1] - row[i] + half) >> deep, (below[i] - above[i] + half) >> deep);
            add(&mut sums, weights[i], gx, gy);
        }
    }
    for (above, row, below) in [(b, c, d), (d, e, f)] {
        for i in 0..2 {
            let (gx, gy) = ((row[i + 1] - row[i] + half) >> deep, (below[i + 1] - above[i + 1] + half) >> deep);
            add(&mut sums, DIAGONAL, gx, gy);
        }
    }
    let ratio = v as f32 / u as f32;
    let (xx, xy, yy) = ((ratio * ratio) * sums[0] as f32, ratio * sums[1] as f32, sums[2] as f32);
    let d = 0.5 * (xx - yy);
    (d, xy, (d * d + xy * xy).sqrt(), 0.5 * (xx + yy))
}

#[inline(always)]
fn add(sums: &mut [i32; 3], weight: i32, gx: i32, gy: i32) {
    sums[0] += weight * (gx * gx);
    sums[1] += weight * (gx * gy);
    sums[2] += weight * (gy * gy);
}
