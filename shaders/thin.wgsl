// In: the mask before a sub-iteration. Out: the mask after it, in the listed tiles, and a stamp on those that changed.
// Words of 32 pixels, one invocation for the 8 words of a tile [zhang84], [guo89]. The border rows and columns of the
// picture are never deleted, as in OpenCV.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> before: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> after: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> stamps: array<u32>;

// `one` collects whether any of the bits added was set, `more` whether more than one was.
struct Count {
    one: vec4<u32>,
    more: vec4<u32>,
}
fn add(c: Count, bit: vec4<u32>) -> Count {
    return Count(c.one | bit, c.more | (c.one & bit));
}

fn zhang_suen(p2: vec4<u32>, p3: vec4<u32>, p4: vec4<u32>, p5: vec4<u32>, p6: vec4<u32>, p7: vec4<u32>,
    p8: vec4<u32>, p9: vec4<u32>, second: bool) -> vec4<u32> {
    var a = Count(~p2 & p3, vec4(0u));
    a = add(a, ~p3 & p4);
    a = add(a, ~p4 & p5);
    a = add(a, ~p5 & p6);
    a = add(a, ~p6 & p7);
    a = add(a, ~p7 & p8);
    a = add(a, ~p8 & p9);
    a = add(a, ~p9 & p2);
    // Three full adders: the number of neighbours is b0 + 2 b1 + 4 b2 (8 wraps to 0, which is refused too).
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

fn two_of(a: vec4<u32>, b: vec4<u32>, c: vec4<u32>, d: vec4<u32>) -> vec4<u32> {
    return (a & b) | (c & d) | ((a | b) & (c | d));
}

fn guo_hall(p2: vec4<u32>, p3: vec4<u32>, p4: vec4<u32>, p5: vec4<u32>, p6: vec4<u32>, p7: vec4<u32>, p8: vec4<u32>,
    p9: vec4<u32>, second: bool) -> vec4<u32> {
    var c = Count(~p2 & (p3 | p4), vec4(0u));
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

// 0 Zhang-Suen, 1 Guo-Hall: a constant, so that the compiled code has only one rule.
override rule: u32 = 0u;

fn gone_of(p2: vec4<u32>, p3: vec4<u32>, p4: vec4<u32>, p5: vec4<u32>, p6: vec4<u32>, p7: vec4<u32>, p8: vec4<u32>,
    p9: vec4<u32>) -> vec4<u32> {
    let second = (frame.step & 1u) != 0u;
    if rule == 0u {
        return zhang_suen(p2, p3, p4, p5, p6, p7, p8, p9, second);
    }
    return guo_hall(p2, p3, p4, p5, p6, p7, p8, p9, second);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let tile = list[id.x];
        let at = tile_index(tile);
        let x = tile_x(tile);
        let y = tile_y(tile);
        let pitch = frame.tiles_x;
        // Tiles beyond the picture are dark: their index is the tile's own, their bits are cleared.
        let to_left = select(0u, 1u, x > 0u);
        let to_right = select(0u, 1u, x + 1u < pitch);
        let above = at - select(0u, pitch, y > 0u);
        let below = at + select(0u, pitch, y + 1u < frame.tiles_y);
        let up_bits = select(0u, 0xffffffffu, y > 0u);
        let down_bits = select(0u, 0xffffffffu, y + 1u < frame.tiles_y);
        // Rows 0 to 3 and 4 to 7 of the tile; the last bit of its left and the first of its right neighbour.
        let here0 = before[2u * at];
        let here1 = before[2u * at + 1u];
        let left0 = (before[2u * (at - to_left)] >> vec4(31u)) & vec4(to_left);
        let left1 = (before[2u * (at - to_left) + 1u] >> vec4(31u)) & vec4(to_left);
        let right0 = (before[2u * (at + to_right)] & vec4(to_right)) << vec4(31u);
        let right1 = (before[2u * (at + to_right) + 1u] & vec4(to_right)) << vec4(31u);
        let up = before[2u * above + 1u].w & up_bits;
        let up_left = (before[2u * (above - to_left) + 1u].w >> 31u) & to_left & up_bits;
        let up_right = (before[2u * (above + to_right) + 1u].w & to_right & up_bits) << 31u;
        let down = before[2u * below].x & down_bits;
        let down_left = (before[2u * (below - to_left)].x >> 31u) & to_left & down_bits;
        let down_right = (before[2u * (below + to_right)].x & to_right & down_bits) << 31u;
        let west0 = (here0 << vec4(1u)) | left0;
        let west1 = (here1 << vec4(1u)) | left1;
        let east0 = (here0 >> vec4(1u)) | right0;
        let east1 = (here1 >> vec4(1u)) | right1;
        let up_west = (up << 1u) | up_left;
        let up_east = (up >> 1u) | up_right;
        let down_west = (down << 1u) | down_left;
        let down_east = (down >> 1u) | down_right;
        // Neighbours clockwise from north. North of rows 1 to 3 are rows 0 to 2, and so on.
        var gone0 = gone_of(
            vec4(up, here0.xyz), vec4(up_east, east0.xyz), east0, vec4(east0.yzw, east1.x),
            vec4(here0.yzw, here1.x), vec4(west0.yzw, west1.x), west0, vec4(up_west, west0.xyz));
        var gone1 = gone_of(
            vec4(here0.w, here1.xyz), vec4(east0.w, east1.xyz), east1, vec4(east1.yzw, down_east),
            vec4(here1.yzw, down), vec4(west1.yzw, down_west), west1, vec4(west0.w, west1.xyz));
        // Columns 1 to width - 2 and rows 1 to height - 2.
        let keep = min(frame.width - 1u - min(32u * x, frame.width - 1u), 32u);
        var deletable = select((1u << (keep & 31u)) - 1u, 0xffffffffu, keep == 32u);
        deletable &= select(0xffffffffu, 0xfffffffeu, x == 0u);
        let row0 = vec4(8u * y) + vec4(0u, 1u, 2u, 3u);
        let row1 = row0 + vec4(4u);
        let last = vec4(frame.height);
        gone0 &= here0 & select(vec4(0u), vec4(deletable), row0 > vec4(0u) & row0 + vec4(1u) < last);
        gone1 &= here1 & select(vec4(0u), vec4(deletable), row1 + vec4(1u) < last);
        after[2u * at] = here0 & ~gone0;
        after[2u * at + 1u] = here1 & ~gone1;
        // Only the tile's own stamp: `compact` reads the neighbours' stamps, because eight more stores here would cost
        // a third of the stage.
        let both = gone0 | gone1;
        if ((both.x | both.y) | (both.z | both.w)) != 0u {
            stamps[at] = frame.step + 3u;
        }
    }
}
