// In: pictures, skeleton, lit pixels. Out: the skeleton with its ends lengthened as far as the stripe's light lasts.
// Twin and reasons: src/stages/stripe/lines/lengthen.rs. Here the ends are found for 32 x 4 pixels at once. Frame and
// unit: pixels; brightness relative to that at the end.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
@group(0) @binding(3) var<storage, read> list: array<u32>;
@group(0) @binding(4) var<storage, read> mask: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read> lit: array<u32>;
@group(0) @binding(6) var<storage, read_write> long: array<atomic<u32>>;

fn thin(word: u32) -> u32 {
    return mask[word / 4u][word % 4u];
}
// Sum of the 3x3 pixels around a pixel.
fn nine(shot: u32, x: i32, y: i32) -> u32 {
    var sum = 0u;
    for (var j = -1; j <= 1; j++) {
        let first = row_start(shot, y + j);
        for (var i = -1; i <= 1; i++) {
            sum += pixel(first, x + i);
        }
    }
    return sum;
}

// Four rows of a tile: every pixel, and its left and right neighbours.
struct Rows {
    own: vec4<u32>,
    left: vec4<u32>,
    right: vec4<u32>,
}
fn rows(own: vec4<u32>, left: vec4<u32>, right: vec4<u32>) -> Rows {
    return Rows(own, (own << vec4(1u)) | (left >> vec4(31u)), (own >> vec4(1u)) | (right << vec4(31u)));
}

// The pixels with one neighbour, or with two on one side: at most two steps apart on the ring of eight.
fn ends(above: Rows, r: Rows, below: Rows) -> vec4<u32> {
    var ring = array<vec4<u32>, 8>(above.own, above.right, r.right, below.right, below.own, below.left, r.left,
        above.left);
    let beside = ((ring[0] & (ring[1] | ring[2])) | (ring[1] & (ring[2] | ring[3])))
        | ((ring[2] & (ring[3] | ring[4])) | (ring[3] & (ring[4] | ring[5])))
        | ((ring[4] & (ring[5] | ring[6])) | (ring[5] & (ring[6] | ring[7])))
        | ((ring[6] & (ring[7] | ring[0])) | (ring[7] & (ring[0] | ring[1])));
    // At least one, two or three neighbours, combined pair by pair.
    let a = ring[0] | ring[1];
    let a2 = ring[0] & ring[1];
    let b = ring[2] | ring[3];
    let b2 = ring[2] & ring[3];
    let c = ring[4] | ring[5];
    let c2 = ring[4] & ring[5];
    let d = ring[6] | ring[7];
    let d2 = ring[6] & ring[7];
    let ab = a | b;
    let ab2 = a2 | b2 | (a & b);
    let ab3 = (a2 & b) | (b2 & a);
    let cd = c | d;
    let cd2 = c2 | d2 | (c & d);
    let cd3 = (c2 & d) | (d2 & c);
    let one = ab | cd;
    let two = ab2 | cd2 | (ab & cd);
    let three = ab3 | cd3 | (ab2 & cd) | (cd2 & ab);
    return r.own & ((one & ~two) | (two & ~three & beside));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let w = i32(frame.width);
    let h = i32(frame.height);
    if id.x < listing[COUNT] {
        let tile = list[id.x];
        let shot = tile_shot(tile);
        let tx = tile_x(tile);
        let ty = tile_y(tile);
        // The tiles around it. Beyond the picture any tile will do, because no end is searched there.
        let at = 2u * tile_index(tile);
        let west = at - 2u * u32(tx > 0u);
        let east = at + 2u * u32(tx + 1u < frame.tiles_x);
        let up = 2u * frame.tiles_x * u32(ty > 0u);
        let down = 2u * frame.tiles_x * u32(ty + 1u < frame.tiles_y);
        let top = vec3(mask[west - up + 1u].w, mask[at - up + 1u].w, mask[east - up + 1u].w);
        let bottom = vec3(mask[west + down].x, mask[at + down].x, mask[east + down].x);
        let l0 = mask[west];
        let l1 = mask[west + 1u];
        let m0 = mask[at];
        let m1 = mask[at + 1u];
        let r0 = mask[east];
        let r1 = mask[east + 1u];
        let first = rows(m0, l0, r0);
        let second = rows(m1, l1, r1);
        let before = rows(vec4(top.y, m0.xyz), vec4(top.x, l0.xyz), vec4(top.z, r0.xyz));
        let middle_up = rows(vec4(m0.w, m1.xyz), vec4(l0.w, l1.xyz), vec4(r0.w, r1.xyz));
        let middle_down = rows(vec4(m0.yzw, m1.x), vec4(l0.yzw, l1.x), vec4(r0.yzw, r1.x));
        let after = rows(vec4(m1.yzw, bottom.y), vec4(l1.yzw, bottom.x), vec4(r1.yzw, bottom.z));
        var ends_0 = ends(before, first, middle_down);
        var ends_1 = ends(middle_up, second, after);
        // An end must be at least three pixels from every border of the picture.
        let columns = clamp(w - 3 - i32(32u * tx), 0, 32);
        let some = (0xffffffffu >> (32u - u32(max(columns, 1)))) & select(0xfffffff8u, 0xffffffffu, tx > 0u);
        let keep = select(0u, some, columns > 0);
        let y0 = vec4(i32(8u * ty)) + vec4(0, 1, 2, 3);
        ends_0 = select(vec4(0u), ends_0 & vec4(keep), y0 >= vec4(3) & y0 < vec4(h - 3));
        ends_1 = select(vec4(0u), ends_1 & vec4(keep), y0 >= vec4(-1) & y0 < vec4(h - 7));
        for (var row = select(8u, 0u, any((ends_0 | ends_1) != vec4(0u))); row < 8u; row++) {
            let y = i32(8u * ty + row);
            var bits = select(ends_1[row & 3u], ends_0[row & 3u], row < 4u);
            while bits != 0u {
                let x = i32(32u * tx + countTrailingZeros(bits));
                bits &= bits - 1u;
                var ax = 0;
                var ay = 0;
                for (var j = -3; j <= 3; j++) {
                    // Seven pixels, which may extend into the next tile.
                    let word = mask_word(shot, u32(x - 3), u32(y + j));
                    let next = mask_word(shot, u32(x + 3), u32(y + j));
                    let by = u32(x - 3) & 31u;
                    let low = thin(word) >> by;
                    let high = (thin(next) << (31u - by)) << 1u;
                    let seven = low | select(0u, high, next != word);
                    let right = i32(((seven >> 4u) & 1u) + 2u * ((seven >> 5u) & 1u) + 3u * ((seven >> 6u) & 1u));
                    let left = i32(((seven >> 2u) & 1u) + 2u * ((seven >> 1u) & 1u) + 3u * (seven & 1u));
                    ax += left - right;
                    ay -= j * i32(countOneBits(seven & 127u));
                }
                let length2 = f32(ax) * f32(ax) + f32(ay) * f32(ay);
                let dx = f32(ax) / sqrt(length2);
                let dy = f32(ay) / sqrt(length2);
                var t = 1;
                var last = select(0, i32(frame.lengthen & 0xffffu), length2 > 0.0);
                var limit = 0u;
                if last > 0 {
                    limit = (frame.lengthen >> 16u) * nine(shot, x, y);
                }
                while t <= last {
                    let a = x + i32(floor(f32(t) * dx + 0.5));
                    let b = y + i32(floor(f32(t) * dy + 0.5));
                    let there = a >= 1 && b >= 1 && a < w - 1 && b < h - 1;
                    let c = clamp(a, 0, w - 1);
                    let d = clamp(b, 0, h - 1);
                    let word = mask_word(shot, u32(c), u32(d));
                    let bit = 1u << (u32(c) & 31u);
                    let on = there && (lit[word] & bit) != 0u && 4096u * nine(shot, c, d) >= limit;
                    if on {
                        atomicOr(&long[word], bit);
                    }
                    last = select(0, last, on);
                    t += 1;
                }
            }
        }
    }
}
