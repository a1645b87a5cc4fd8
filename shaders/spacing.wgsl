// In: the skeleton, lit pixels. Out: of each run of its pixels across the stripe the one in the middle, and every so many from it; a run's
// pixels follow one another within that distance. Twin and reasons: src/stages/stripe/lines/spacing.rs. Frame and unit: pixels.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> lit: array<u32>;
@group(0) @binding(4) var<storage, read> mask: array<u32>;
@group(0) @binding(5) var<storage, read_write> spaced: array<u32>;

// Pixels of the run beyond one of its pixels, on one side (a mask of lines that were carried on may hold another batch's where
// nothing is lit); FAR where there is no end within so many pixels.
fn beyond(shot: u32, x: i32, y: i32, across: vec2<i32>) -> i32 {
    let step = i32(frame.spacing & 0xffffu);
    var found = 0;
    var last = 0;
    for (var k = 1; k <= FAR; k++) {
        let u = x + k * across.x;
        let v = y + k * across.y;
        if k > last + step || u < 0 || v < 0 || u >= i32(frame.width) || v >= i32(frame.height) {
            return found;
        }
        let word = mask_word(shot, u32(u), u32(v));
        if (((mask[word] & lit[word]) >> (u32(u) & 31u)) & 1u) != 0u {
            found += 1;
            last = k;
        }
    }
    return FAR;
}

fn kept(shot: u32, x: i32, y: i32) -> bool {
    let rows = i32(frame.spacing >> 16u);
    let across = vec2(rows, 1 - rows);
    let before = beyond(shot, x, y, -across);
    let after = beyond(shot, x, y, across);
    let place = select(before - (before + after + 1) / 2, select(y, x, rows == 1), max(before, after) == FAR);
    return place % i32(frame.spacing & 0xffffu) == 0;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let tile = list[id.x];
        for (var row = 0u; row < 8u; row++) {
            let all = mask[mask_index(tile, row)];
            var some = 0u;
            var bits = all;
            while bits != 0u {
                let bit = countTrailingZeros(bits);
                bits &= bits - 1u;
                if kept(tile_shot(tile), i32(32u * tile_x(tile) + bit), i32(8u * tile_y(tile) + row)) {
                    some |= 1u << bit;
                }
            }
            spaced[mask_index(tile, row)] = some;
        }
    }
}

// A run that goes on for longer has no middle that can be found from here: its pixels are counted from the picture's border.
const FAR: i32 = 32;
