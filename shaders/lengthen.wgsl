// In: pictures, skeleton, lit pixels. Out: the skeleton with its ends carried on while the light lasts. Twin and reasons:
// src/stages/lengthen.rs. Frame and unit: pixels; brightness relative to the end's own.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
@group(0) @binding(3) var<storage, read> list: array<u32>;
@group(0) @binding(4) var<storage, read> mask: array<u32>;
@group(0) @binding(5) var<storage, read> lit: array<u32>;
@group(0) @binding(6) var<storage, read_write> long: array<atomic<u32>>;

fn thin(shot: u32, x: i32, y: i32) -> i32 {
    return i32((mask[mask_word(shot, u32(x), u32(y))] >> (u32(x) & 31u)) & 1u);
}
// Sum of the 3x3 pixels around one.
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

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let w = i32(frame.width);
    let h = i32(frame.height);
    // Eight invocations a tile would each look at one row: most rows are dark, so one looks at all.
    for (var row = 0u; row < select(0u, 8u, id.x < listing[3]); row++) {
        let tile = list[id.x];
        let shot = tile_shot(tile);
        let y = i32(8u * tile_y(tile) + row);
        var bits = mask[mask_index(tile, row)];
        bits = select(0u, bits, y >= 3 && y < h - 3);
        while bits != 0u {
            let x = i32(32u * tile_x(tile) + countTrailingZeros(bits));
            bits &= bits - 1u;
            // An end has its one or two neighbours on one side.
            let within = x >= 3 && x < w - 3;
            var n = 0;
            var sx = 0;
            var sy = 0;
            for (var j = select(2, -1, within); j <= 1; j++) {
                for (var i = -1; i <= 1; i++) {
                    let l = thin(shot, x + i, y + j) * i32(i != 0 || j != 0);
                    n += l;
                    sx += l * i;
                    sy += l * j;
                }
            }
            let end = n == 1 || (n == 2 && abs(sx) + abs(sy) >= 2);
            var ax = 0;
            var ay = 0;
            for (var j = select(4, -3, end); j <= 3; j++) {
                for (var i = -3; i <= 3; i++) {
                    let l = thin(shot, x + i, y + j);
                    ax -= l * i;
                    ay -= l * j;
                }
            }
            let length2 = f32(ax) * f32(ax) + f32(ay) * f32(ay);
            let dx = f32(ax) / sqrt(length2);
            let dy = f32(ay) / sqrt(length2);
            var t = 1;
            var last = select(0, i32(frame.lengthen & 0xffffu), end && length2 > 0.0);
            var limit = 0u;
            for (var once = u32(last > 0); once > 0u; once--) {
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
                for (var once = u32(on); once > 0u; once--) {
                    atomicOr(&long[word], bit);
                }
                last = select(0, last, on);
                t += 1;
            }
        }
    }
}
