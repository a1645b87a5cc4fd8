//! In: a picture, a skeleton pixel, the expected stripe. Out: peaks by centre of gravity, by derivatives, and the
//! skeleton pixel itself. Frame and unit: offsets from the skeleton pixel, px; grey levels.

use super::PeakFrame;
use super::fit::{background, finish, look};
use super::found::Peak;
use super::grey::{Grey, Place};
use super::lanes::{Lanes, exponential};
use super::profile::{Profiles, centre_at, clipped_within, number, share};
use super::windows::Seen;

/// Centre of gravity of the light above the background, within three widths of a first guess.
#[inline(always)]
pub(super) fn centroids<G: Grey>(
    places: &[Place<G>],
    profiles: &mut Profiles,
    s: &PeakFrame,
    mut take: impl FnMut(Peak),
) {
    let seen = look(places, profiles, s);
    let (m0, _) = profiles.guess(s);
    let near = profiles.span(m0, Lanes::all(3.0 * s.s0));
    let quiet = Lanes::all(s.read2) + s.gain * profiles.base;
    // Unit: samples.
    let z = (m0 - profiles.offset) / profiles.step;
    let none = [Lanes::ZERO; 2];
    let (mut sum, mut moment, mut second, mut noise) = (none, none, none, none);
    let (mut top, mut clipped) = (Lanes::ZERO, Lanes::ZERO);
    for side in 0..2 {
        let samples = profiles.levels[side][..profiles.half].iter().zip(&profiles.clipped[side]);
        for (j, (&level, &lost)) in samples.enumerate() {
            let d = number(side, j);
            let inside = share(d, near);
            let light = inside * (level - profiles.base);
            sum[side] = sum[side] + light;
            moment[side] = moment[side] + d * light;
            second[side] = second[side] + (d * d) * light;
            top = top.max(light);
            clipped = clipped.max(clipped_within(lost, inside));
            let (e, lit) = (inside * (Lanes::all(d) - z), light.max(Lanes::ZERO));
            noise[side] = noise[side] + (e * e) * (quiet + s.gain * light + s.speckle2 * (lit * lit));
        }
    }
    let all = sum[0] + sum[1];
    let middle = (moment[0] + moment[1]) / all;
    let reach = Lanes::all(2.0 * s.s0);
    let centre = (profiles.offset + profiles.step * middle).clamp(m0 - reach, m0 + reach);
    let m = Lanes(std::array::from_fn(|l| if all.0[l] > 0.0 { centre.0[l] } else { m0.0[l] }));
    let least = all.max(Lanes::all(1e-6));
    let spread = (second[0] + second[1]) / least - middle * middle;
    let width = ((profiles.step * profiles.step) * spread - profiles.blur2).max(Lanes::ZERO).sqrt();
    let share = profiles.square / (profiles.weight * profiles.weight);
    let sigma = profiles.step.map(f32::abs) * ((noise[0] + noise[1]) * share).sqrt() / least;
    for (lane, (place, Seen { at: (x, y), n, base, .. })) in places.iter().zip(seen).enumerate() {
        let [m, top, width, sigma, clipped] = [m, top, width, sigma, clipped].map(|v| v.0[lane]);
        let peak = finish(centre_at((x, y), n, m), n, top.max(1.0), base, width, sigma, clipped > 0.0, s);
        take(Peak { pixel: place.pixel, shot: place.shot, ..peak });
    }
}

/// Centres by derivatives, each computed at the centre of gravity.
#[inline(always)]
pub(super) fn derivatives<G: Grey>(
    places: &[Place<G>],
    profiles: &mut Profiles,
    s: &PeakFrame,
    mut take: impl FnMut(Peak),
) {
    let seen = look(places, profiles, s);
    let (m0, _) = profiles.guess(s);
    for (lane, (place, seen)) in places.iter().zip(seen).enumerate() {
        let peak = derivative(place.image, m0.0[lane], seen, s);
        take(Peak { pixel: place.pixel, shot: place.shot, ..peak });
    }
}

/// Steger's line point: a second-order Taylor expansion of the picture smoothed with a Gaussian of sigma width / √3 or
/// more. From that sigma on the response to a bar has one maximum (\[steger98\] sec. 2.2).
#[inline(always)]
fn derivative<G: Grey>(image: G, m0: f32, Seen { at: (x, y), n, base, .. }: Seen, s: &PeakFrame) -> Peak {
    // The expansion holds within half a pixel, so it starts at the pixel nearest to the centre of gravity.
    let (dx, dy) = ((m0 * n.0 + 0.5).floor() as i32, (m0 * n.1 + 0.5).floor() as i32);
    let (cx, cy) = (x + dx, y + dy);
    let sigma = (s.s0 / 3f32.sqrt()).max(0.8);
    let (r, inverse) = ((3.5 * sigma).ceil() as i32, 1.0 / (sigma * sigma));
    let (mut d1, mut d2, mut smooth, mut noise) = (0f32, 0f32, 0f32, 0f32);
    let (mut top, mut saturated) = (0f32, false);
    for j in -r..=r {
        for i in -r..=r {
            let level = image.level(cx + i, cy + j);
            let d = i as f32 * n.0 + j as f32 * n.1;
            let kernel = exponential(Lanes::all(-0.5 * inverse * (i * i + j * j) as f32)).0[0];
            let first = kernel * d * inverse;
            // Only derivatives along the normal: the expansion is one-dimensional.
            d1 += first * (level - base);
            d2 += kernel * (d * d * inverse - 1.0) * inverse * (level - base);
            smooth += kernel * (level - base);
            let lit = (level - base).max(0.0);
            noise += (first * first) * (s.read2 + s.gain * level + s.speckle2 * (lit * lit));
            if i.abs().max(j.abs()) <= 1 {
                top = top.max(level - base);
            }
            saturated |= level >= s.full_scale;
        }
    }
    let m = if d2 < 0.0 { (-d1 / d2).clamp(-s.s0, s.s0) } else { 0.0 };
    // For a Gaussian line the curvature over the value of the smoothed profile is -1 / (w² + sigma²).
    let width = (smooth / (-d2).max(1e-6) - sigma * sigma).max(0.0).sqrt();
    let centre = (cx as f32 + m * n.0, cy as f32 + m * n.1);
    finish(centre, n, top.max(1.0), base, width, noise.sqrt() / (-d2).max(1e-6), saturated, s)
}

/// Standard deviation of a centre that may lie anywhere in its pixel, px: that of a uniform distribution.
pub(in crate::stages) const EVEN: f32 = 0.288_675_13;

/// The skeleton pixel itself, for a stripe of the expected direction and width.
#[inline(always)]
pub(super) fn pixel<G: Grey>(place: &Place<G>, s: &PeakFrame) -> Peak {
    let (image, (x, y)) = (place.image, place.at());
    let sign = if s.across_v < 0.0 { -1.0 } else { 1.0 };
    let n = (sign * s.across_u, sign * s.across_v);
    let (base, _) = background(image, x, y, n.0, n.1, s);
    let level = image.level(x, y);
    let peak = finish((x as f32, y as f32), n, (level - base).max(1.0), base, s.s0, EVEN, level >= s.full_scale, s);
    Peak { pixel: place.pixel, shot: place.shot, ..peak }
}
