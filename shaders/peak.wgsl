// Fits one peak at each skeleton pixel of a batch. A peak that fails a test needing no other peak gets the reason for
// rejection. The strongest of the others on each line across the stripe is stored for the comparison in point.wgsl.
// Units: pixels, grey levels. Twin: src/stages/peak/fit.rs, across/centre.rs, across/direction.rs, windows.rs,
// profile.rs, scoring.rs, methods.rs and stripe/choose.rs, which explains the reasons; docs/math.md, Stripe peak (0) to
// (5).
@group(0) @binding(0) var<uniform> frame: PeakFrame;
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read> header: array<u32>;
@group(0) @binding(3) var<storage, read> pixels: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> peaks: array<Peak>;
@group(0) @binding(5) var<storage, read_write> strongest: array<atomic<u32>>;

// Pixels per word as a power of two: 2 for 8-bit pictures, 1 for deeper ones.
override px_log2: u32 = 2u;
// Method: 0 Gaussian, 1 centroid, 2 derivative, 3 the skeleton pixel itself.
override peak_method: u32 = 0u;

// Distance from the centre within which the light is a narrow stripe's own, px.
const BESIDE = 4;
// The skeleton of a stripe narrower than this runs close enough to its middle, px.
const BROAD = 4.5;
// Limit for the squared difference of two sides of one level, in units of a pixel's variance over the pixels of a side.
const BY_NOISE = 8.0;
// Largest uncertainty from sides of different levels, as a share of the amplitude.
const UNEVEN = 0.06;
// Grey levels that count as no light. Their square must not be denormal, because a CPU is many times slower then.
const DARK = 1e-9;
// Least share of a parameter's information that remains when another parameter explains it.
const LEAST = 1e-5;
// Share of the ceiling over which the weight of clipped pixels falls to 0.
const SOFT = 0.05;

// Index of the picture's first word; set once per invocation.
var<private> first: u32;

// Light on three lines, k pixels across from the pixel.
fn lit_across(at: vec2<i32>, k: i32, beside: i32) -> i32 {
    let along = select(vec2(0, beside), vec2(beside, 0), frame.columns > 0u);
    let p = at + k * select(vec2(1, 0), vec2(0, 1), frame.columns > 0u);
    return (whole(p.x - along.x, p.y - along.y) + whole(p.x, p.y)) + whole(p.x + along.x, p.y + along.y);
}

fn crest(at: vec2<i32>, k: i32, step: i32, beside: i32) -> i32 {
    return (lit_across(at, k - step, beside) + lit_across(at, k, beside)) + lit_across(at, k + step, beside);
}

// The pixel in the middle of a wide stripe, whose skeleton may run beside the middle.
fn centred(at: vec2<i32>) -> vec2<i32> {
    if frame.s0 < BROAD {
        return at;
    }
    let step = max(i32(0.34 * frame.s0), 1);
    let reach = i32(3.0 * frame.s0) / step;
    let beside = i32(1.2 * frame.s0);
    let dark = min(lit_across(at, -reach * step, beside), lit_across(at, reach * step, beside));
    var all = 0;
    var moment = 0;
    for (var k = -reach; k <= reach; k++) {
        let lit = max(lit_across(at, k * step, beside) - dark, 0);
        all += lit;
        moment += k * lit;
    }
    let most = i32(2.0 * frame.s0);
    let off = clamp(floor_div(2 * step * moment + all, max(2 * all, 1)), -most, most);
    if f32(2 * abs(off)) <= frame.s0 || crest(at, off, step, beside) <= crest(at, 0, step, beside) {
        return at;
    }
    let p = at + off * select(vec2(1, 0), vec2(0, 1), frame.columns > 0u);
    return clamp(p, vec2(0), vec2(frame.width - 1, frame.height - 1));
}

// Squared difference between the two sides' levels, minus their noise.
var<private> uneven2: f32;
fn background(x: i32, y: i32, n: vec2<f32>) -> f32 {
    let start = i32(floor(4.0 * frame.s0 + 0.5));
    let end = start + max(i32(floor(2.0 * frame.s0 + 0.5)), 2);
    let along = 1.2 * frame.s0;
    // Not 0.5, so that rounding errors do not decide at slopes such as 1 in 32.
    let tu = i32(floor(along * n.y + 0.47));
    let tv = i32(floor(0.47 - along * n.x));
    var low = 0.0;
    var high = 0.0;
    var count = 0.0;
    for (var q = start; q <= end; q += frame.stride) {
        let du = i32(floor(f32(q) * n.x + 0.47));
        let dv = i32(floor(f32(q) * n.y + 0.47));
        low += (level(x - du, y - dv) + level(x + tu - du, y + tv - dv)) + level(x - tu - du, y - tv - dv);
        high += (level(x + du, y + dv) + level(x + tu + du, y + tv + dv)) + level(x - tu + du, y - tv + dv);
        count += 3.0;
    }
    let darker = min(low, high) / count;
    let apart = (high - low) / count;
    let uneven = max(apart * apart - BY_NOISE * (frame.read2 + frame.gain * darker) / count, 0.0);
    uneven2 = select(0.0, uneven, start >= BESIDE);
    return darker;
}

// Light above the background, for pairs of samples; and the span of samples that take part.
var<private> light: array<vec2<f32>, 20>;
var<private> base: f32;
var<private> near: vec2<f32>;
var<private> sum: vec2<f32>;
var<private> moment: vec2<f32>;
fn guess_pair(j: i32) {
    if j < 2 * quads {
        light[j] = level_pair(j) - base;
        let lit = share(j, near) * max(light[j], vec2(0.0));
        sum += lit;
        moment += lit * pair(j);
    }
}

// First guess of offset and amplitude.
fn guess(profile: Profile) -> vec2<f32> {
    sum = vec2(0.0);
    moment = vec2(0.0);
    near = span(profile, 0.0, 1.5 * frame.s0 + 0.5);
    guess_pair(0); guess_pair(1); guess_pair(2); guess_pair(3); guess_pair(4); guess_pair(5); guess_pair(6);
    guess_pair(7); guess_pair(8); guess_pair(9); guess_pair(10); guess_pair(11); guess_pair(12); guess_pair(13);
    guess_pair(14); guess_pair(15); guess_pair(16); guess_pair(17); guess_pair(18); guess_pair(19);
    let all = sum.x + sum.y;
    let count = near.y - near.x;
    let m = select(0.0, profile.offset + profile.step * ((moment.x + moment.y) / all), all > 0.0);
    return vec2(m, max(1.25 * all / max(count, 1e-6), 1.0));
}

// Place in the picture of a centre that is m px across from the pixel: the middle of the window there. It is on the
// line even if the direction has an error.
fn centre_at(at: vec2<i32>, m: f32) -> vec2<f32> {
    let a = walk.lean * (m / walk.nb);
    let b = (m - a * walk.na) / walk.nb;
    return vec2<f32>(at) + select(vec2(b, a), vec2(a, b), walk.columns);
}

fn finish(centre: vec2<f32>, n: vec2<f32>, amplitude: f32, width: f32, sigma: f32, full: bool) -> Peak {
    var peak: Peak;
    peak.u = centre.x;
    peak.v = centre.y;
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

// Weight of a sample, and the clipped share of that weight.
var<private> with_all: array<vec2<f32>, 20>;
var<private> lost: array<vec2<f32>, 20>;
var<private> weight: f32;
var<private> clipped: vec2<f32>;
fn window_pair(j: i32) {
    if j < 2 * quads {
        let inside = share(j, near);
        lost[j] = clipped_pair(j);
        clipped = max(clipped, select(vec2(0.0), lost[j], inside > vec2(0.0)));
        with_all[j] = inside * weight;
    }
}

// e to the power of x from -80 to 80, with the twin's arithmetic.
fn exponential(x: vec2<f32>) -> vec2<f32> {
    let t = clamp(x * 1.442695, vec2(-120.0), vec2(120.0));
    let whole = floor(t + vec2(0.5));
    let f = t - whole;
    let q = 0.009618129 + f * (0.001333356 + f * 0.0001540353);
    let p = 1.0 + f * (0.6931472 + f * (0.2402265 + f * (0.05550411 + f * q)));
    return p * bitcast<vec2<f32>>(vec2<u32>(vec2<i32>(whole) + vec2(127)) << vec2(23u));
}

// The model at a pair of samples, and the factors that lead to the next pair.
var<private> model: vec2<f32>;
var<private> ratio: vec2<f32>;
var<private> fall: f32;
// One over the model's width.
var<private> narrow: f32;
var<private> z: vec2<f32>;
var<private> dz: vec2<f32>;
// Variance without light, and the terms that light adds to it; the model's light at full scale.
var<private> quiet: f32;
var<private> gain: f32;
var<private> speckle2: f32;
var<private> ceiling: f32;
var<private> soft: f32;
// Sums over certainty times model squared times z^0, z^1, .. z^4; certainty times residual times model times z^0, z^1,
// z^2; the squared residuals; the weights that counted.
var<private> e0: vec2<f32>;
var<private> e1: vec2<f32>;
var<private> e2: vec2<f32>;
var<private> e3: vec2<f32>;
var<private> e4: vec2<f32>;
var<private> r0: vec2<f32>;
var<private> r1: vec2<f32>;
var<private> r2: vec2<f32>;
var<private> squares: vec2<f32>;
var<private> believed: vec2<f32>;
fn fit_pair(j: i32) {
    if j < 2 * quads {
        // A clipped pixel counts while the model is below it, and has no weight above.
        let above = clamp(soft * (model - vec2(ceiling)) + vec2(0.5), vec2(0.0), vec2(1.0));
        let silent = above * lost[j];
        let heard = max(vec2(1.0) - silent, vec2(1e-3));
        // The model of a sample that lies off its step or is wider, to second order.
        let stray = stray_pair(j);
        let there = model * ((vec2(1.0) - z * (stray * narrow)) + (z * z - vec2(1.0)) * (spread_pair(j, stray)
            * (0.5 * (narrow * narrow))));
        let residual = (light[j] - there) + silent * (model - vec2(ceiling));
        let inverse = with_all[j] / (heard * (quiet + model * (gain + speckle2 * model)));
        let certainty = (heard * heard) * inverse;
        let pull = (heard * inverse) * residual;
        let p0 = pull * model;
        let p1 = p0 * z;
        let h0 = certainty * (model * model);
        let h1 = h0 * z;
        let h2 = h1 * z;
        let h3 = h2 * z;
        e0 += h0;
        e1 += h1;
        e2 += h2;
        e3 += h3;
        e4 += h3 * z;
        r0 += p0;
        r1 += p1;
        r2 += p1 * z;
        squares += (inverse * residual) * residual;
        believed += with_all[j] * heard;
        model = max(model * ratio, vec2(DARK));
        ratio *= fall;
        z += dz;
    }
}

fn gaussian(at: vec2<i32>) -> Peak {
    let n = direction(at.x, at.y);
    base = background(at.x, at.y, n);
    let profile = profile_of(at, n);
    let begin = guess(profile);
    let m0 = begin.x;
    let s0 = sqrt(frame.s0 * frame.s0 + profile.blur2);
    var a = begin.y;
    var m = m0;
    var width = s0;
    let prior = 4.0 / (s0 * s0);
    var i11 = 0.0;
    near = span(profile, m0, 3.0 * s0);
    weight = profile.weight;
    clipped = vec2(0.0);
    window_pair(0); window_pair(1); window_pair(2); window_pair(3); window_pair(4); window_pair(5); window_pair(6);
    window_pair(7); window_pair(8); window_pair(9); window_pair(10); window_pair(11); window_pair(12); window_pair(13);
    window_pair(14); window_pair(15); window_pair(16); window_pair(17); window_pair(18); window_pair(19);
    let doubt = UNEVEN * a;
    quiet = (frame.read2 + frame.gain * base) + min(uneven2, doubt * doubt);
    gain = frame.gain;
    speckle2 = frame.speckle2;
    ceiling = frame.full_scale - base;
    soft = 1.0 / max(SOFT * ceiling, 1.0);
    var drop = 0.0;
    var left = frame.steps;
    while left > 0u {
        let inverse = 1.0 / width;
        narrow = inverse;
        let wide = profile.step * inverse;
        let z0 = (profile.offset - m) * inverse;
        z = vec2(z0, z0 - wide);
        dz = vec2(wide, -wide);
        // A Gaussian at equal steps: its ratio from sample to sample falls by a constant factor. The steps run from the
        // middle to both sides, because a model value that has become 0 stays 0.
        model = a * exponential(-0.5 * (z * z));
        ratio = exponential(-0.5 * (dz * dz) - dz * z);
        fall = exponential(vec2(-(wide * wide))).x;
        e0 = vec2(0.0);
        e1 = vec2(0.0);
        e2 = vec2(0.0);
        e3 = vec2(0.0);
        e4 = vec2(0.0);
        r0 = vec2(0.0);
        r1 = vec2(0.0);
        r2 = vec2(0.0);
        squares = vec2(0.0);
        believed = vec2(0.0);
        fit_pair(0); fit_pair(1); fit_pair(2); fit_pair(3); fit_pair(4); fit_pair(5); fit_pair(6); fit_pair(7);
        fit_pair(8); fit_pair(9); fit_pair(10); fit_pair(11); fit_pair(12); fit_pair(13); fit_pair(14); fit_pair(15);
        fit_pair(16); fit_pair(17); fit_pair(18); fit_pair(19);
        let h00 = (e0.x + e0.y) + 1e-9;
        let h01 = e1.x + e1.y;
        let h02 = e2.x + e2.y;
        let h11 = h02 + 1e-9;
        let h12 = e3.x + e3.y;
        let h22 = (e4.x + e4.y) + prior * (width * width);
        let g0 = r0.x + r0.y;
        let g1 = r1.x + r1.y;
        let g2 = (r2.x + r2.y) + (prior * width) * (s0 - width);
        let l01 = h01 / h00;
        let l02 = h02 / h00;
        let d2 = max(h22 - l02 * h02, LEAST * h22);
        let s12 = h12 - l02 * h01;
        let l12 = s12 / d2;
        let d1 = max(h11 - (l01 * h01 + l12 * s12), LEAST * h11);
        let y2 = g2 - l02 * g0;
        let x1 = (g1 - (l01 * g0 + l12 * y2)) / d1;
        let x2 = y2 / d2 - l12 * x1;
        let x0 = g0 / h00 - (l02 * x2 + l01 * x1);
        let da = clamp(a * x0, -0.5 * a, a);
        let dm = clamp(width * x1, -0.7 * s0, 0.7 * s0);
        let dw = clamp(width * x2, -0.3 * s0, 0.3 * s0);
        i11 = (width * width) / d1;
        // Subtract the decrease of the squares by this step: the squares after the last step are needed.
        drop = (g0 * (da / a) + g1 * (dm / width)) + g2 * (dw / width);
        a = max(a + da, 1.0);
        m = clamp(m + dm, m0 - 2.0 * s0, m0 + 2.0 * s0);
        width = clamp(width + dw, 0.3 * s0, 3.0 * s0);
        let still = abs(dm) < 5e-3 * s0 && abs(dw) < 1e-2 * s0 && abs(da) < 1e-2 * a;
        left = select(left - 1u, 0u, still);
    }
    let share = profile.square / profile.weight;
    let free = max((believed.x + believed.y) / profile.weight - 3.0, 1.0);
    let chi2 = max(squares.x + squares.y - drop, 0.0) / share;
    let noise = max(chi2 / free, (frame.belief + chi2) / (frame.belief + free));
    let sigma = sqrt(max(i11 * share * noise, 0.0));
    let own_width = sqrt(max(width * width - profile.blur2, 0.01 * frame.s0 * frame.s0));
    return finish(centre_at(at, m), n, a, own_width, sigma, clipped.x + clipped.y > 0.0);
}

var<private> second: vec2<f32>;
var<private> noise2: vec2<f32>;
var<private> top: vec2<f32>;
fn centroid_pair(j: i32) {
    if j < 2 * quads {
        let inside = share(j, near);
        let here = inside * light[j];
        let k = pair(j);
        sum += here;
        moment += here * k;
        second += here * (k * k);
        top = max(top, here);
        clipped = max(clipped, select(vec2(0.0), clipped_pair(j), inside > vec2(0.0)));
        let e = inside * (k - vec2(z.x));
        let lit = max(here, vec2(0.0));
        noise2 += (e * e) * (quiet + frame.gain * here + frame.speckle2 * (lit * lit));
    }
}

fn centroid(at: vec2<i32>) -> Peak {
    let n = direction(at.x, at.y);
    base = background(at.x, at.y, n);
    let profile = profile_of(at, n);
    let m0 = guess(profile).x;
    near = span(profile, m0, 3.0 * frame.s0);
    quiet = frame.read2 + frame.gain * base;
    // Unit: samples.
    z = vec2((m0 - profile.offset) / profile.step);
    sum = vec2(0.0);
    moment = vec2(0.0);
    second = vec2(0.0);
    noise2 = vec2(0.0);
    top = vec2(0.0);
    clipped = vec2(0.0);
    centroid_pair(0); centroid_pair(1); centroid_pair(2); centroid_pair(3); centroid_pair(4); centroid_pair(5);
    centroid_pair(6); centroid_pair(7); centroid_pair(8); centroid_pair(9); centroid_pair(10); centroid_pair(11);
    centroid_pair(12); centroid_pair(13); centroid_pair(14); centroid_pair(15); centroid_pair(16); centroid_pair(17);
    centroid_pair(18); centroid_pair(19);
    let all = sum.x + sum.y;
    let middle = (moment.x + moment.y) / all;
    let m = select(m0, clamp(profile.offset + profile.step * middle, m0 - 2.0 * frame.s0, m0 + 2.0 * frame.s0),
        all > 0.0);
    let spread = (second.x + second.y) / max(all, 1e-6) - middle * middle;
    let width = sqrt(max((profile.step * profile.step) * spread - profile.blur2, 0.0));
    let share = profile.square / (profile.weight * profile.weight);
    let sigma = abs(profile.step) * sqrt((noise2.x + noise2.y) * share) / max(all, 1e-6);
    return finish(centre_at(at, m), n, max(max(top.x, top.y), 1.0), width, sigma, clipped.x + clipped.y > 0.0);
}

fn derivative(at: vec2<i32>) -> Peak {
    let n = direction(at.x, at.y);
    base = background(at.x, at.y, n);
    let m0 = guess(profile_of(at, n)).x;
    let c = at + vec2(i32(floor(m0 * n.x + 0.5)), i32(floor(m0 * n.y + 0.5)));
    let sigma = max(frame.s0 / sqrt(3.0), 0.8);
    let r = i32(ceil(3.5 * sigma));
    let inverse = 1.0 / (sigma * sigma);
    var d1 = 0.0;
    var d2 = 0.0;
    var smooth_level = 0.0;
    var noise = 0.0;
    var bright = 0.0;
    var saturated = false;
    for (var j = -r; j <= r; j++) {
        for (var i = -r; i <= r; i++) {
            let v = level(c.x + i, c.y + j);
            let d = f32(i) * n.x + f32(j) * n.y;
            let kernel = exponential(vec2(-0.5 * inverse * f32(i * i + j * j))).x;
            let slope = kernel * d * inverse;
            d1 += slope * (v - base);
            d2 += kernel * (d * d * inverse - 1.0) * inverse * (v - base);
            smooth_level += kernel * (v - base);
            let lit = max(v - base, 0.0);
            noise += (slope * slope) * (frame.read2 + frame.gain * v + frame.speckle2 * (lit * lit));
            bright = select(bright, max(bright, v - base), max(abs(i), abs(j)) <= 1);
            saturated = saturated || v >= frame.full_scale;
        }
    }
    let m = select(0.0, clamp(-d1 / d2, -frame.s0, frame.s0), d2 < 0.0);
    let width = sqrt(max(smooth_level / max(-d2, 1e-6) - sigma * sigma, 0.0));
    return finish(vec2<f32>(c) + m * n, n, max(bright, 1.0), width, sqrt(noise) / max(-d2, 1e-6), saturated);
}

// Standard deviation of a centre that may lie anywhere in its pixel, px.
const EVEN = 0.28867513;

fn itself(at: vec2<i32>) -> Peak {
    let n = select(1.0, -1.0, frame.across_v < 0.0) * vec2(frame.across_u, frame.across_v);
    base = background(at.x, at.y, n);
    let here = level(at.x, at.y);
    return finish(vec2<f32>(at), n, max(here - base, 1.0), frame.s0, EVEN, here >= frame.full_scale);
}

// The first test that fails determines the reason.
fn alone(k: Peak) -> u32 {
    let across = k.normal_u * frame.across_u + k.normal_v * frame.across_v;
    var why = 0u;
    why = select(why, STEEP, abs(across) < frame.upright);
    why = select(why, UNCERTAIN, !(k.sigma_px <= frame.uncertain));
    why = select(why, WIDE, k.width_px > frame.widest);
    why = select(why, NARROW, k.width_px < frame.narrowest);
    return select(why, FAINT, k.amplitude < frame.faintest);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < header[COUNT] {
        let point = pixels[id.x];
        let at = vec2(i32(point.x & 0xffffu), i32(point.x >> 16u));
        first = point.y * frame.shot_words;
        var peak: Peak;
        // The method is a constant of the pipeline, so the compiled code has only one method.
        if peak_method == 0u {
            peak = gaussian(centred(at));
        } else if peak_method == 1u {
            peak = centroid(centred(at));
        } else if peak_method == 2u {
            peak = derivative(centred(at));
        } else {
            peak = itself(at);
        }
        peak.pixel = point.x;
        peak.shot = point.y;
        let why = alone(peak);
        peak.flags |= why;
        peaks[id.x] = peak;
        if why == 0u {
            atomicMax(&strongest[point.y * frame.lines + line_of(point.x)], bitcast<u32>(peak.amplitude));
        }
    }
}
