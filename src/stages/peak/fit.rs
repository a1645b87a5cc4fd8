//! In: a picture, a skeleton pixel, the expected stripe. Out: the maximum-likelihood Gaussian profile across it.
//! Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe peak (1) to (5).

use super::PeakFrame;
use super::found::{Peak, SATURATED};
use super::grey::Grey;
use super::profile::{Profile, SIDES, by_columns, share};
use super::turn::GRADIENTS;

/// Direction across the stripe: the strongest eigenvector of the structure tensor, on grey levels so far apart that noise
/// of single pixels does not turn it, and what so far differences make of it is put right (docs/math.md, Stripe peak (1)).
#[inline(always)]
pub(super) fn direction<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> (f32, f32) {
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

/// Half the difference of the diagonal, the other element, and half the difference of the eigenvalues. Sums of whole numbers, of
/// ten bits a gradient: which pixels a profile is made of hangs on the direction, and must not hang on rounding.
#[inline(always)]
fn tensor<G: Grey>(image: G, x: i32, y: i32, u: i32, v: i32, deep: u32) -> (f32, f32, f32) {
    let half = 1 << deep >> 1;
    let gradient = |a: (i32, i32), b: (i32, i32)| {
        let at = |(i, j): (i32, i32)| image.at(x + i * u, y + j * v) as i32;
        (at(a) - at(b) + half) >> deep
    };
    let (mut xx, mut xy, mut yy) = (0i32, 0i32, 0i32);
    for (i, j, weight) in GRADIENTS {
        let gx = gradient((i + 1, j), (i - 1, j));
        let gy = gradient((i, j + 1), (i, j - 1));
        xx += weight * (gx * gx);
        xy += weight * (gx * gy);
        yy += weight * (gy * gy);
    }
    let ratio = v as f32 / u as f32;
    let (xx, xy, yy) = ((ratio * ratio) * xx as f32, ratio * xy as f32, yy as f32);
    let d = 0.5 * (xx - yy);
    (d, xy, (d * d + xy * xy).sqrt())
}

/// Level beside the stripe, 4 to 6 widths out: the darker side, because a second stripe lights one side only. On three lines
/// 1.2 widths apart: a level with the noise of three pixels would be the largest error of a profile averaged over many.
#[inline(always)]
pub(super) fn background<G: Grey>(image: G, x: i32, y: i32, nx: f32, ny: f32, s: &PeakFrame) -> f32 {
    let from = (4.0 * s.s0 + 0.5).floor() as i32;
    let to = from + ((2.0 * s.s0 + 0.5).floor() as i32).max(2);
    let along = 1.2 * s.s0;
    // Not 0.5: at slopes of 1 in 32 and the like rounding would decide.
    let (along_u, along_v) = ((along * ny + 0.47).floor() as i32, (0.47 - along * nx).floor() as i32);
    let (mut low, mut high, mut n) = (0f32, 0f32, 0f32);
    let mut q = from;
    while q <= to {
        let (du, dv) = ((q as f32 * nx + 0.47).floor() as i32, (q as f32 * ny + 0.47).floor() as i32);
        for (tu, tv) in [(0, 0), (along_u, along_v), (-along_u, -along_v)] {
            low += image.at(x + tu - du, y + tv - dv);
            high += image.at(x + tu + du, y + tv + dv);
        }
        n += 3.0;
        q += s.stride;
    }
    low.min(high) / n
}

/// Samples for which the noise model counts.
const BELIEF: f32 = 10.0;
/// Grey levels that are no light, but whose square is no denormal number: those take a CPU many times as long.
const DARK: f32 = 1e-9;
/// Share of a number's information that is left at least where another number explains it: what f32 can tell from nothing.
const LEAST: f32 = 1e-5;
/// Share of the ceiling over which clipped pixels fall silent: at once, and rounding would decide.
const SOFT: f32 = 0.05;

// The digits of the shader.
#[allow(clippy::approx_constant)]
/// e to the power of x from -80 to 80, to 2e-7 of itself: every machine has its own `exp`, this one is the shader's.
#[inline(always)]
pub(super) fn exponential(x: f32) -> f32 {
    let t = (x * std::f32::consts::LOG2_E).clamp(-120.0, 120.0);
    let whole = (t + 0.5).floor();
    let f = t - whole;
    let p = 0.009_618_129 + f * (0.001_333_356 + f * 0.000_154_035_3);
    let p = 1.0 + f * (0.693_147_2 + f * (0.240_226_5 + f * (0.055_504_11 + f * p)));
    p * f32::from_bits(((whole as i32 + 127) as u32) << 23)
}

/// Fisher scoring of amplitude, offset and width on the profile. Variance of a pixel: read noise + gain · level +
/// speckle² · light². A saturated pixel says only "at least this bright".
#[inline(always)]
pub(super) fn gaussian<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> Peak {
    let n = direction(image, x, y, s);
    let base = background(image, x, y, n.0, n.1, s);
    let profile = Profile::new(image, (x, y), n, s);
    let (m0, mut a) = profile.guess(base, s);
    // The width that is expected of the profile.
    let s0 = (s.s0 * s.s0 + profile.blur2).sqrt();
    let (mut m, mut w) = (m0, s0);
    // A weak belief that the width is the expected one keeps two or three lit pixels solvable.
    let prior = 4.0 / (s0 * s0);
    let (mut i11, mut squares, mut believed) = (0f32, 0f32, 0f32);
    let near = profile.span(m0, 3.0 * s0);
    let saturated = (-profile.half..profile.half).any(|k| share(k, near) > 0.0 && profile.clipped(k) > 0.0);
    let quiet = s.read2 + s.gain * base;
    let ceiling = s.full_scale - base;
    let soft = 1.0 / (SOFT * ceiling).max(1.0);
    let mut step = 0;
    while step < s.steps {
        let inverse = 1.0 / w;
        let wide = profile.step * inverse;
        let z0 = (profile.offset - m) * inverse;
        // Sums over certainty times model squared times z^0, z^1, .. z^4; certainty, residual, model and z^0, z^1, z^2.
        let (mut e, mut r) = ([[0f32; 5]; 2], [[0f32; 3]; 2]);
        let (mut chi2, mut count) = ([0f32; 2], [0f32; 2]);
        for (side, sample) in SIDES.into_iter().enumerate() {
            let (mut z, dz) = if side == 0 { (z0, wide) } else { (z0 - wide, -wide) };
            // A Gaussian at equal steps: its ratio from sample to sample falls by a constant factor. From the middle to
            // both sides, because what has become 0 stays 0.
            let mut model = a * exponential(-0.5 * (z * z));
            let mut ratio = exponential(-0.5 * (dz * dz) - dz * z);
            let fall = exponential(-(wide * wide));
            for k in (0..profile.half).map(sample) {
                let inside = share(k, near);
                if inside > 0.0 {
                    let (light, lost) = (profile.level(k) - base, profile.clipped(k));
                    // Clipped pixels pull while the model is below them, and are silent above.
                    let above = (soft * (model - ceiling) + 0.5).clamp(0.0, 1.0);
                    let all = inside * profile.weight;
                    let heard = (1.0 - above * lost).max(1e-3);
                    let residual = (light - model) + (above * lost) * (model - ceiling);
                    let inverse = all / (heard * (quiet + model * (s.gain + s.speckle2 * model)));
                    let certainty = (heard * heard) * inverse;
                    let pull = (heard * inverse) * residual;
                    let (mut h, mut p) = (certainty * (model * model), pull * model);
                    for sum in &mut e[side] {
                        *sum += h;
                        h *= z;
                    }
                    for sum in &mut r[side] {
                        *sum += p;
                        p *= z;
                    }
                    chi2[side] += (inverse * residual) * residual;
                    count[side] += all * heard;
                }
                model = (model * ratio).max(DARK);
                ratio *= fall;
                z += dz;
            }
        }
        let e: [f32; 5] = std::array::from_fn(|i| e[0][i] + e[1][i]);
        let r: [f32; 3] = std::array::from_fn(|i| r[0][i] + r[1][i]);
        // In parts of amplitude, width and width; a prior of nearly nothing keeps darkness solvable.
        let (h00, h01, h02, h11, h12) = (e[0] + 1e-9, e[1], e[2], e[2] + 1e-9, e[3]);
        let h22 = e[4] + prior * (w * w);
        let (g0, g1, g2) = (r[0], r[1], r[2] + (prior * w) * (s0 - w));
        // Amplitude, then width are eliminated, the centre comes last: d1 is what the light says of it alone. Where it says nothing,
        // as of a stripe that is clipped all over, rounding shall not make up a certainty.
        let (l01, l02) = (h01 / h00, h02 / h00);
        let d2 = (h22 - l02 * h02).max(LEAST * h22);
        let s12 = h12 - l02 * h01;
        let l12 = s12 / d2;
        let d1 = (h11 - (l01 * h01 + l12 * s12)).max(LEAST * h11);
        let y2 = g2 - l02 * g0;
        let x1 = (g1 - (l01 * g0 + l12 * y2)) / d1;
        let x2 = y2 / d2 - l12 * x1;
        let x0 = g0 / h00 - (l02 * x2 + l01 * x1);
        // Bounded steps: the model is not linear far from the answer.
        let da = (a * x0).clamp(-0.5 * a, a);
        let dm = (w * x1).clamp(-0.7 * s0, 0.7 * s0);
        let dw = (w * x2).clamp(-0.3 * s0, 0.3 * s0);
        i11 = (w * w) / d1;
        // By what this step lowers the squares: they are wanted where the fit ends.
        let gain = (g0 * (da / a) + g1 * (dm / w)) + g2 * (dw / w);
        a = (a + da).max(1.0);
        m = (m + dm).clamp(m0 - 2.0 * s0, m0 + 2.0 * s0);
        w = (w + dw).clamp(0.3 * s0, 3.0 * s0);
        (squares, believed) = ((chi2[0] + chi2[1] - gain).max(0.0), (count[0] + count[1]) / profile.weight);
        step += 1;
        // The next step would be a tenth of this one and less: far below what noise leaves.
        if dm.abs() < 1e-2 * s0 && dw.abs() < 3e-2 * s0 && da.abs() < 3e-2 * a {
            break;
        }
    }
    // A sample is the weighted mean of pixels that err independently: its variance is a pixel's times this.
    let share = profile.square / profile.weight;
    // Where the noise is larger than the model says, the centre is less certain by the same factor. Few samples tell
    // little of it, so where it seems smaller the model counts for ten samples.
    let free = (believed - 3.0).max(1.0);
    let chi2 = squares / share;
    let noise = (chi2 / free).max((BELIEF + chi2) / (BELIEF + free));
    let sigma = (i11 * share * noise).max(0.0).sqrt();
    let width = (w * w - profile.blur2).max(0.01 * s.s0 * s.s0).sqrt();
    finish(x, y, n, m, a, base, width, sigma, saturated, s)
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
