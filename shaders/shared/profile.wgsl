// In: a picture, a skeleton pixel, the direction across the stripe. Out: the stripe's profile there, averaged along it.
// Twin and reasons: src/stages/peak/profile.rs; docs/math.md, Stripe peak (2). Frame and unit: offsets from the skeleton
// pixel, px; grey levels.

// Sums of grey levels; behind them those of the clipped pixels' weights, which are there only if a pixel is clipped.
const SAMPLES = 96;
// Three more at the end: samples are read in fours.
var<private> samples: array<f32, 195>;
struct Profile {
    count: i32,
    offset: f32,
    step: f32,
    // Grey level of a unit of `samples`.
    scale: f32,
    weight: f32,
    square: f32,
    blur2: f32,
    clipped: bool,
}

// Columns where the stripe is nearer to the horizontal, else rows; at 45 degrees rounding shall not decide.
fn by_columns(n: vec2<f32>) -> bool {
    return 1.001 * n.y >= abs(n.x);
}

fn floor_div(a: i32, b: i32) -> i32 {
    return (a - select(0, b - 1, a < 0)) / b;
}

// How the pixels along the stripe are added up.
struct Walk {
    columns: bool,
    // Four columns at a time, as they lie in memory.
    fours: bool,
    na: f32,
    nb: f32,
    x0: i32,
    y0: i32,
    width: i32,
    begin: i32,
    end: i32,
    // Between the places of two samples.
    across: vec2<i32>,
}

// Pixels side by side with one shift: the first one's place at the first sample, and their weights in 127ths.
struct Group {
    at: vec2<i32>,
    weights: vec4<i32>,
}

fn group(w: Walk, a: i32, sample: i32) -> Group {
    // A place beyond the end has no weight and reads what the last one reads.
    let last = select(w.end, w.end & -4, w.fours);
    let place = min(a, last);
    let i = vec4(a - w.x0) + vec4(0, 1, 2, 3);
    let f = max(vec4(1.0) - frame.along_factor / (w.nb * w.nb) * vec4<f32>(i * i), vec4(0.0));
    let inside = abs(i) <= vec4(frame.reach_along) & i + vec4(w.x0) <= vec4(min(w.end, w.width - 1));
    let of_four = vec4<i32>(vec4(127.0) * (f * f) + vec4(0.5));
    let weights = select(vec4(0), select(vec4(of_four.x, 0, 0, 0), of_four, w.fours), inside);
    let b = w.y0 + shift(w, place);
    return Group(select(vec2(b, place), vec2(place, b), w.columns) + sample * w.across, weights);
}

// Sums over a group of weight, weight squared, weight times offset across and times its square.
fn moments(w: Walk, a: i32, g: Group) -> vec4<f32> {
    let c = f32(shift(w, a)) * w.nb + f32(a - w.x0) * w.na;
    let e = vec4(c) + vec4(0.0, 1.0, 2.0, 3.0) * w.na;
    let f = vec4<f32>(g.weights);
    let m = f * e;
    let ones = vec4(1.0);
    return vec4(dot(f, ones), dot(f, f), dot(m, ones), dot(m, e));
}

// Whole pixels by which a group follows the line. Not + 0.5: at 45 degrees rounding would decide.
fn shift(w: Walk, a: i32) -> i32 {
    return i32(floor(-((f32(a - w.x0) + select(0.0, 1.5, w.fours)) * w.na) / w.nb + 0.47));
}

// The weighted sum of a group's pixels, and whether any is clipped; or the weights of the clipped ones.
fn sum_of(g: Group, k: i32, w: Walk, clipped_only: bool) -> vec2<u32> {
    let p = g.at + k * w.across;
    let x = u32(p.x);
    let at = first + u32(p.y) * frame.pitch + (x >> px_log2);
    let weights = vec4<u32>(g.weights);
    if px_log2 == 2u {
        let read = image[at];
        // The lowest bit of every byte that is 255.
        let full = (((read & 0x7f7f7f7fu) + 0x01010101u) & read & 0x80808080u) >> 7u;
        let v = select(read, full, clipped_only);
        // Two products in one multiplication: 255 times 127 fits 15 bits, and the sum of two 16.
        let even = ((v & 0x00ff00ffu) * (weights.z | (weights.x << 16u))) >> 16u;
        let odd = (((v >> 8u) & 0x00ff00ffu) * (weights.w | (weights.y << 16u))) >> 16u;
        let one = ((v >> (8u * (x & 3u))) & 255u) * weights.x;
        return vec2(select(one, even + odd, w.fours), full);
    }
    var read = vec2(image[at], 0u);
    for (var second = u32(w.fours); second > 0u; second--) {
        read.y = image[at + 1u];
    }
    let low = read & vec2(0xffffu);
    let high = read >> vec2(16u);
    let limit = vec2(u32(frame.full_scale));
    let full_low = vec2<u32>(low >= limit);
    let full_high = vec2<u32>(high >= limit);
    let l = select(low, full_low, clipped_only);
    let h = select(high, full_high, clipped_only);
    let one = select(l.x, h.x, (x & 1u) == 1u) * weights.x;
    let sum = (l.x * weights.x + h.x * weights.y) + (l.y * weights.z + h.y * weights.w);
    return vec2(select(one, sum, w.fours), (full_low.x | full_low.y) | (full_high.x | full_high.y));
}

fn profile_of(at: vec2<i32>, n: vec2<f32>) -> Profile {
    let columns = by_columns(n);
    let fours = columns && frame.fours > 0;
    let x0 = select(at.y, at.x, columns);
    let y0 = select(at.x, at.y, columns);
    let width = select(frame.height, frame.width, columns);
    let height = select(frame.width, frame.height, columns);
    let left = select(x0 - frame.reach_along, (x0 - 2 * frame.fours + 2) & -4, fours);
    let right = select(x0 + frame.reach_along, left + 4 * frame.fours - 1, fours);
    let begin = max(left, 0);
    let end = min(right, width - 1);
    let stride = frame.stride_across;
    let across = select(vec2(stride, 0), vec2(0, stride), columns);
    let nb = select(n.x, n.y, columns);
    let w = Walk(columns, fours, select(n.y, n.x, columns), nb, x0, y0, width, begin, end, across);
    // Samples whose rows all lie in the picture.
    let first_shift = shift(w, begin);
    let last_shift = shift(w, select(end, end & -4, fours));
    let low = min(first_shift, last_shift);
    let high = max(first_shift, last_shift);
    let half = i32(ceil(frame.half_across / abs(nb)));
    let start = max(-half, -floor_div(y0 + low, stride));
    let stop = min(half, floor_div(height - 1 - high - y0, stride));
    let count = clamp(stop - start + 1, 0, SAMPLES);
    let size = select(1, 4, fours);
    // Weight, its square, moment and second moment of the offsets across.
    var sums = vec4(0.0);
    var full = 0u;
    var rounds = 1u;
    for (var round = 0u; round < rounds; round++) {
        let again = round == 1u;
        for (var a = begin; a <= end; a += 3 * size) {
            let g0 = group(w, a, start);
            let g1 = group(w, a + size, start);
            let g2 = group(w, a + 2 * size, start);
            for (var once = u32(!again); once > 0u; once--) {
                sums += (moments(w, a, g0) + moments(w, a + size, g1)) + moments(w, a + 2 * size, g2);
            }
            for (var k = 0; k < count; k++) {
                // All three, also where the line ends before: a load is cheaper than a branch.
                let l0 = sum_of(g0, k, w, again);
                let l1 = sum_of(g1, k, w, again);
                let l2 = sum_of(g2, k, w, again);
                let clipped = l0.y | select(0u, l1.y, a + size <= end) | select(0u, l2.y, a + 2 * size <= end);
                let slot = k + select(0, SAMPLES, again);
                samples[slot] = select(0.0, samples[slot], a > begin) + f32(i32(l0.x + l1.x + l2.x));
                full |= clipped;
            }
        }
        rounds = select(1u, 2u, full != 0u);
    }
    let mean = sums.z / sums.x;
    let step = f32(stride) * nb;
    return Profile(count, mean + f32(start) * step, step, 1.0 / sums.x, sums.x / 127.0, sums.y / (127.0 * 127.0),
        max(sums.w / sums.x - mean * mean, 0.0), full != 0u);
}

// Offset and grey level of a sample.
fn sample(p: Profile, k: i32) -> vec2<f32> {
    return vec2(p.offset + f32(k) * p.step, samples[k] * p.scale);
}

// Grey levels of four samples.
fn four_levels(p: Profile, k: i32) -> vec4<f32> {
    return vec4(samples[k], samples[k + 1], samples[k + 2], samples[k + 3]) * p.scale;
}

// The shares of their weights that are not clipped.
fn four_clear(p: Profile, k: i32) -> vec4<f32> {
    var clear = vec4(1.0);
    for (var some = u32(p.clipped); some > 0u; some--) {
        clear -= four_levels(p, k + SAMPLES);
    }
    return clear;
}

// The samples whose offsets may lie within `reach` of m, and some beyond.
fn within(p: Profile, m: f32, reach: f32) -> vec2<i32> {
    let a = (m - reach - p.offset) / p.step;
    let b = (m + reach - p.offset) / p.step;
    let top = f32(p.count);
    return vec2(i32(clamp(floor(min(a, b)), 0.0, top)), i32(clamp(ceil(max(a, b)) + 1.0, 0.0, top)));
}
