// In: a picture, a skeleton pixel, the direction across the stripe. Out: the stripe's profile there, averaged along it.
// Twin and reasons: src/stages/peak/windows.rs, profile.rs; docs/math.md, Stripe peak (2). Frame and unit: offsets from
// the skeleton pixel, px; grey levels.
//
// Work on every sample is unrolled by hand into calls with constant arguments, so that samples are in registers. An
// array with an index that is known only at run time is in memory, which Mesa's software adapter reads and writes lane
// by lane, and other adapters through their caches. Code that reads pixels stays a loop, because the whole text must
// fit into 32 KiB of instruction cache: one workgroup runs through all of it.

// A profile's samples by four; sample k is stored at index k + 2 quads.
override quads: i32 = 10;
// Levels, the clipped shares of the weights, offsets from the samples' nominal places, and the variances of the pixels
// about them.
var<private> levels: array<vec4<f32>, 10>;
var<private> sums: array<vec4<f32>, 10>;
var<private> strays: array<vec4<f32>, 10>;
var<private> spreads: array<vec4<f32>, 10>;
// Average offset of the samples: at sample 0, and its increase from one to the next; the average variance.
var<private> usual: vec3<f32>;
struct Profile {
    // First and last sample that lie in the picture; sample k is `offset + k step` from the skeleton pixel.
    low: f32,
    high: f32,
    offset: f32,
    step: f32,
    weight: f32,
    square: f32,
    blur2: f32,
}

// True (columns) if the stripe is closer to the horizontal, else rows. The factor keeps rounding from deciding at 45
// degrees.
fn by_columns(n: vec2<f32>) -> bool {
    return 1.001 * n.y >= abs(n.x);
}

fn floor_div(a: i32, b: i32) -> i32 {
    return (a - select(0, b - 1, a < 0)) / b;
}

// A window that would move by less than this from row to row, px, does not move.
const STILL = 0.05;

// The window of a profile: a counts along the image axis that the stripe is closer to, b across it.
struct Walk {
    columns: bool,
    a0: i32,
    b0: i32,
    na: f32,
    nb: f32,
    // Shift of the window's middle along a from row to row.
    lean: f32,
    // Largest distance of a pixel from the pixel in the window's middle.
    room: i32,
    fade: f32,
}
var<private> walk: Walk;

// Sums over the pixels of four samples side by side: weighted levels, weights, weights of clipped pixels, squared
// weights; weights times the offset from the sample's nominal place, and times its square.
var<private> lit: vec4<u32>;
var<private> weights: vec4<u32>;
var<private> full: vec4<u32>;
var<private> squares_of: vec4<u32>;
var<private> offsets: vec4<f32>;
var<private> offsets2: vec4<f32>;

// The pixels at the windows' middles. Not + 0.5, so that rounding errors do not decide at 45 degrees.
fn pixel_of(middle: vec4<f32>) -> vec4<f32> {
    return floor(middle + vec4(0.47));
}

// Adds one pixel for each of four samples: at offset i from the skeleton pixel, with the windows' middles in their
// rows, and at offset e from their samples.
fn add(i: vec4<f32>, middle: vec4<f32>, e: vec4<f32>, level: vec4<u32>) {
    let t = i - middle;
    let f = max(vec4(1.0) - walk.fade * (t * t), vec4(0.0));
    let inside = abs(i - pixel_of(middle)) <= vec4(f32(walk.room));
    let g = select(vec4(0u), vec4<u32>(vec4(127.0) * (f * f) + vec4(0.5)), inside);
    let weight = vec4<f32>(g);
    lit += g * level;
    weights += g;
    full += select(vec4(0u), g, level >= vec4(u32(frame.full_scale)));
    squares_of += g * g;
    offsets += weight * e;
    offsets2 += weight * (e * e);
}

// Whole pixels by which a group with its middle at i is shifted to follow the line. Not + 0.5, so that rounding errors
// do not decide at 45 degrees.
fn shift(i: vec4<f32>) -> vec4<f32> {
    return floor(-(i * walk.na) / walk.nb + vec4(0.47));
}

fn at_walk(a: f32, b: f32) -> u32 {
    let place = vec2(walk.a0 + i32(a), walk.b0 + i32(b));
    return u32(whole(select(place.y, place.x, walk.columns), select(place.x, place.y, walk.columns)));
}

// Adds one row of four samples, pixel by pixel along the window.
fn singles(line: vec4<f32>, row: f32, reach: i32) {
    let middle = line * walk.lean;
    for (var j = -reach; j <= reach; j++) {
        let i = pixel_of(middle) + vec4(f32(j));
        let s = shift(i);
        let b = s + line;
        let level = vec4(at_walk(i.x, b.x), at_walk(i.y, b.y), at_walk(i.z, b.z), at_walk(i.w, b.w));
        add(i, middle, (s + vec4(row)) * walk.nb + i * walk.na, level);
    }
}

// Weights of the pixels at offsets i from the skeleton pixel, in a window that does not move.
fn weigh(i: vec4<f32>) -> vec4<u32> {
    let f = max(vec4(1.0) - walk.fade * (i * i), vec4(0.0));
    let g = vec4<u32>(vec4(127.0) * (f * f) + vec4(0.5));
    return select(vec4(0u), g, abs(i) <= vec4(f32(walk.room)));
}

// Offset of the first pixel of a group of four from the skeleton pixel.
fn group(g: i32) -> f32 {
    return f32(((walk.a0 + 2 - 2 * frame.fours) & -4) + 4 * g - walk.a0);
}

// Sums that all samples of a wide stripe by columns have in common: weights, squared weights, weights times offset and
// times its square.
fn alike(tall: f32) -> vec4<f32> {
    var sums = vec4(0.0);
    for (var row = 0.0; row < tall; row += 1.0) {
        for (var g = 0; g < frame.fours; g++) {
            let i = vec4(group(g)) + vec4(0.0, 1.0, 2.0, 3.0);
            let weight = vec4<f32>(weigh(i));
            let e = vec4((shift(vec4(i.x + 1.5)).x + row) * walk.nb) + i * walk.na;
            let once = weight * e;
            let twice_e = weight * (e * e);
            sums += vec4((weight.x + weight.y) + (weight.z + weight.w), dot(weight, weight), (once.x + once.y) + (once.z
                + once.w), (twice_e.x + twice_e.y) + (twice_e.z + twice_e.w));
        }
    }
    return sums;
}

// Light and clipped weights of a group of four pixels, in one row of a sample.
fn four_of(x: u32, b: f32, g: vec4<u32>) -> vec2<u32> {
    let y = u32(clamp(walk.b0 + i32(b), 0, frame.height - 1));
    let word = first + y * frame.pitch + (x >> px_log2);
    let begin = image[word];
    let next = image[word + select(1u, 0u, px_log2 == 2u)];
    let bytes = (vec4(begin) >> vec4(0u, 8u, 16u, 24u)) & vec4(0xffu);
    let shorts = vec4(begin & 0xffffu, begin >> 16u, next & 0xffffu, next >> 16u);
    let level = select(shorts, bytes, px_log2 == 2u);
    let light = g * level;
    let clip = select(vec4(0u), g, level >= vec4(u32(frame.full_scale)));
    return vec2((light.x + light.y) + (light.z + light.w), (clip.x + clip.y) + (clip.z + clip.w));
}

// Adds one row of four samples of a wide stripe whose window does not move: four columns at a time, as they are stored.
fn fours(line: vec4<f32>) {
    for (var g = 0; g < frame.fours; g++) {
        let i = group(g);
        let weight = weigh(vec4(i) + vec4(0.0, 1.0, 2.0, 3.0));
        let b = shift(vec4(i + 1.5)) + line;
        let x = u32(clamp(walk.a0 + i32(i), 0, (frame.width - 1) & -4));
        let p = four_of(x, b.x, weight);
        let q = four_of(x, b.y, weight);
        let r = four_of(x, b.z, weight);
        let s = four_of(x, b.w, weight);
        lit += vec4(p.x, q.x, r.x, s.x);
        full += vec4(p.y, q.y, r.y, s.y);
    }
}

fn turn_up(q: i32) {
    if q + 1 < quads {
        levels[q] = levels[q + 1];
        sums[q] = sums[q + 1];
        strays[q] = strays[q + 1];
        spreads[q] = spreads[q + 1];
    }
}

// Whether the pixels at an end of the window's row lie in the picture. Columns that share their shift with three others
// lie up to one and a half columns from where the shift is exact.
fn holds(line: vec4<f32>, end: f32, reach: i32, last: vec2<i32>, shared_by: f32) -> vec4<bool> {
    let i = pixel_of(line * walk.lean) + vec4(end * f32(reach));
    let a = vec4(f32(walk.a0)) + i;
    let b = vec4(f32(walk.b0)) + line + shift(i + vec4(end * shared_by));
    return (a >= vec4(0.0)) & (a <= vec4(f32(last.x))) & (b >= vec4(0.0)) & (b <= vec4(f32(last.y)));
}

fn profile_of(at: vec2<i32>, n: vec2<f32>) -> Profile {
    let columns = by_columns(n);
    let a0 = select(at.y, at.x, columns);
    let b0 = select(at.x, at.y, columns);
    let last = select(vec2(frame.height - 1, frame.width - 1), vec2(frame.width - 1, frame.height - 1), columns);
    let na = select(n.y, n.x, columns);
    let nb = select(n.x, n.y, columns);
    let lean = select(na * nb, 0.0, abs(na * nb) < STILL);
    let tall = f32(frame.rows);
    // The 0.03 below keeps rounding from deciding at whole numbers.
    let held = min(f32(min(b0, last.y - b0)) * abs(nb) / max(abs(na), 1e-6), 8192.0);
    let room = min(min(a0, last.x - a0), i32(floor(held + 0.03)));
    let reach = i32(floor(frame.radius * abs(nb) + min(abs(lean) * frame.half_across * tall, 0.5)));
    walk = Walk(columns, a0, b0, na, nb, lean, room, frame.along_factor / (nb * nb));
    // A line through the average offsets of the samples' pixels: sums of weight, weight times k and k^2; times offset
    // and times k offset.
    var line_all = vec3(0.0);
    var line_off = vec2(0.0);
    // Sums of variance, weight and squared weight of the samples near the middle.
    var near_sums = vec3(0.0);
    // First and last sample of which all pixels with weight lie in the picture.
    var low = 0.0;
    var high = 0.0;
    let inner = min(reach, room);
    // If the window moves from row to row, pixels are read one by one: columns that share a shift would lie beside the
    // window.
    let by_fours = columns && lean == 0.0 && frame.fours > 0;
    let shared_by = select(0.0, 1.5, by_fours);
    var of_all = vec4(0.0);
    if by_fours {
        of_all = alike(tall);
    }
    for (var q = 0; q < quads; q++) {
        let k = vec4(f32(4 * q - 2 * quads)) + vec4(0.0, 1.0, 2.0, 3.0);
        lit = vec4(0u);
        weights = vec4(0u);
        full = vec4(0u);
        squares_of = vec4(0u);
        offsets = vec4(0.0);
        offsets2 = vec4(0.0);
        for (var row = 0.0; row < tall; row += 1.0) {
            let line = k * tall + vec4(row);
            if by_fours {
                fours(line);
            } else {
                singles(line, row, reach);
            }
        }
        // The samples rotate through the array: four leave at the front, the new ones enter at the end.
        turn_up(0); turn_up(1); turn_up(2); turn_up(3); turn_up(4); turn_up(5); turn_up(6); turn_up(7); turn_up(8);
        let weight = select(vec4<f32>(weights), vec4(of_all.x), by_fours);
        levels[quads - 1] = vec4<f32>(lit) / weight;
        sums[quads - 1] = vec4<f32>(full) / weight;
        let e = select(offsets, vec4(of_all.z), by_fours) / weight;
        strays[quads - 1] = e;
        let spread = select(offsets2, vec4(of_all.w), by_fours) / weight - e * e;
        spreads[quads - 1] = spread;
        let first_row = k * tall;
        let last_row = first_row + vec4(tall - 1.0);
        let whole_of = holds(first_row, -1.0, inner, last, shared_by) & holds(first_row, 1.0, inner, last, shared_by)
            & holds(last_row, -1.0, inner, last, shared_by) & holds(last_row, 1.0, inner, last, shared_by);
        let lows = select(vec4(0.0), k, whole_of);
        low = min(low, min(min(lows.x, lows.y), min(lows.z, lows.w)));
        high = max(high, max(max(lows.x, lows.y), max(lows.z, lows.w)));
        let close = max(vec4(1.0) - abs(k * (tall * nb)) / (3.0 * frame.s0), vec4(0.0));
        line_all += vec3(dot(close, vec4(1.0)), dot(close, k), dot(close, k * k));
        line_off += vec2(dot(close, e), dot(close, k * e));
        near_sums += vec3(dot(close, spread), dot(close, weight), dot(close,
            select(vec4<f32>(squares_of), vec4(of_all.y), by_fours)));
    }
    // Increase of the offset from a sample to the next, and offset at sample 0.
    let by = (line_all.x * line_off.y - line_all.y * line_off.x) / (line_all.x * line_all.z - line_all.y * line_all.y);
    let offset = (line_off.x - by * line_all.y) / line_all.x;
    let blur2 = max(near_sums.x / line_all.x, 0.0);
    usual = vec3(offset, by, blur2);
    return Profile(low, high, offset, tall * nb + by, near_sums.y / (line_all.x * 127.0), near_sums.z / (line_all.x
        * (127.0 * 127.0)), blur2);
}

// Levels of sample j and of sample -1 - j; below, the clipped shares of their weights.
fn level_pair(j: i32) -> vec2<f32> {
    let a = u32(2 * quads + j);
    let b = u32(2 * quads - 1 - j);
    return vec2(levels[a >> 2u][a & 3u], levels[b >> 2u][b & 3u]);
}

fn clipped_pair(j: i32) -> vec2<f32> {
    let a = u32(2 * quads + j);
    let b = u32(2 * quads - 1 - j);
    return vec2(sums[a >> 2u][a & 3u], sums[b >> 2u][b & 3u]);
}

// Offsets of samples j and -1 - j from their steps.
fn stray_pair(j: i32) -> vec2<f32> {
    let a = u32(2 * quads + j);
    let b = u32(2 * quads - 1 - j);
    return vec2(strays[a >> 2u][a & 3u], strays[b >> 2u][b & 3u]) - (vec2(usual.x) + usual.y * pair(j));
}

// Excess of the variance of their pixels about their steps over the average, with offsets `stray`.
fn spread_pair(j: i32, stray: vec2<f32>) -> vec2<f32> {
    let a = u32(2 * quads + j);
    let b = u32(2 * quads - 1 - j);
    return vec2(spreads[a >> 2u][a & 3u], spreads[b >> 2u][b & 3u]) + (stray * stray - vec2(usual.z));
}

// Sample numbers of a pair.
fn pair(j: i32) -> vec2<f32> {
    return vec2(f32(j), f32(-1 - j));
}

// The first and the last number of the samples that lie within `reach` of m; not whole numbers.
fn span(p: Profile, m: f32, reach: f32) -> vec2<f32> {
    let a = (m - reach - p.offset) / p.step;
    let b = (m + reach - p.offset) / p.step;
    return vec2(max(min(a, b), p.low - 0.5), min(max(a, b), p.high + 0.5));
}

// Share of a pair's samples that lies in a span. If a sample were either in or out, the last bit of the span's ends
// would decide.
fn share(j: i32, s: vec2<f32>) -> vec2<f32> {
    return clamp(min(pair(j) - vec2(s.x), vec2(s.y) - pair(j)) + vec2(0.5), vec2(0.0), vec2(1.0));
}
