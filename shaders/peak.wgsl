// In: the pictures of a batch and their skeleton pixels. Out: one peak a pixel. Twin: src/stages/peak/fit.rs and
// methods.rs, where the reasons stand; docs/math.md, Stripe peak (1) to (5). Frame and unit: pixels, grey levels.
@group(0) @binding(0) var<uniform> frame: PeakFrame;
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read> header: array<u32>;
@group(0) @binding(3) var<storage, read> points: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> peaks: array<Peak>;

// Pixels a word as a power of two: 2 for 8-bit pictures, 1 for deeper ones.
override px_log2: u32 = 2u;
// 0 Gaussian, 1 centroid, 2 derivative.
override peak_method: u32 = 0u;

const SATURATED = 256u;

// First word of the picture; set once.
var<private> first: u32;

fn level(x: i32, y: i32) -> f32 {
    let a = u32(clamp(x, 0, frame.width - 1));
    let b = u32(clamp(y, 0, frame.height - 1));
    let bits = 32u >> px_log2;
    let place = a & ((1u << px_log2) - 1u);
    return f32((image[first + b * frame.pitch + (a >> px_log2)] >> (place * bits)) & ((1u << bits) - 1u));
}

fn direction(x: i32, y: i32) -> vec2<f32> {
    let edge = f32(frame.reach + 1);
    let scale = 1.0 / (edge * edge);
    var xx = 0.0;
    var xy = 0.0;
    var yy = 0.0;
    for (var j = -frame.reach; j <= frame.reach; j += frame.stride) {
        for (var i = -frame.reach; i <= frame.reach; i += frame.stride) {
            let fade = max(1.0 - f32(i * i + j * j) * scale, 0.0);
            let weight = fade * fade;
            let gx = level(x + i + frame.lag, y + j) - level(x + i - frame.lag, y + j);
            let gy = level(x + i, y + j + frame.lag) - level(x + i, y + j - frame.lag);
            xx += weight * (gx * gx);
            xy += weight * (gx * gy);
            yy += weight * (gy * gy);
        }
    }
    let d = 0.5 * (xx - yy);
    let q = sqrt(d * d + xy * xy);
    let n = select(vec2(xy, q - d), vec2(d + q, xy), d > 0.0);
    let l = sqrt(n.x * n.x + n.y * n.y);
    let sign = select(1.0, -1.0, n.y < 0.0);
    return select(vec2(sign * n.x / l, sign * n.y / l), vec2(0.0, 1.0), l < 1e-9);
}

fn background(x: i32, y: i32, n: vec2<f32>) -> f32 {
    let start = i32(floor(4.0 * frame.s0 + 0.5));
    let end = start + max(i32(floor(2.0 * frame.s0 + 0.5)), 2);
    var low = 0.0;
    var high = 0.0;
    var count = 0.0;
    for (var q = start; q <= end; q += frame.stride) {
        for (var t = -1; t <= 1; t++) {
            let du = i32(floor((f32(q) * n.x - f32(t) * n.y) + 0.5));
            let dv = i32(floor((f32(q) * n.y + f32(t) * n.x) + 0.5));
            low += level(x - du, y - dv);
            high += level(x + du, y + dv);
            count += 1.0;
        }
    }
    return min(low, high) / count;
}

// The window: columns (or rows) along the stripe, in each the pixels within three widths of the line.
struct Window {
    rows: bool,
    na: f32,
    nb: f32,
    half: f32,
    reach: i32,
}
fn window(n: vec2<f32>) -> Window {
    let rows = n.y >= abs(n.x);
    let nb = select(n.x, n.y, rows);
    let half = 3.0 * frame.s0;
    return Window(rows, select(n.y, n.x, rows), nb, half, i32(ceil(half / abs(nb))));
}
// Where the window's line of pixels i has its middle.
fn middle(w: Window, i: i32, m0: f32) -> i32 {
    return i32(floor((m0 - f32(i) * w.na) / w.nb + 0.5));
}
// Offset across, weight along (0 outside the window or the picture).
fn place(w: Window, n: vec2<f32>, m0: f32, at: vec2<i32>, di: i32, dj: i32) -> vec2<f32> {
    let d = f32(di) * n.x + f32(dj) * n.y;
    let t = f32(dj) * n.x - f32(di) * n.y;
    let fade = max(1.0 - frame.along_factor * (t * t), 0.0);
    let a = at.x + di;
    let b = at.y + dj;
    let inside = abs(d - m0) <= w.half && a >= 0 && b >= 0 && a < frame.width && b < frame.height;
    return vec2(d, select(0.0, fade * fade, inside));
}

// First guess of offset and amplitude.
fn guess(at: vec2<i32>, n: vec2<f32>, base: f32) -> vec2<f32> {
    let w = window(n);
    var sum = 0.0;
    var moment = 0.0;
    var square = 0.0;
    for (var i = -frame.reach_along; i <= frame.reach_along; i += frame.stride_along) {
        let centre = middle(w, i, 0.0);
        for (var j = centre - w.reach; j <= centre + w.reach; j++) {
            let di = select(j, i, w.rows);
            let dj = select(i, j, w.rows);
            let p = place(w, n, 0.0, at, di, dj);
            let near = select(0.0, p.y, abs(p.x) <= 1.5 * frame.s0 + 0.5);
            let light = near * max(level(at.x + di, at.y + dj) - base, 0.0);
            sum += light;
            moment += light * p.x;
            square += near;
        }
    }
    let m = select(0.0, moment / sum, sum > 0.0);
    return vec2(m, max(1.25 * sum / max(square, 1e-6), 1.0));
}

fn finish(at: vec2<i32>, n: vec2<f32>, m: f32, amplitude: f32, base: f32, width: f32, sigma: f32, full: bool) -> Peak {
    var peak: Peak;
    peak.u = f32(at.x) + m * n.x;
    peak.v = f32(at.y) + m * n.y;
    peak.normal_u = n.x;
    peak.normal_v = n.y;
    peak.amplitude = amplitude;
    peak.background = base;
    peak.width_px = width;
    peak.sigma_px = sigma;
    peak.snr = amplitude / sqrt(frame.read2 + frame.gain * base);
    peak.flags = select(0u, SATURATED, full);
    return peak;
}

fn gaussian(at: vec2<i32>) -> Peak {
    let n = direction(at.x, at.y);
    let base = background(at.x, at.y, n);
    let start = guess(at, n, base);
    let m0 = start.x;
    let w = window(n);
    var a = start.y;
    var m = m0;
    var width = frame.s0;
    let prior = 4.0 / (frame.s0 * frame.s0);
    var i11 = 0.0;
    var chi = 0.0;
    var spread = 1.0;
    var saturated = false;
    var left = frame.steps;
    while left > 0u {
        var h00 = 1e-9;
        var h01 = 0.0;
        var h02 = 0.0;
        var h11 = 1e-9;
        var h12 = 0.0;
        var h22 = prior;
        var g0 = 0.0;
        var g1 = 0.0;
        var g2 = prior * (frame.s0 - width);
        var sum = 0.0;
        var sum_square = 0.0;
        var sum_weight = 0.0;
        var any = false;
        let inverse = 1.0 / width;
        for (var i = -frame.reach_along; i <= frame.reach_along; i += frame.stride_along) {
            let centre = middle(w, i, m0);
            for (var j = centre - w.reach; j <= centre + w.reach; j++) {
                let di = select(j, i, w.rows);
                let dj = select(i, j, w.rows);
                let p = place(w, n, m0, at, di, dj);
                let v = level(at.x + di, at.y + dj);
                let z = (p.x - m) * inverse;
                let shape = exp(-0.5 * (z * z));
                let model = a * shape;
                let full = v >= frame.full_scale;
                any = any || (full && p.y > 0.0);
                let silent = full && model + base >= v;
                let residual = v - base - model;
                let quiet = frame.read2 + frame.gain * (model + base);
                let believed = select(p.y, 0.0, silent);
                let certainty = believed / (quiet + frame.speckle2 * (model * model));
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
            }
        }
        let c00 = h11 * h22 - h12 * h12;
        let c01 = h02 * h12 - h01 * h22;
        let c02 = h01 * h12 - h02 * h11;
        let c11 = h00 * h22 - h02 * h02;
        let c12 = h01 * h02 - h00 * h12;
        let c22 = h00 * h11 - h01 * h01;
        let det = h00 * c00 + (h01 * c01 + h02 * c02);
        let da = clamp((c00 * g0 + (c01 * g1 + c02 * g2)) / det, -0.5 * a, a);
        let dm = clamp((c01 * g0 + (c11 * g1 + c12 * g2)) / det, -0.7 * frame.s0, 0.7 * frame.s0);
        let dw = clamp((c02 * g0 + (c12 * g1 + c22 * g2)) / det, -0.3 * frame.s0, 0.3 * frame.s0);
        a = max(a + da, 1.0);
        m = clamp(m + dm, m0 - 2.0 * frame.s0, m0 + 2.0 * frame.s0);
        width = clamp(width + dw, 0.3 * frame.s0, 3.0 * frame.s0);
        i11 = c11 / det;
        let pixels = max(sum_weight, 1e-6);
        chi = sum / pixels;
        spread = sum_square / pixels;
        saturated = any;
        let still = abs(dm) < 2e-3 * frame.s0 && abs(dw) < 5e-3 * frame.s0 && abs(da) < 5e-3 * a;
        left = select(left - 1u, 0u, still);
    }
    let sigma = sqrt(max(i11 * spread * max(chi, 0.05), 0.0));
    return finish(at, n, m, a, base, width, sigma, saturated);
}

fn centroid(at: vec2<i32>) -> Peak {
    let n = direction(at.x, at.y);
    let base = background(at.x, at.y, n);
    let m0 = guess(at, n, base).x;
    let w = window(n);
    var sum = 0.0;
    var moment = 0.0;
    var second = 0.0;
    var noise = 0.0;
    var top = 0.0;
    var saturated = false;
    for (var i = -frame.reach_along; i <= frame.reach_along; i += frame.stride_along) {
        let centre = middle(w, i, m0);
        for (var j = centre - w.reach; j <= centre + w.reach; j++) {
            let di = select(j, i, w.rows);
            let dj = select(i, j, w.rows);
            let p = place(w, n, m0, at, di, dj);
            let v = level(at.x + di, at.y + dj);
            let light = p.y * (v - base);
            let inside = p.y > 0.0;
            sum += light;
            moment += light * p.x;
            second += light * (p.x * p.x);
            top = select(top, max(top, v - base), inside);
            saturated = saturated || (inside && v >= frame.full_scale);
            let e = p.y * (p.x - m0);
            let lit = max(v - base, 0.0);
            noise += (e * e) * (frame.read2 + frame.gain * v + frame.speckle2 * (lit * lit));
        }
    }
    let m = select(m0, clamp(moment / sum, m0 - 2.0 * frame.s0, m0 + 2.0 * frame.s0), sum > 0.0);
    let width = sqrt(max(second / max(sum, 1e-6) - m * m, 0.0));
    return finish(at, n, m, max(top, 1.0), base, width, sqrt(noise) / max(sum, 1e-6), saturated);
}

fn derivative(at: vec2<i32>) -> Peak {
    let n = direction(at.x, at.y);
    let base = background(at.x, at.y, n);
    let m0 = guess(at, n, base).x;
    let c = at + vec2(i32(floor(m0 * n.x + 0.5)), i32(floor(m0 * n.y + 0.5)));
    let sigma = max(frame.s0 / sqrt(3.0), 0.8);
    let r = i32(ceil(3.5 * sigma));
    let inverse = 1.0 / (sigma * sigma);
    var d1 = 0.0;
    var d2 = 0.0;
    var smooth_level = 0.0;
    var noise = 0.0;
    var top = 0.0;
    var saturated = false;
    for (var j = -r; j <= r; j++) {
        for (var i = -r; i <= r; i++) {
            let v = level(c.x + i, c.y + j);
            let d = f32(i) * n.x + f32(j) * n.y;
            let kernel = exp(-0.5 * inverse * f32(i * i + j * j));
            let slope = kernel * d * inverse;
            d1 += slope * (v - base);
            d2 += kernel * (d * d * inverse - 1.0) * inverse * (v - base);
            smooth_level += kernel * (v - base);
            let lit = max(v - base, 0.0);
            noise += (slope * slope) * (frame.read2 + frame.gain * v + frame.speckle2 * (lit * lit));
            top = select(top, max(top, v - base), max(abs(i), abs(j)) <= 1);
            saturated = saturated || v >= frame.full_scale;
        }
    }
    let m = select(0.0, clamp(-d1 / d2, -frame.s0, frame.s0), d2 < 0.0);
    let width = sqrt(max(smooth_level / max(-d2, 1e-6) - sigma * sigma, 0.0));
    return finish(c, n, m, max(top, 1.0), base, width, sqrt(noise) / max(-d2, 1e-6), saturated);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    for (var inside = u32(id.x < header[3]); inside > 0u; inside--) {
        let point = points[id.x];
        let at = vec2(i32(point.x & 0xffffu), i32(point.x >> 16u));
        first = point.y * frame.shot_words;
        var peak: Peak;
        // The method is a constant of the pipeline: the other two are not in its code.
        if peak_method == 0u {
            peak = gaussian(at);
        } else if peak_method == 1u {
            peak = centroid(at);
        } else {
            peak = derivative(at);
        }
        peak.pixel = point.x;
        peak.shot = point.y;
        peaks[id.x] = peak;
    }
}
