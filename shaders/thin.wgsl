// In: the mask before a sub-iteration. Out: the mask after it, in the tiles whose surroundings changed
// in the last two: 32 pixels a word, one word an invocation [zhang84], [guo89].
// The border rows and columns of the picture are never deleted, as in OpenCV.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> before: array<u32>;
@group(0) @binding(4) var<storage, read_write> after: array<u32>;
@group(0) @binding(5) var<storage, read_write> stamps: array<u32>;

// Exactly one of the bits given one after the other; `more` collects the rest.
struct Count {
    one: u32,
    more: u32,
}
fn add(c: Count, bit: u32) -> Count {
    return Count(c.one | bit, c.more | (c.one & bit));
}

fn zhang_suen(p2: u32, p3: u32, p4: u32, p5: u32, p6: u32, p7: u32, p8: u32, p9: u32, second: bool) -> u32 {
    var a = Count(~p2 & p3, 0u);
    a = add(a, ~p3 & p4);
    a = add(a, ~p4 & p5);
    a = add(a, ~p5 & p6);
    a = add(a, ~p6 & p7);
    a = add(a, ~p7 & p8);
    a = add(a, ~p8 & p9);
    a = add(a, ~p9 & p2);
    // Three full adders: neighbours counted in b0 + 2 b1 + 4 b2 (8 wraps to 0, which is refused too).
    let s1 = p2 ^ p3 ^ p4;
    let c1 = (p2 & p3) | (p4 & (p2 ^ p3));
    let s2 = p5 ^ p6 ^ p7;
    let c2 = (p5 & p6) | (p7 & (p5 ^ p6));
    let s3 = p8 ^ p9;
    let c3 = p8 & p9;
    let b0 = s1 ^ s2 ^ s3;
    let c4 = (s1 & s2) | (s3 & (s1 ^ s2));
    let t = c1 ^ c2 ^ c3;
    let u = (c1 & c2) | (c3 & (c1 ^ c2));
    let b1 = t ^ c4;
    let b2 = u ^ (t & c4);
    let stays = select((p4 & p6) & (p2 | p8), (p2 & p8) & (p4 | p6), second);
    return a.one & ~a.more & (b1 | b2) & ~(b0 & b1 & b2) & ~stays;
}

fn two_of(a: u32, b: u32, c: u32, d: u32) -> u32 {
    return (a & b) | (c & d) | ((a | b) & (c | d));
}

fn guo_hall(p2: u32, p3: u32, p4: u32, p5: u32, p6: u32, p7: u32, p8: u32, p9: u32, second: bool) -> u32 {
    var c = Count(~p2 & (p3 | p4), 0u);
    c = add(c, ~p4 & (p5 | p6));
    c = add(c, ~p6 & (p7 | p8));
    c = add(c, ~p8 & (p9 | p2));
    let n1 = two_of(p9 | p2, p3 | p4, p5 | p6, p7 | p8);
    let n2 = two_of(p2 | p3, p4 | p5, p6 | p7, p8 | p9);
    let all1 = (p9 | p2) & (p3 | p4) & (p5 | p6) & (p7 | p8);
    let all2 = (p2 | p3) & (p4 | p5) & (p6 | p7) & (p8 | p9);
    let stays = select((p6 | p7 | ~p9) & p8, (p2 | p3 | ~p5) & p4, second);
    return c.one & ~c.more & n1 & n2 & ~(all1 & all2) & ~stays;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x / 8u;
    let row = id.x % 8u;
    for (var inside = u32(slot < listing[3]); inside > 0u; inside--) {
        let tile = list[slot];
        for (var run = u32(stamps[tile_index(tile)] > frame.step); run > 0u; run--) {
            let x = tile_x(tile);
            let y = 8u * tile_y(tile) + row;
            let rows = 8u * frame.tiles_y;
            let pitch = frame.tiles_x;
            let own = mask_index(tile, row);
            let up = select(own, own - pitch, y > 0u);
            let down = select(own, own + pitch, y + 1u < rows);
            let up_bits = select(0u, 0xffffffffu, y > 0u);
            let down_bits = select(0u, 0xffffffffu, y + 1u < rows);
            let left = select(0u, 1u, x > 0u);
            let right = select(0u, 1u, x + 1u < pitch);
            let here = before[own];
            let n = before[up] & up_bits;
            let s = before[down] & down_bits;
            let west = (here << 1u) | ((before[own - left] >> 31u) & left);
            let east = (here >> 1u) | ((before[own + right] & right) << 31u);
            let nw = ((before[up] << 1u) | ((before[up - left] >> 31u) & left)) & up_bits;
            let ne = ((before[up] >> 1u) | ((before[up + right] & right) << 31u)) & up_bits;
            let sw = ((before[down] << 1u) | ((before[down - left] >> 31u) & left)) & down_bits;
            let se = ((before[down] >> 1u) | ((before[down + right] & right) << 31u)) & down_bits;
            let second = (frame.step & 1u) != 0u;
            var gone = 0u;
            for (var zs = frame.rule; zs == 0u; zs++) {
                gone = zhang_suen(n, ne, east, se, s, sw, west, nw, second);
            }
            for (var gh = frame.rule; gh == 1u; gh++) {
                gone = guo_hall(n, ne, east, se, s, sw, west, nw, second);
            }
            // Columns 1 to width - 2 and rows 1 to height - 2.
            let keep = min(frame.width - 1u - min(32u * x, frame.width - 1u), 32u);
            var deletable = select((1u << (keep & 31u)) - 1u, 0xffffffffu, keep == 32u);
            deletable &= select(0xffffffffu, 0xfffffffeu, x == 0u);
            deletable = select(0u, deletable, y > 0u && y + 1u < frame.height);
            gone &= here & deletable;
            after[own] = here & ~gone;
            // A change wakes its own tile, and a neighbour only where it touches it.
            for (var changed = u32(gone != 0u); changed > 0u; changed--) {
                let at = tile_index(tile);
                let stamp = frame.step + 3u;
                stamps[at] = stamp;
                let to_left = select(0u, 1u, (gone & 1u) != 0u && x > 0u);
                let to_right = select(0u, 1u, (gone >> 31u) != 0u && x + 1u < pitch);
                stamps[at - to_left] = stamp;
                stamps[at + to_right] = stamp;
                let up_row = select(0u, pitch, row == 0u && y > 0u);
                let down_row = select(0u, pitch, row == 7u && y + 1u < rows);
                let beside = at - up_row + down_row;
                stamps[beside] = stamp;
                stamps[beside - to_left] = stamp;
                stamps[beside + to_right] = stamp;
            }
        }
    }
}
