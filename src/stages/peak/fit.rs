//! In: pictures, skeleton pixels, the expected stripe. Out: the level beside the stripe; peaks by a maximum-likelihood
//! fit of a Gaussian across it. Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe
//! peak (2) to (5).

use super::PeakFrame;
use super::across::centre::centred;
use super::across::direction::direction;
use super::found::{Peak, SATURATED};
use super::grey::{Grey, Inner, Place};
use super::lanes::LANES;
use super::profile::{Profiles, centre_at};
use super::scoring;
use super::windows::Seen;

/// Distance in px within which a narrow stripe's own light lies, more of it on the side that its centre is closer to.
pub(in crate::stages) const BESIDE: i32 = 4;
/// Limit for the squared difference of two sides of one level, in units of a pixel's variance over the pixels of a
/// side. The mean of that is 2, and four times the mean is hardly ever exceeded.
pub(in crate::stages) const BY_NOISE: f32 = 8.0;

/// Level beside the stripe, 4 to 6 widths away: that of the darker side, because a second stripe lights only one side.
/// It is the mean of three lines 1.2 widths apart: with the noise of only three pixels it would be the largest error of
/// a profile averaged over many. The second value is the squared difference of the two sides beyond their noise,
/// because which of the two levels the stripe lies on is unknown.
#[inline(always)]
pub(super) fn background<G: Grey>(image: G, x: i32, y: i32, nx: f32, ny: f32, s: &PeakFrame) -> (f32, f32) {
    let from = (4.0 * s.s0 + 0.5).floor() as i32;
    let to = from + ((2.0 * s.s0 + 0.5).floor() as i32).max(2);
    let along = 1.2 * s.s0;
    // Not 0.5, so that rounding errors do not decide at slopes such as 1 in 32.
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

/// Stores the profiles of up to [`LANES`] skeleton pixels side by side. Lanes without a place repeat the first one.
#[inline(always)]
pub(super) fn look<G: Grey>(places: &[Place<G>], profiles: &mut Profiles, s: &PeakFrame) -> [Seen; LANES] {
    // Farthest pixel that is read for the direction, the level beside the stripe and the profile.
    let beside_stripe = (8.0 * s.s0 + 4.0).max(s.radius + 4.5 * s.s0 + 9.0);
    let reach = (3 * s.lattice_u.max(s.lattice_v)).max(beside_stripe as i32);
    let inner = |x: i32, y: i32| x.min(y) >= reach && x < s.width - reach && y < s.height - reach;
    let mut seen = [Seen::default(); LANES];
    let mut together = true;
    for (place, seen) in places.iter().zip(&mut seen) {
        let at = centred(place.image, place.at(), s);
        let within = inner(at.0, at.1);
        *seen = if within { beside(Inner(place.image), at, s) } else { beside(place.image, at, s) };
        together &= within && place.image.is(&places[0].image);
    }
    let last = places.len();
    (last..LANES).for_each(|lane| seen[lane] = seen[0]);
    let images = std::array::from_fn(|lane| places[if lane < last { lane } else { 0 }].image);
    if together {
        profiles.put::<G, true>(images, &seen, s);
    } else {
        profiles.put::<G, false>(images, &seen, s);
    }
    seen
}

/// The direction and the level beside the stripe at a place.
#[inline(always)]
fn beside<G: Grey>(image: G, (x, y): (i32, i32), s: &PeakFrame) -> Seen {
    let n = direction(image, x, y, s);
    let (base, uneven2) = background(image, x, y, n.0, n.1, s);
    Seen { at: (x, y), n, base, uneven2 }
}

/// Peaks of up to [`LANES`] skeleton pixels: their profiles, then all their Gaussian fits at once.
#[inline(always)]
pub(super) fn gaussians<G: Grey>(
    places: &[Place<G>],
    profiles: &mut Profiles,
    s: &PeakFrame,
    mut take: impl FnMut(Peak),
) {
    let seen = look(places, profiles, s);
    let found = scoring::gaussians(profiles, places.len(), s);
    for (lane, (place, Seen { at: (x, y), n, base, .. })) in places.iter().zip(seen).enumerate() {
        let [m, a, width, sigma, clipped] =
            [found.m, found.a, found.width, found.sigma, found.clipped].map(|v| v.0[lane]);
        let peak = finish(centre_at((x, y), n, m), n, a, base, width, sigma, clipped > 0.0, s);
        take(Peak { pixel: place.pixel, shot: place.shot, ..peak });
    }
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub(super) fn finish(
    (u, v): (f32, f32),
    (normal_u, normal_v): (f32, f32),
    amplitude: f32,
    base: f32,
    width: f32,
    sigma: f32,
    saturated: bool,
    s: &PeakFrame,
) -> Peak {
    Peak {
        u,
        v,
        normal_u,
        normal_v,
        amplitude,
        background: base,
        width_px: width,
        sigma_px: sigma,
        snr: amplitude / (s.read2 + s.gain * base).sqrt(),
        flags: if saturated { SATURATED } else { 0 },
        ..Peak::default()
    }
}
