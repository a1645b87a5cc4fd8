//! In: a picture, a skeleton pixel, the expected stripe. Out: peaks by centre of gravity, by derivatives, and without either.
//! Frame and unit: offsets from the skeleton pixel, px; grey levels.

use super::PeakFrame;
use super::fit::{background, direction, exponential, finish};
use super::found::Peak;
use super::grey::Grey;
use super::profile::{Profile, SIDES, share};

/// Centre of gravity of the light above the background, within three widths of a first guess.
#[inline(always)]
pub(super) fn centroid<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> Peak {
    let n = direction(image, x, y, s);
    let base = background(image, x, y, n.0, n.1, s);
    let profile = Profile::new(image, (x, y), n, s);
    let (m0, _) = profile.guess(base, s);
    let near = profile.span(m0, 3.0 * s.s0);
    let quiet = s.read2 + s.gain * base;
    // In samples.
    let z = (m0 - profile.offset) / profile.step;
    let (mut sum, mut moment, mut second, mut noise) = ([0f32; 2], [0f32; 2], [0f32; 2], [0f32; 2]);
    let (mut top, mut saturated) = (0f32, false);
    for (side, sample) in SIDES.into_iter().enumerate() {
        for k in (0..profile.half).map(sample) {
            let inside = share(k, near);
            let (light, d) = (inside * (profile.level(k) - base), k as f32);
            sum[side] += light;
            moment[side] += light * d;
            second[side] += light * (d * d);
            top = top.max(light);
            saturated = saturated || (inside > 0.0 && profile.clipped(k) > 0.0);
            let (e, lit) = (inside * (d - z), light.max(0.0));
            noise[side] += (e * e) * (quiet + s.gain * light + s.speckle2 * (lit * lit));
        }
    }
    let all = sum[0] + sum[1];
    let middle = (moment[0] + moment[1]) / all;
    let centre = (profile.offset + profile.step * middle).clamp(m0 - 2.0 * s.s0, m0 + 2.0 * s.s0);
    let m = if all > 0.0 { centre } else { m0 };
    let spread = (second[0] + second[1]) / all.max(1e-6) - middle * middle;
    let width = ((profile.step * profile.step) * spread - profile.blur2).max(0.0).sqrt();
    let share = profile.square / (profile.weight * profile.weight);
    let sigma = profile.step.abs() * ((noise[0] + noise[1]) * share).sqrt() / all.max(1e-6);
    finish(x, y, n, m, top.max(1.0), base, width, sigma, saturated, s)
}

/// Steger's line point: second-order Taylor expansion of the picture smoothed with a Gaussian of sigma
/// width / √3 or more, which is where the response to a bar has one maximum (\[steger98\] sec. 2.2).
#[inline(always)]
pub(super) fn derivative<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> Peak {
    let n = direction(image, x, y, s);
    let base = background(image, x, y, n.0, n.1, s);
    // The expansion holds within half a pixel: it starts at the pixel nearest to the centre of gravity.
    let (m0, _) = Profile::new(image, (x, y), n, s).guess(base, s);
    let (dx, dy) = ((m0 * n.0 + 0.5).floor() as i32, (m0 * n.1 + 0.5).floor() as i32);
    let (cx, cy) = (x + dx, y + dy);
    let sigma = (s.s0 / 3f32.sqrt()).max(0.8);
    let (r, inverse) = ((3.5 * sigma).ceil() as i32, 1.0 / (sigma * sigma));
    let (mut d1, mut d2, mut smooth, mut noise) = (0f32, 0f32, 0f32, 0f32);
    let (mut top, mut saturated) = (0f32, false);
    for j in -r..=r {
        for i in -r..=r {
            let level = image.at(cx + i, cy + j);
            let d = i as f32 * n.0 + j as f32 * n.1;
            let kernel = exponential(-0.5 * inverse * (i * i + j * j) as f32);
            let first = kernel * d * inverse;
            // Derivatives along the normal only: there the expansion is one-dimensional.
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
    finish(cx, cy, n, m, top.max(1.0), base, width, noise.sqrt() / (-d2).max(1e-6), saturated, s)
}

/// A pixel's position where nothing says in which part of it the centre lies: the standard deviation of an even distribution.
const EVEN: f32 = 0.288_675_13;

/// The pixel itself, on a stripe that lies as it should and is as wide as expected.
#[inline(always)]
pub(super) fn pixel<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> Peak {
    let sign = if s.across_v < 0.0 { -1.0 } else { 1.0 };
    let n = (sign * s.across_u, sign * s.across_v);
    let base = background(image, x, y, n.0, n.1, s);
    let level = image.at(x, y);
    finish(x, y, n, 0.0, (level - base).max(1.0), base, s.s0, EVEN, level >= s.full_scale, s)
}
