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
    return f32(i32((image[first + b * frame.pitch + (a >> px_log2)] >> (place * bits)) & ((1u << bits) - 1u)));
}

// Weights (1 - r^2 / 16)^2 of gradients one step away along both axes; two along one; two along both.
const ONE = 0.765625;
const TWO = 0.5625;
const FAR = 0.25;

// The structure tensor from 13 gradients on 24 grey levels, every other place of a lattice.
fn direction(x: i32, y: i32) -> vec2<f32> {
    let u = frame.lattice_u;
    let v = frame.lattice_v;
    let a = vec3(level(x - 2 * u, y - 3 * v), level(x, y - 3 * v), level(x + 2 * u, y - 3 * v));
    let b = vec4(level(x - 3 * u, y - 2 * v), level(x - u, y - 2 * v), level(x + u, y - 2 * v), level(x + 3 * u, y - 2 * v));
    let c = vec3(level(x - 2 * u, y - v), level(x, y - v), level(x + 2 * u, y - v));
    let d = vec4(level(x - 3 * u, y), level(x - u, y), level(x + u, y), level(x + 3 * u, y));
    let e = vec3(level(x - 2 * u, y + v), level(x, y + v), level(x + 2 * u, y + v));
    let f = vec4(level(x - 3 * u, y + 2 * v), level(x - u, y + 2 * v), level(x + u, y + 2 * v), level(x + 3 * u, y + 2 * v));
    let g = vec3(level(x - 2 * u, y + 3 * v), level(x, y + 3 * v), level(x + 2 * u, y + 3 * v));
    // In the rows two above, of the pixel, two below; then the diagonals.
    let ratio = f32(v) / f32(u);
    let ax = ratio * (b.yzw - b.xyz);
    let ay = c - a;
    let rx = ratio * (d.yzw - d.xyz);
    let ry = e - c;
    let bx = ratio * (f.yzw - f.xyz);
    let by = g - e;
    let dx = ratio * vec4(c.yz - c.xy, e.yz - e.xy);
    let dy = vec4(d.yz - b.yz, f.yz - d.yz);
    let far = vec3(FAR, TWO, FAR);
    let row = vec3(TWO, 1.0, TWO);
    let xx = (dot(far, ax * ax) + dot(far, bx * bx)) + (dot(row, rx * rx) + ONE * dot(dx, dx));
    let xy = (dot(far, ax * ay) + dot(far, bx * by)) + (dot(row, rx * ry) + ONE * dot(dx, dy));
    let yy = (dot(far, ay * ay) + dot(far, by * by)) + (dot(row, ry * ry) + ONE * dot(dy, dy));
    let h = 0.5 * (xx - yy);
    let q = sqrt(h * h + xy * xy);
    let n = select(vec2(xy, q - h), vec2(h + q, xy), h > 0.0);
    let length = sqrt(n.x * n.x + n.y * n.y);
    let sign = select(1.0, -1.0, n.y < 0.0);
    return select(vec2(sign * n.x / length, sign * n.y / length), vec2(0.0, 1.0), length < 1e-9);
}

fn background(x: i32, y: i32, n: vec2<f32>) -> f32 {
    let start = i32(floor(4.0 * frame.s0 + 0.5));
    let end = start + max(i32(floor(2.0 * frame.s0 + 0.5)), 2);
    var low = 0.0;
    var high = 0.0;
    var count = 0.0;
    for (var q = start; q <= end; q += frame.stride) {
        let du = i32(floor(f32(q) * n.x + 0.5));
        let dv = i32(floor(f32(q) * n.y + 0.5));
        low += level(x - du, y - dv);
        high += level(x + du, y + dv);
        count += 1.0;
    }
    return min(low, high) / count;
}

// First guess of offset and amplitude.
fn guess(profile: Profile, base: f32) -> vec2<f32> {
    var sum = 0.0;
    var moment = 0.0;
    var square = 0.0;
    let some = within(profile, 0.0, 1.5 * frame.s0 + 0.5);
    for (var k = some.x; k < some.y; k++) {
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
    var believed_samples = 0.0;
    var saturated = false;
    let some = within(profile, m0, 3.0 * s0);
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
        // Four samples a turn share what a turn costs; those beyond the end are not believed.
        for (var k = some.x; k < some.y; k += 4) {
            let place = vec4(k) + vec4(0, 1, 2, 3);
            let d = profile.offset + vec4<f32>(place) * profile.step;
            let grey = four_levels(profile, k);
            let clear = four_clear(profile, k);
            let z = (d - m) * inverse;
            let shape = exp(-0.5 * (z * z));
            let model = a * shape;
            let inside = (abs(d - m0) <= vec4(3.0 * s0)) & (place < vec4(some.y));
            any_full = any_full || any((clear < vec4(1.0)) & inside);
            // Clipped pixels pull while the model is below them, and are silent above.
            let above = model + base >= vec4(frame.full_scale);
            let unclipped = (grey - frame.full_scale * (1.0 - clear)) / max(clear, vec4(1e-3));
            let residual = select(grey, unclipped, above) - base - model;
            let quiet = frame.read2 + frame.gain * (model + base);
            let believed = select(vec4(0.0), select(vec4(1.0), clear, above), inside);
            let certainty = (believed * profile.weight) / (quiet + frame.speckle2 * (model * model));
            let jm = model * (z * inverse);
            let jw = jm * z;
            let by_shape = certainty * shape;
            let by_m = certainty * jm;
            let by_w = certainty * jw;
            h00 += dot(by_shape, shape);
            h01 += dot(by_shape, jm);
            h02 += dot(by_shape, jw);
            h11 += dot(by_m, jm);
            h12 += dot(by_m, jw);
            h22 += dot(by_w, jw);
            g0 += dot(by_shape, residual);
            g1 += dot(by_m, residual);
            g2 += dot(by_w, residual);
            sum += dot(certainty * residual, residual);
            number += dot(believed, vec4(1.0));
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
        believed_samples = number;
        saturated = any_full;
        let still = abs(dm) < 1e-2 * s0 && abs(dw) < 3e-2 * s0 && abs(da) < 3e-2 * a;
        left = select(left - 1u, 0u, still);
    }
    let share = profile.square / profile.weight;
    let free = max(believed_samples - 3.0, 1.0);
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
        saturated = saturated || (four_clear(profile, k).x < 1.0 && inside);
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
    if id.x < header[3] {
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
