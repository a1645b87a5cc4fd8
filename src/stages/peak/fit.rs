//! In: pictures, skeleton pixels, the expected stripe. Out: direction and background there; peaks by the maximum-likelihood Gaussian across.
//! Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe peak (1) to (5).

use super::PeakFrame;
use super::found::{Peak, SATURATED};
use super::grey::{Grey, Inner, Place};
use super::lanes::LANES;
use super::profile::{Profiles, Seen, by_columns};
use super::scoring;
use super::turn::{DIAGONAL, EVEN_ROW, MIDDLE_ROW};

/// Nearer than so many pixels lies a narrow stripe's own light, more on the side that its centre is nearer to.
pub(in crate::stages) const BESIDE: i32 = 4;
/// Directions that are taken in turn beside a border, each at a place that the one before led to.
pub(in crate::stages) const BORDER_STEPS: u32 = 2;
/// Share of a stripe's direction that leads out of the picture, from which on it leaves there; below, it runs along the border.
pub(in crate::stages) const LEAVES: f32 = 0.3;
/// Variances of a pixel by as many pixels a side: what two sides of one level differ by, squared, is twice that on average, and hardly
/// ever four times as much.
pub(in crate::stages) const BY_NOISE: f32 = 8.0;

/// Direction across the stripe. Beside the picture's border differences reach beyond it, where all levels go on as on the border, and a slanted
/// stripe would seem less so: there the direction is that of the stripe's next piece whose differences lie in the picture.
#[inline(always)]
pub(super) fn direction<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> (f32, f32) {
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

/// The next place along the stripe whose differences lie in the picture; the place itself where they do, or where the stripe runs along the
/// border and there is none.
#[inline(always)]
fn inward(x: i32, y: i32, n: (f32, f32), s: &PeakFrame) -> (i32, i32) {
    let reach = 3 * s.lattice_u.max(s.lattice_v);
    let du = x.min(s.width - 1 - reach).max(reach) - x;
    let dv = y.min(s.height - 1 - reach).max(reach) - y;
    let (tu, tv) = (n.1, -n.0);
    let by_u = if tu.abs() >= LEAVES { du as f32 / tu } else { 0.0 };
    let by_v = if tv.abs() >= LEAVES { dv as f32 / tv } else { 0.0 };
    let along = if by_u.abs() >= by_v.abs() { by_u } else { by_v };
    // Not 0.5: rounding would decide.
    (x + (along * tu + 0.47).floor() as i32, y + (along * tv + 0.47).floor() as i32)
}

/// The strongest eigenvector of the structure tensor, on grey levels so far apart that noise
/// of single pixels does not turn it, and what so far differences make of it is put right (docs/math.md, Stripe peak (1)).
#[inline(always)]
fn direction_at<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> (f32, f32) {
    let deep = (s.full_scale as u32).count_ones().max(10) - 10;
    let (mut h, mut xy, mut q) = tensor(image, x, y, s.lattice_u, s.lattice_v, deep);
    // Sine and cosine of twice the angle that a tensor shows; sum of c sin(k a), k = 2, 4, 6, 8.
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
        (h, xy, q) = tensor(image, x, y, side, side, deep);
        turn = turn_of(twice(h, xy, q), [0.0, s.square_4, 0.0, s.square_8]);
    }
    let (nx, ny) = if h > 0.0 { (h + q, xy) } else { (xy, q - h) };
    if (nx * nx + ny * ny).sqrt() < 1e-9 {
        return (0.0, 1.0);
    }
    let (nx, ny) = (nx + turn * ny, ny - turn * nx);
    let l = (nx * nx + ny * ny).sqrt();
    let sign = if ny < 0.0 { -1.0 } else { 1.0 };
    (sign * nx / l, sign * ny / l)
}

/// Every other place of a lattice's row, as the gradients want them.
#[inline(always)]
fn odd<G: Grey>(image: G, x: i32, y: i32, u: i32) -> [i32; 3] {
    [image.whole(x - 2 * u, y), image.whole(x, y), image.whole(x + 2 * u, y)]
}

/// The places between.
#[inline(always)]
fn even<G: Grey>(image: G, x: i32, y: i32, u: i32) -> [i32; 4] {
    [image.whole(x - 3 * u, y), image.whole(x - u, y), image.whole(x + u, y), image.whole(x + 3 * u, y)]
}

/// Half the difference of the diagonal, the other element, and half the difference of the eigenvalues. Sums of whole numbers, of
/// ten bits a gradient: which pixels a profile is made of hangs on the direction, and must not hang on rounding.
#[inline(always)]
fn tensor<G: Grey>(image: G, x: i32, y: i32, u: i32, v: i32, deep: u32) -> (f32, f32, f32) {
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
    (d, xy, (d * d + xy * xy).sqrt())
}

#[inline(always)]
fn add(sums: &mut [i32; 3], weight: i32, gx: i32, gy: i32) {
    sums[0] += weight * (gx * gx);
    sums[1] += weight * (gx * gy);
    sums[2] += weight * (gy * gy);
}

/// Level beside the stripe, 4 to 6 widths out: the darker side, because a second stripe lights one side only. On three lines
/// 1.2 widths apart: a level with the noise of three pixels would be the largest error of a profile averaged over many. And by how
/// much, squared, the sides differ beyond their noise: within the stripe nobody knows which of the two it is.
#[inline(always)]
pub(super) fn background<G: Grey>(image: G, x: i32, y: i32, nx: f32, ny: f32, s: &PeakFrame) -> (f32, f32) {
    let from = (4.0 * s.s0 + 0.5).floor() as i32;
    let to = from + ((2.0 * s.s0 + 0.5).floor() as i32).max(2);
    let along = 1.2 * s.s0;
    // Not 0.5: at slopes of 1 in 32 and the like rounding would decide.
    let (along_u, along_v) = ((along * ny + 0.47).floor() as i32, (0.47 - along * nx).floor() as i32);
    let (mut low, mut high, mut n) = (0, 0, 0f32);
    let mut q = from;
    while q <= to {
        let (du, dv) = ((q as f32 * nx + 0.47).floor() as i32, (q as f32 * ny + 0.47).floor() as i32);
        for (tu, tv) in [(0, 0), (along_u, along_v), (-along_u, -along_v)] {
            low += image.whole(x + tu - du, y + tv - dv);
            high += image.whole(x + tu + du, y + tv + dv);
        }
        n += 3.0;
        q += s.stride;
    }
    let (base, apart) = (low.min(high) as f32 / n, (high - low) as f32 / n);
    let uneven2 = (apart * apart - BY_NOISE * (s.read2 + s.gain * base) / n).max(0.0);
    (base, if from >= BESIDE { uneven2 } else { 0.0 })
}

/// Puts the profiles of up to [`LANES`] skeleton pixels side by side.
#[inline(always)]
pub(super) fn look<G: Grey>(places: &[Place<G>], profiles: &mut Profiles, s: &PeakFrame) -> [Seen; LANES] {
    let mut seen = [Seen::default(); LANES];
    // Farther than that neither of the two looks.
    let reach = (3 * s.lattice_u.max(s.lattice_v)).max((8.0 * s.s0 + 4.0) as i32);
    let inner = |x: i32, y: i32| x.min(y) >= reach && x < s.width - reach && y < s.height - reach;
    for (lane, (place, seen)) in places.iter().zip(&mut seen).enumerate() {
        let (x, y) = place.at();
        *seen = if inner(x, y) { beside(Inner(place.image), x, y, s) } else { beside(place.image, x, y, s) };
        profiles.put(lane, place, seen, s);
    }
    seen
}

#[inline(always)]
fn beside<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> Seen {
    let n = direction(image, x, y, s);
    let (base, uneven2) = background(image, x, y, n.0, n.1, s);
    Seen { n, base, uneven2 }
}

/// Peaks of up to [`LANES`] skeleton pixels: their profiles, then the Gaussians of all of them at once.
#[inline(always)]
pub(super) fn gaussians<G: Grey>(
    places: &[Place<G>],
    profiles: &mut Profiles,
    s: &PeakFrame,
    mut take: impl FnMut(Peak),
) {
    let seen = look(places, profiles, s);
    let found = scoring::gaussians(profiles, places.len(), s);
    for (lane, (place, Seen { n, base, .. })) in places.iter().zip(seen).enumerate() {
        let (x, y) = place.at();
        let [m, a, width, sigma, clipped] =
            [found.m, found.a, found.width, found.sigma, found.clipped].map(|v| v.0[lane]);
        let peak = finish(x, y, n, m, a, base, width, sigma, clipped > 0.0, s);
        take(Peak { pixel: place.pixel, shot: place.shot, ..peak });
    }
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub(super) fn finish(
    x: i32,
    y: i32,
    (nx, ny): (f32, f32),
    m: f32,
    amplitude: f32,
    base: f32,
    width: f32,
    sigma: f32,
    saturated: bool,
    s: &PeakFrame,
) -> Peak {
    // Along the image axis that the profile was taken on: on the line, however the direction errs.
    let columns = by_columns((nx, ny));
    Peak {
        u: x as f32 + if columns { 0.0 } else { m / nx },
        v: y as f32 + if columns { m / ny } else { 0.0 },
        normal_u: nx,
        normal_v: ny,
        amplitude,
        background: base,
        width_px: width,
        sigma_px: sigma,
        snr: amplitude / (s.read2 + s.gain * base).sqrt(),
        flags: if saturated { SATURATED } else { 0 },
        ..Peak::default()
    }
}
