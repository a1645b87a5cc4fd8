//! In: a picture, a skeleton pixel, the expected stripe. Out: the maximum-likelihood Gaussian profile across it.
//! Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe peak (1) to (5).

use super::{Grey, Peak, PeakFrame, SATURATED};

/// Direction across the stripe: the strongest eigenvector of the structure tensor, with differences over one
/// stripe width so that noise of single pixels does not turn it (docs/math.md, Stripe peak (1)).
pub(super) fn direction<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> (f32, f32) {
    let edge = (s.reach + 1) as f32;
    let scale = 1.0 / (edge * edge);
    let (mut xx, mut xy, mut yy) = (0f32, 0f32, 0f32);
    let mut j = -s.reach;
    while j <= s.reach {
        let mut i = -s.reach;
        while i <= s.reach {
            let fade = (1.0 - (i * i + j * j) as f32 * scale).max(0.0);
            let weight = fade * fade;
            let (a, b) = (x + i, y + j);
            let gx = image.at(a + s.lag, b) - image.at(a - s.lag, b);
            let gy = image.at(a, b + s.lag) - image.at(a, b - s.lag);
            xx += weight * (gx * gx);
            xy += weight * (gx * gy);
            yy += weight * (gy * gy);
            i += s.stride;
        }
        j += s.stride;
    }
    let d = 0.5 * (xx - yy);
    let q = (d * d + xy * xy).sqrt();
    let (nx, ny) = if d > 0.0 { (d + q, xy) } else { (xy, q - d) };
    let l = (nx * nx + ny * ny).sqrt();
    if l < 1e-9 {
        return (0.0, 1.0);
    }
    let sign = if ny < 0.0 { -1.0 } else { 1.0 };
    (sign * nx / l, sign * ny / l)
}

/// Level beside the stripe, 4 to 6 widths out: the darker side, because a second stripe lights one side only.
pub(super) fn background<G: Grey>(image: G, x: i32, y: i32, nx: f32, ny: f32, s: &PeakFrame) -> f32 {
    let from = (4.0 * s.s0 + 0.5).floor() as i32;
    let to = from + ((2.0 * s.s0 + 0.5).floor() as i32).max(2);
    let (mut low, mut high, mut n) = (0f32, 0f32, 0f32);
    let mut q = from;
    while q <= to {
        for t in -1..=1 {
            let (du, dv) = (q as f32 * nx - t as f32 * ny, q as f32 * ny + t as f32 * nx);
            let (du, dv) = ((du + 0.5).floor() as i32, (dv + 0.5).floor() as i32);
            low += image.at(x - du, y - dv);
            high += image.at(x + du, y + dv);
            n += 1.0;
        }
        q += s.stride;
    }
    low.min(high) / n
}

/// The pixels that take part: columns (or rows) along the stripe, in each those within three widths of the line.
/// `visit` gets offset across, offset along, weight, grey level.
#[inline(always)]
pub(super) fn window<G: Grey>(
    image: G,
    (x, y): (i32, i32),
    (nx, ny): (f32, f32),
    m0: f32,
    s: &PeakFrame,
    mut visit: impl FnMut(f32, f32, f32),
) {
    // Walk along the image axis that is nearer to the stripe.
    let rows = ny >= nx.abs();
    let (na, nb) = if rows { (nx, ny) } else { (ny, nx) };
    let half = 3.0 * s.s0;
    let reach = (half / nb.abs()).ceil() as i32;
    let mut i = -s.reach_along;
    while i <= s.reach_along {
        let centre = ((m0 - i as f32 * na) / nb + 0.5).floor() as i32;
        for j in centre - reach..=centre + reach {
            let (di, dj) = if rows { (i, j) } else { (j, i) };
            let d = di as f32 * nx + dj as f32 * ny;
            let t = dj as f32 * nx - di as f32 * ny;
            let (a, b) = (x + di, y + dj);
            if (d - m0).abs() <= half && a >= 0 && b >= 0 && a < s.width && b < s.height {
                let fade = (1.0 - s.along_factor * (t * t)).max(0.0);
                visit(d, fade * fade, image.at(a, b));
            }
        }
        i += s.stride_along;
    }
}

/// First guess of offset and amplitude: centre of gravity and sum above the background.
pub(super) fn guess<G: Grey>(image: G, at: (i32, i32), n: (f32, f32), background: f32, s: &PeakFrame) -> (f32, f32) {
    let (mut sum, mut moment, mut square) = (0f32, 0f32, 0f32);
    window(image, at, n, 0.0, s, |d, weight, level| {
        // A window of 1.5 widths: neighbours of the stripe shall not pull.
        let near = if d.abs() <= 1.5 * s.s0 + 0.5 { weight } else { 0.0 };
        let light = near * (level - background).max(0.0);
        sum += light;
        moment += light * d;
        square += near;
    });
    let m = if sum > 0.0 { moment / sum } else { 0.0 };
    (m, (1.25 * sum / square.max(1e-6)).max(1.0))
}

/// Fisher scoring of amplitude, offset and width. Variance of a pixel: read noise + gain · level + speckle² · light².
/// A saturated pixel says only "at least this bright": it pulls while the model is below it and is silent above.
pub(super) fn gaussian<G: Grey>(image: G, x: i32, y: i32, s: &PeakFrame) -> Peak {
    let (nx, ny) = direction(image, x, y, s);
    let base = background(image, x, y, nx, ny, s);
    let (m0, mut a) = guess(image, (x, y), (nx, ny), base, s);
    let (mut m, mut w) = (m0, s.s0);
    // A weak belief that the width is the expected one keeps two or three lit pixels solvable.
    let prior = 4.0 / (s.s0 * s.s0);
    let (mut i11, mut chi, mut spread) = (0f32, 0f32, 1f32);
    let mut saturated = false;
    let mut step = 0;
    while step < s.steps {
        let (mut h00, mut h01, mut h02, mut h11, mut h12, mut h22) = (1e-9f32, 0f32, 0f32, 1e-9f32, 0f32, prior);
        let (mut g0, mut g1, mut g2) = (0f32, 0f32, prior * (s.s0 - w));
        let (mut sum, mut sum_square, mut sum_weight) = (0f32, 0f32, 0f32);
        let mut any = false;
        let inverse = 1.0 / w;
        window(image, (x, y), (nx, ny), m0, s, |d, weight, level| {
            let z = (d - m) * inverse;
            let shape = (-0.5 * (z * z)).exp();
            let model = a * shape;
            let full = level >= s.full_scale;
            any = any || (full && weight > 0.0);
            let silent = full && model + base >= level;
            let residual = level - base - model;
            let quiet = s.read2 + s.gain * (model + base);
            let believed = if silent { 0.0 } else { weight };
            let certainty = believed / (quiet + s.speckle2 * (model * model));
            let jm = model * (z * inverse);
            let jw = jm * z;
            h00 += certainty * (shape * shape);
            h01 += certainty * (shape * jm);
            h02 += certainty * (shape * jw);
            h11 += certainty * (jm * jm);
            h12 += certainty * (jm * jw);
            h22 += certainty * (jw * jw);
            g0 += certainty * (shape * residual);
            g1 += certainty * (jm * residual);
            g2 += certainty * (jw * residual);
            sum += certainty * (residual * residual);
            sum_weight += believed;
            sum_square += believed * believed;
        });
        let c00 = h11 * h22 - h12 * h12;
        let c01 = h02 * h12 - h01 * h22;
        let c02 = h01 * h12 - h02 * h11;
        let c11 = h00 * h22 - h02 * h02;
        let c12 = h01 * h02 - h00 * h12;
        let c22 = h00 * h11 - h01 * h01;
        let det = h00 * c00 + (h01 * c01 + h02 * c02);
        let da = (c00 * g0 + (c01 * g1 + c02 * g2)) / det;
        let dm = (c01 * g0 + (c11 * g1 + c12 * g2)) / det;
        let dw = (c02 * g0 + (c12 * g1 + c22 * g2)) / det;
        // Bounded steps: the model is not linear far from the answer.
        let da = da.clamp(-0.5 * a, a);
        let dm = dm.clamp(-0.7 * s.s0, 0.7 * s.s0);
        let dw = dw.clamp(-0.3 * s.s0, 0.3 * s.s0);
        a = (a + da).max(1.0);
        m = (m + dm).clamp(m0 - 2.0 * s.s0, m0 + 2.0 * s.s0);
        w = (w + dw).clamp(0.3 * s.s0, 3.0 * s.s0);
        i11 = c11 / det;
        let pixels = sum_weight.max(1e-6);
        chi = sum / pixels;
        spread = sum_square / pixels;
        saturated = any;
        step += 1;
        if dm.abs() < 2e-3 * s.s0 && dw.abs() < 5e-3 * s.s0 && da.abs() < 5e-3 * a {
            break;
        }
    }
    // Where the noise is larger than the model says, the centre is less certain by the same factor.
    let sigma = (i11 * spread * chi.max(0.05)).max(0.0).sqrt();
    Peak {
        u: x as f32 + m * nx,
        v: y as f32 + m * ny,
        normal_u: nx,
        normal_v: ny,
        amplitude: a,
        background: base,
        width_px: w,
        sigma_px: sigma,
        snr: a / (s.read2 + s.gain * base).sqrt(),
        flags: if saturated { SATURATED } else { 0 },
        ..Peak::default()
    }
}
