// In: the pictures of a batch and their skeleton pixels. Out: one peak a pixel. Twin: src/stages/peak/fit.rs,
// profile.rs and methods.rs, where the reasons stand; docs/math.md, Stripe peak (1) to (5). Frame and unit: pixels, grey levels.
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
// Samples for which the noise model counts.
const BELIEF = 10.0;

// First word of the picture; set once.
var<private> first: u32;

fn level(x: i32, y: i32) -> f32 {
    let a = u32(clamp(x, 0, frame.width - 1));
    let b = u32(clamp(y, 0, frame.height - 1));
    let bits = 32u >> px_log2;
    let place = a & ((1u << px_log2) - 1u);
    return f32((image[first + b * frame.pitch + (a >> px_log2)] >> (place * bits)) & ((1u << bits) - 1u));
}

// Grey levels around the pixel, `lattice` px apart, 4 to each side.
const LATTICE = 9;
var<private> lattice: array<f32, 81>;

fn direction(x: i32, y: i32) -> vec2<f32> {
    for (var j = 0; j < LATTICE; j++) {
        for (var i = 0; i < LATTICE; i++) {
            lattice[LATTICE * j + i] = level(x + (i - 4) * frame.lattice, y + (j - 4) * frame.lattice);
        }
    }
    var xx = 0.0;
    var xy = 0.0;
    var yy = 0.0;
    for (var j = 1; j < LATTICE - 1; j++) {
        for (var i = 1; i < LATTICE - 1; i++) {
            let at = LATTICE * j + i;
            let fade = max(1.0 - f32((i - 4) * (i - 4) + (j - 4) * (j - 4)) / 16.0, 0.0);
            let weight = fade * fade;
            let gx = lattice[at + 1] - lattice[at - 1];
            let gy = lattice[at + LATTICE] - lattice[at - LATTICE];
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

// The stripe's profile: src/stages/peak/profile.rs. Mean grey levels, and the share of the weight that is not clipped.
const SAMPLES = 96;
var<private> levels: array<f32, SAMPLES>;
var<private> clear: array<f32, SAMPLES>;
struct Profile {
    count: i32,
    offset: f32,
    step: f32,
    weight: f32,
    square: f32,
    blur2: f32,
}

// Columns where the stripe is nearer to the horizontal, else rows; at 45 degrees rounding shall not decide.
fn by_columns(n: vec2<f32>) -> bool {
    return 1.001 * n.y >= abs(n.x);
}

fn floor_div(a: i32, b: i32) -> i32 {
    return (a - select(0, b - 1, a < 0)) / b;
}

// Weights along the stripe of the places i beside the skeleton pixel x0; 0 outside the window or the picture.
fn weights(i: vec4<i32>, x0: i32, size: i32, fade: f32) -> vec4<f32> {
    let f = max(vec4(1.0) - fade * vec4<f32>(i * i), vec4(0.0));
    let inside = abs(i) <= vec4(frame.reach_along) & i + vec4(x0) >= vec4(0) & i + vec4(x0) < vec4(size);
    return select(vec4(0.0), f * f, inside);
}

// Four pixels of a row as they lie in memory, from column a, a multiple of four.
fn four(a: i32, y: i32) -> vec4<f32> {
    let row = first + u32(y) * frame.pitch;
    let last = i32(frame.pitch) - 1;
    if px_log2 == 2u {
        let v = image[row + u32(clamp(a >> 2u, 0, last))];
        return vec4<f32>(vec4(v, v >> 8u, v >> 16u, v >> 24u) & vec4(255u));
    }
    let low = image[row + u32(clamp(a >> 1u, 0, last))];
    let high = image[row + u32(clamp((a >> 1u) + 1, 0, last))];
    return vec4<f32>(vec4(low, low >> 16u, high, high >> 16u) & vec4(0xffffu));
}

// Whole pixels by which a group of columns (or a row) follows the line.
fn shift(from_x0: i32, middle: f32, na: f32, nb: f32) -> i32 {
    return i32(floor(-((f32(from_x0) + middle) * na) / nb + 0.47));
}

fn profile_of(at: vec2<i32>, n: vec2<f32>) -> Profile {
    let columns = by_columns(n);
    let na = select(n.y, n.x, columns);
    let nb = select(n.x, n.y, columns);
    let x0 = select(at.y, at.x, columns);
    let y0 = select(at.x, at.y, columns);
    let width = select(frame.height, frame.width, columns);
    let height = select(frame.width, frame.height, columns);
    // A wide stripe's columns go in groups of four, as they lie in memory; all else goes one by one.
    let fours = columns && frame.reach_along >= 4;
    let mask = select(-1, -4, fours);
    let size = select(1, 4, fours);
    let middle = select(0.0, 1.5, fours);
    let begin = (x0 - frame.reach_along) & mask;
    let end = x0 + frame.reach_along;
    let fade = frame.along_factor / (nb * nb);
    // Of a single one, the first of four places counts.
    let only = select(vec4(1.0, 0.0, 0.0, 0.0), vec4(1.0), fours);
    var sum = vec4(0.0);
    var square = vec4(0.0);
    var moment = vec4(0.0);
    var second = vec4(0.0);
    for (var a = begin; a <= end; a += size) {
        let i = vec4(a - x0) + vec4(0, 1, 2, 3);
        let g = only * weights(i, x0, width, fade);
        let e = vec4(f32(shift(a - x0, middle, na, nb)) * nb) + vec4<f32>(i) * na;
        sum += g;
        square += g * g;
        moment += g * e;
        second += g * (e * e);
    }
    let ones = vec4(1.0);
    let total = dot(sum, ones);
    let mean = dot(moment, ones) / total;
    let first_shift = shift(begin - x0, middle, na, nb);
    let last_shift = shift((end & mask) - x0, middle, na, nb);
    let low = min(first_shift, last_shift);
    let high = max(first_shift, last_shift);
    let stride = frame.stride_across;
    let half = i32(ceil((4.0 * frame.s0) / (abs(nb) * f32(stride))));
    let start = max(-half, -floor_div(y0 + low, stride));
    let stop = min(half, floor_div(height - 1 - high - y0, stride));
    let count = clamp(stop - start + 1, 0, SAMPLES);
    for (var k = 0; k < count; k++) {
        let row = y0 + (start + k) * stride;
        var light = 0.0;
        var clipped = 0.0;
        for (var a = begin; a <= select(begin - 1, end, fours); a += 4) {
            let g = weights(vec4(a - x0) + vec4(0, 1, 2, 3), x0, width, fade);
            let v = four(a, row + shift(a - x0, middle, na, nb));
            light += (g.x * v.x + g.y * v.y) + (g.z * v.z + g.w * v.w);
            let c = select(vec4(0.0), g, v >= vec4(frame.full_scale));
            clipped += (c.x + c.y) + (c.z + c.w);
        }
        for (var a = begin; a <= select(end, begin - 1, fours); a++) {
            let g = weights(vec4(a - x0), x0, width, fade).x;
            let b = row + shift(a - x0, middle, na, nb);
            let v = level(select(b, a, columns), select(a, b, columns));
            light += g * v;
            clipped += select(0.0, g, v >= frame.full_scale);
        }
        levels[k] = light / total;
        clear[k] = 1.0 - clipped / total;
    }
    let step = f32(stride) * nb;
    return Profile(count, mean + f32(start) * step, step, total, dot(square, ones),
        max(dot(second, ones) / total - mean * mean, 0.0));
}

// Offset, grey level and unclipped share of a sample.
fn sample(p: Profile, k: i32) -> vec3<f32> {
    return vec3(p.offset + f32(k) * p.step, levels[k], clear[k]);
}

// First guess of offset and amplitude.
fn guess(profile: Profile, base: f32) -> vec2<f32> {
    var sum = 0.0;
    var moment = 0.0;
    var square = 0.0;
    for (var k = 0; k < profile.count; k++) {
        let p = sample(profile, k);
        let near = select(0.0, 1.0, abs(p.x) <= 1.5 * frame.s0 + 0.5);
        let light = near * max(p.y - base, 0.0);
        sum += light;
        moment += light * p.x;
        square += near;
    }
    let m = select(0.0, moment / sum, sum > 0.0);
    return vec2(m, max(1.25 * sum / max(square, 1e-6), 1.0));
}

fn finish(at: vec2<i32>, n: vec2<f32>, m: f32, amplitude: f32, base: f32, width: f32, sigma: f32, full: bool) -> Peak {
    var peak: Peak;
    // Along the image axis that the profile was taken on: on the line, however the direction errs.
    let columns = by_columns(n);
    peak.u = f32(at.x) + select(m / n.x, 0.0, columns);
    peak.v = f32(at.y) + select(0.0, m / n.y, columns);
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
    let profile = profile_of(at, n);
    let begin = guess(profile, base);
    let m0 = begin.x;
    let s0 = sqrt(frame.s0 * frame.s0 + profile.blur2);
    var a = begin.y;
    var m = m0;
    var width = s0;
    let prior = 4.0 / (s0 * s0);
    var i11 = 0.0;
    var chi = 0.0;
    var samples = 0.0;
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
        var g2 = prior * (s0 - width);
        var sum = 0.0;
        var number = 0.0;
        var any_full = false;
        let inverse = 1.0 / width;
        for (var k = 0; k < profile.count; k++) {
            let p = sample(profile, k);
            let z = (p.x - m) * inverse;
            let shape = exp(-0.5 * (z * z));
            let model = a * shape;
            let inside = abs(p.x - m0) <= 3.0 * s0;
            any_full = any_full || (p.z < 1.0 && inside);
            // Clipped pixels pull while the model is below them, and are silent above.
            let above = model + base >= frame.full_scale;
            let unclipped = (p.y - frame.full_scale * (1.0 - p.z)) / max(p.z, 1e-3);
            let residual = select(p.y, unclipped, above) - base - model;
            let quiet = frame.read2 + frame.gain * (model + base);
            let believed = select(0.0, select(1.0, p.z, above), inside);
            let certainty = (believed * profile.weight) / (quiet + frame.speckle2 * (model * model));
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
            number += believed;
        }
        let c00 = h11 * h22 - h12 * h12;
        let c01 = h02 * h12 - h01 * h22;
        let c02 = h01 * h12 - h02 * h11;
        let c11 = h00 * h22 - h02 * h02;
        let c12 = h01 * h02 - h00 * h12;
        let c22 = h00 * h11 - h01 * h01;
        let det = h00 * c00 + (h01 * c01 + h02 * c02);
        let da = clamp((c00 * g0 + (c01 * g1 + c02 * g2)) / det, -0.5 * a, a);
        let dm = clamp((c01 * g0 + (c11 * g1 + c12 * g2)) / det, -0.7 * s0, 0.7 * s0);
        let dw = clamp((c02 * g0 + (c12 * g1 + c22 * g2)) / det, -0.3 * s0, 0.3 * s0);
        a = max(a + da, 1.0);
        m = clamp(m + dm, m0 - 2.0 * s0, m0 + 2.0 * s0);
        width = clamp(width + dw, 0.3 * s0, 3.0 * s0);
        i11 = c11 / det;
        chi = sum;
        samples = number;
        saturated = any_full;
        let still = abs(dm) < 2e-3 * s0 && abs(dw) < 5e-3 * s0 && abs(da) < 5e-3 * a;
        left = select(left - 1u, 0u, still);
    }
    let share = profile.square / profile.weight;
    let free = max(samples - 3.0, 1.0);
    let squares = chi / share;
    let noise = max(squares / free, (BELIEF + squares) / (BELIEF + free));
    let sigma = sqrt(max(i11 * share * noise, 0.0));
    let own_width = sqrt(max(width * width - profile.blur2, 0.01 * frame.s0 * frame.s0));
    return finish(at, n, m, a, base, own_width, sigma, saturated);
}

fn centroid(at: vec2<i32>) -> Peak {
    let n = direction(at.x, at.y);
    let base = background(at.x, at.y, n);
    let profile = profile_of(at, n);
    let m0 = guess(profile, base).x;
    var sum = 0.0;
    var moment = 0.0;
    var second = 0.0;
    var noise = 0.0;
    var top = 0.0;
    var saturated = false;
    for (var k = 0; k < profile.count; k++) {
        let p = sample(profile, k);
        let inside = abs(p.x - m0) <= 3.0 * frame.s0;
        let light = select(0.0, p.y - base, inside);
        sum += light;
        moment += light * p.x;
        second += light * (p.x * p.x);
        top = max(top, light);
        saturated = saturated || (p.z < 1.0 && inside);
        let e = select(0.0, p.x - m0, inside);
        let lit = max(p.y - base, 0.0);
        noise += (e * e) * (frame.read2 + frame.gain * p.y + frame.speckle2 * (lit * lit));
    }
    let m = select(m0, clamp(moment / sum, m0 - 2.0 * frame.s0, m0 + 2.0 * frame.s0), sum > 0.0);
    let width = sqrt(max(second / max(sum, 1e-6) - m * m - profile.blur2, 0.0));
    let share = profile.square / (profile.weight * profile.weight);
    return finish(at, n, m, max(top, 1.0), base, width, sqrt(noise * share) / max(sum, 1e-6), saturated);
}

fn derivative(at: vec2<i32>) -> Peak {
    let n = direction(at.x, at.y);
    let base = background(at.x, at.y, n);
    let m0 = guess(profile_of(at, n), base).x;
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
