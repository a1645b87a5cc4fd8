// In: a picture, a skeleton pixel, the direction across the stripe. Out: the stripe's profile there, averaged along it.
// Twin and reasons: src/stages/peak/profile.rs; docs/math.md, Stripe peak (2). Frame and unit: offsets from the
// skeleton pixel, px; grey levels.
//
// Work on every sample is written out as calls with constant arguments, so that samples are registers: an array with an
// index that is known only at run time lies in memory, which Mesa's software adapter reads and writes lane by lane, and
// other adapters behind their caches. What reads pixels stays a loop, because the whole text has to fit 32 KiB of
// instruction cache: one workgroup walks through all of it.

// A profile's samples by four; sample k lies at k + 2 quads.
override quads: i32 = 10;
// Levels, and the shares of clipped pixels' weights, which are there only if a pixel is clipped.
var<private> levels: array<vec4<f32>, 10>;
var<private> sums: array<vec4<f32>, 10>;
struct Profile {
    // First and last sample that lies in the picture; sample k is `offset + k step` off.
    low: f32,
    high: f32,
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

// How the pixels along the stripe are added up.
struct Walk {
    columns: bool,
    // Four columns at a time, as they lie in memory.
    fours: bool,
    na: f32,
    nb: f32,
    x0: i32,
    y0: i32,
    // Last place, and last group's.
    end: i32,
    last: i32,
    // How far from the skeleton's pixel a place may lie.
    room: i32,
    fade: f32,
    // Between two samples, in pixels as they lie in memory.
    across: u32,
}

// Pixels side by side with one shift: the first one's place at the first sample, -2 quads; weights in 127ths, two a
// word, for samples k, k + 1, k + 2, k + 3, k that one or four, eight, .. after it: along a row the place within a
// word changes. Sums of weight, weight squared, weight times offset across and times its square.
struct Group {
    at: u32,
    even: vec4<u32>,
    odd: vec4<u32>,
    moments: vec4<f32>,
}

fn group(w: Walk, a: i32, row: i32) -> Group {
    // A place beyond the end has no weight and reads what the last one reads.
    let place = min(a, w.last);
    let t = vec4(f32(a - w.x0)) + vec4(0.0, 1.0, 2.0, 3.0);
    let f = max(vec4(1.0) - w.fade * (t * t), vec4(0.0));
    let limit = f32(w.end - w.x0);
    let inside = t <= vec4(limit, vec3(select(-1e9, limit, w.fours))) & t >= vec4(f32(-w.room));
    let weights = select(vec4(0u), vec4<u32>(vec4(127.0) * (f * f) + vec4(0.5)), inside);
    let b = shift(w, place) + row;
    let at = vec2<u32>(select(vec2(w.y0 + b, place), vec2(place, w.y0 + b), w.columns));
    let first_pixel = ((first + at.y * frame.pitch) << px_log2) + at.x + u32(-2 * quads) * w.across;
    let g = vec4<f32>(weights);
    let c = f32(b) * w.nb + t.x * w.na;
    let sum = (g.x + g.y) + (g.z + g.w);
    let run = w.na * (g.y + (2.0 * g.z + 3.0 * g.w));
    let run2 = (w.na * w.na) * (g.y + (4.0 * g.z + 9.0 * g.w));
    let moments = vec4(sum, dot(g, g), c * sum + run, c * (c * sum + 2.0 * run) + run2);
    let places = vec4(first_pixel) + vec4(0u, 1u, 2u, 3u) * w.across;
    if px_log2 == 2u {
        let by_four = weights.z | (weights.x << 16u);
        let even = vec4(by_four) >> (vec4(8u) * (places & vec4(2u)));
        let is_odd = (places & vec4(1u)) == vec4(1u);
        return Group(first_pixel, select(even, vec4(0u), is_odd), select(vec4(weights.w | (weights.y << 16u)), even,
            is_odd), moments);
    }
    let low = vec4(weights.x | (weights.y << 16u)) << (vec4(16u) * (places & vec4(1u)));
    return Group(first_pixel, low, vec4(weights.z | (weights.w << 16u)), moments);
}

// Whole pixels by which a group follows the line. Not + 0.5: at 45 degrees rounding would decide.
fn shift(w: Walk, a: i32) -> i32 {
    return i32(floor(-((f32(a - w.x0) + select(0.0, 1.5, w.fours)) * w.na) / w.nb + 0.47));
}

// What a pixel adds: its level, or 128 if it is clipped. Of bytes, (read & cut) + add, and read itself, have what
// counts.
struct Sieve {
    again: bool,
    cut: u32,
    add: u32,
    keep: u32,
}
var<private> sieve: Sieve;
// A high bit of a byte is set if a pixel is clipped.
var<private> full: u32;
var<private> groups: array<Group, 3>;

// The weighted sum of a group's pixels.
fn sum_of(p: u32, even: u32, odd: u32) -> u32 {
    let read = image[p >> px_log2];
    if px_log2 == 2u {
        // The highest bit of every byte that is 255.
        full |= ((read & 0x7f7f7f7fu) + 0x01010101u) & read;
        let v = ((read & sieve.cut) + sieve.add) & read;
        // Two products in one multiplication: 255 times 127 fits 15 bits, and the sum of two 16.
        return (((v & sieve.keep) * even) >> 16u) + ((((v >> 8u) & sieve.keep) * odd) >> 16u);
    }
    let words = vec2(read, image[(p >> px_log2) + 1u]);
    let weights = vec2(even, odd);
    let limit = vec2(u32(frame.full_scale));
    let low = words & vec2(0xffffu);
    let high = words >> vec2(16u);
    let clipped = (vec2(128u) * vec2<u32>(low >= limit)) * (weights & vec2(0xffffu)) + (vec2(128u)
        * vec2<u32>(high >= limit)) * (weights >> vec2(16u));
    full |= clipped.x | clipped.y;
    let light = low * (weights & vec2(0xffffu)) + high * (weights >> vec2(16u));
    let sum = select(light, clipped, sieve.again);
    return sum.x + sum.y;
}

// Of an upright stripe four samples are four pixels of a word, or of two: the weighted sums of two rows, the pixels
// in pairs as `even` and `odd` of a word are. The words that the next ones begin in are kept.
var<private> begun: vec2<u32>;
fn four_of(word: vec2<u32>, bits: vec2<u32>, weights: vec2<u32>) -> vec4<u32> {
    let next = vec2(image[word.x], image[word.y]);
    let read = (begun >> bits) | ((next << (vec2(31u) - bits)) << vec2(1u));
    begun = next;
    let top = ((read & vec2(0x7f7f7f7fu)) + vec2(0x01010101u)) & read;
    full |= top.x | top.y;
    let v = ((read & vec2(sieve.cut)) + vec2(sieve.add)) & read;
    // 255 times 127, twice, fits 16 bits.
    let even = (v & vec2(sieve.keep)) * weights;
    let odd = ((v >> vec2(8u)) & vec2(sieve.keep)) * weights;
    let sums = vec2(even.x + even.y, odd.x + odd.y);
    return vec4(sums & vec2(0xffffu), sums >> vec2(16u));
}

fn three(k: u32, q: u32) -> u32 {
    return (sum_of(groups[0].at + k, groups[0].even[q], groups[0].odd[q]) + sum_of(groups[1].at + k,
        groups[1].even[q], groups[1].odd[q]))
        + sum_of(groups[2].at + k, groups[2].even[q], groups[2].odd[q]);
}

fn clear_quad(q: i32) {
    if q < quads {
        sums[q] = vec4(0.0);
    }
}

fn turn(q: i32) {
    if q + 1 < quads {
        sums[q] = sums[q + 1];
    }
}

var<private> scale: f32;
fn settle(q: i32) {
    if q < quads {
        let v = sums[q] * scale;
        levels[q] = select(v, levels[q], sieve.again);
        sums[q] = select(vec4(0.0), v, sieve.again);
    }
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
    let na = select(n.y, n.x, columns);
    let nb = select(n.x, n.y, columns);
    // At whole numbers rounding shall not decide.
    let held = min(f32(min(y0, height - 1 - y0)) * abs(nb) / max(abs(na), 1e-6), 8192.0);
    let room = min(min(x0, width - 1 - x0), i32(floor(held + 0.03)));
    let begin = max(max(left, 0), (x0 - room) & select(-1, -4, fours));
    let end = min(min(right, width - 1), x0 + room);
    let tall = frame.rows;
    let last = select(end, end & -4, fours);
    let across = u32(tall) * select(1u, frame.pitch << px_log2, columns);
    let w = Walk(columns, fours, na, nb, x0, y0, end, last, room, frame.along_factor / (nb * nb), across);
    // Samples whose rows all lie in the picture.
    let first_shift = shift(w, begin);
    let last_shift = shift(w, last);
    let low = -floor_div(y0 + min(first_shift, last_shift), tall);
    let high = floor_div(height - 1 - max(first_shift, last_shift) - y0 - (tall - 1), tall);
    let size = select(1, 4, fours);
    // Samples are pixels side by side.
    let by_words = px_log2 == 2u && !columns && tall == 1;
    // Weight, its square, moment and second moment of the offsets across.
    var moments = vec4(0.0);
    full = 0u;
    sieve = Sieve(false, 0u, 0xffffffffu, 0x00ff00ffu);
    clear_quad(0); clear_quad(1); clear_quad(2); clear_quad(3); clear_quad(4);
    clear_quad(5); clear_quad(6); clear_quad(7); clear_quad(8); clear_quad(9);
    for (var round = 0; round < 2; round++) {
        moments = vec4(0.0);
        for (var row = 0; row < tall; row++) {
            for (var a = select(begin, end + 1, by_words); a <= end; a += 3 * size) {
                groups = array(group(w, a, row), group(w, a + size, row), group(w, a + 2 * size, row));
                moments += (groups[0].moments + groups[1].moments) + groups[2].moments;
                var k = 0u;
                for (var q = 0; q < quads; q++) {
                    // The samples go round: four leave at the front and come back, with more light, at the end.
                    let four = vec4(three(k, 0u), three(k + across, 1u), three(k + 2u * across, 2u), three(k + 3u
                        * across, 3u));
                    let v = sums[0] + vec4<f32>(vec4<i32>(four));
                    turn(0); turn(1); turn(2); turn(3); turn(4); turn(5); turn(6); turn(7); turn(8);
                    sums[quads - 1] = v;
                    k += 4u * across;
                }
            }
        }
        for (var a = select(end + 1, begin, by_words); a <= end; a += 2) {
            let one = group(w, a, 0);
            let two = group(w, a + 1, 0);
            moments += one.moments + two.moments;
            var word = vec2(one.at, two.at) >> vec2(px_log2);
            let bits = vec2(8u) * (vec2(one.at, two.at) & vec2(3u));
            let weights = vec2(u32(one.moments.x), u32(two.moments.x));
            begun = vec2(image[word.x], image[word.y]);
            for (var q = 0; q < quads; q++) {
                word += vec2(1u);
                let v = sums[0] + vec4<f32>(vec4<i32>(four_of(word, bits, weights)));
                turn(0); turn(1); turn(2); turn(3); turn(4); turn(5); turn(6); turn(7); turn(8);
                sums[quads - 1] = v;
            }
        }
        scale = select(1.0, 1.0 / 128.0, sieve.again) / moments.x;
        settle(0); settle(1); settle(2); settle(3); settle(4); settle(5); settle(6); settle(7); settle(8); settle(9);
        // A second round for the weights of clipped pixels, where there are any.
        round = select(round, 1, (full & 0x80808080u) == 0u);
        sieve = Sieve(true, 0x7f7f7f7fu, 0x01010101u, 0x00800080u);
    }
    let mean = moments.z / moments.x;
    return Profile(f32(low), f32(high), mean, f32(tall) * nb, moments.x / 127.0, moments.y / (127.0 * 127.0),
        max(moments.w / moments.x - mean * mean, 0.0));
}

// Levels of sample j and of sample -1 - j, and how much of their weights is clipped.
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

// Sample numbers of a pair.
fn pair(j: i32) -> vec2<f32> {
    return vec2(f32(j), f32(-1 - j));
}

// Where the samples begin and end that lie within `reach` of m, in their numbers; not whole.
fn span(p: Profile, m: f32, reach: f32) -> vec2<f32> {
    let a = (m - reach - p.offset) / p.step;
    let b = (m + reach - p.offset) / p.step;
    return vec2(max(min(a, b), p.low - 0.5), min(max(a, b), p.high + 0.5));
}

// How much of a pair's samples lies in a span: in or out would hang on the last bit of its ends.
fn share(j: i32, s: vec2<f32>) -> vec2<f32> {
    return clamp(min(pair(j) - vec2(s.x), vec2(s.y) - pair(j)) + vec2(0.5), vec2(0.0), vec2(1.0));
}
