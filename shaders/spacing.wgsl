// Thins the skeleton across the stripe. A run is a row of skeleton pixels within `spacing` of each other. The middle
// pixel of each run stays, and every pixel at a multiple of `spacing` from it. Isolated lit pixels are removed. Twin
// and reasons: src/stages/stripe/lines/spacing.rs.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> lit: array<u32>;
@group(0) @binding(4) var<storage, read> mask: array<u32>;
@group(0) @binding(5) var<storage, read_write> spaced: array<u32>;

// Pixels of the run beyond one of its pixels, on one side; FAR if the run has no end within FAR pixels. Where nothing
// is lit, the mask of lengthened lines may contain pixels of another batch, so only lit pixels count.
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
    if (frame.spacing & 0xffffu) == 0u {
        return true;
    }
    let rows = i32((frame.spacing >> 16u) & 1u);
    let across = vec2(rows, 1 - rows);
    let before = beyond(shot, x, y, -across);
    let after = beyond(shot, x, y, across);
    let place = select(before - (before + after + 1) / 2, select(y, x, rows == 1), max(before, after) == FAR);
    return place % i32(frame.spacing & 0xffffu) == 0;
}

// Whether another pixel close to this one is lit; true if the setting does not require it.
fn in_company(shot: u32, x: i32, y: i32) -> bool {
    if (frame.spacing & COMPANY) == 0u {
        return true;
    }
    // The columns lie in one word or in two neighbouring words; if they begin at a word's start, they lie in one.
    let first = u32(max(x - NEAR, 0));
    let last = u32(min(x + NEAR, i32(frame.width) - 1));
    let wanted = (1u << (last - first + 1u)) - 1u;
    var lights = 0u;
    for (var v = max(y - NEAR, 0); v <= min(y + NEAR, i32(frame.height) - 1); v++) {
        let low = lit[mask_word(shot, first, u32(v))] >> (first & 31u);
        let high = lit[mask_word(shot, last, u32(v))] << ((32u - (first & 31u)) & 31u);
        lights += countOneBits((low | high) & wanted);
    }
    return lights > 1u;
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
                let x = i32(32u * tile_x(tile) + bit);
                let y = i32(8u * tile_y(tile) + row);
                if kept(tile_shot(tile), x, y) && in_company(tile_shot(tile), x, y) {
                    some |= 1u << bit;
                }
            }
            spaced[mask_index(tile, row)] = some;
        }
    }
}

// If a run continues for longer than this, its middle cannot be found from here: its pixels are counted from the
// picture's border.
const FAR: i32 = 32;
// A lit pixel without another one within NEAR columns and rows does not belong to a stripe. COMPANY is the setting's
// bit for removing it.
const NEAR: i32 = 3;
const COMPANY: u32 = 0x20000u;
