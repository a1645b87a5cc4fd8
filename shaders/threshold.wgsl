// In: pictures and the tile list. Out: per listed tile the pixels brighter than the mean of the window
// around them, four columns (a quad) an invocation: bit 4 r + k of word 8 slot + q is row r, column 4 q + k.
// The window sum runs down the rows; each row's four sums share the pixels that all four windows hold.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
@group(0) @binding(3) var<storage, read> list: array<u32>;
@group(0) @binding(4) var<storage, read_write> quads: array<u32>;

// Sums of one row over the windows of the four pixels x, x + 1, x + 2, x + 3; x is a multiple of 4.
fn row_sums(first: u32, x: i32, r: i32) -> vec4<u32> {
    let per_word = 1 << px_log2;
    let bits = 32u >> px_log2;
    // Pixels of all four windows: x + 3 - r to x + r.
    let from_px = x + 3 - r;
    let to_px = x + r;
    let from_word = from_px >> px_log2; // rounds down, also below 0
    let to_word = to_px >> px_log2;
    let from_mask = 0xffffffffu << (u32(from_px & (per_word - 1)) * bits);
    let to_mask = 0xffffffffu >> (u32(per_word - 1 - (to_px & (per_word - 1))) * bits);
    var pairs = 0u;
    for (var i = from_word; i <= to_word; i++) {
        let v = word(first, i) & select(0xffffffffu, from_mask, i == from_word) & select(0xffffffffu, to_mask, i == to_word);
        if px_log2 == 2u {
            // At most 26 words of two bytes of 255 in each half: 13,260.
            pairs += (v & 0x00ff00ffu) + ((v >> 8u) & 0x00ff00ffu);
        } else {
            pairs += (v & 0xffffu) + (v >> 16u);
        }
    }
    let core = select((pairs & 0xffffu) + (pairs >> 16u), pairs, px_log2 == 1u);
    let l0 = pixel(first, x - r);
    let l1 = pixel(first, x - r + 1);
    let l2 = pixel(first, x - r + 2);
    let r1 = pixel(first, x + r + 1);
    let r2 = pixel(first, x + r + 2);
    let r3 = pixel(first, x + r + 3);
    return vec4(core) + vec4(l0 + l1 + l2, l1 + l2 + r1, l2 + r1 + r2, r1 + r2 + r3);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x / 8u;
    let tile = list[min(slot, max(listing[3], 1u) - 1u)];
    let shot = tile_shot(tile);
    let x = i32(32u * tile_x(tile) + 4u * (id.x % 8u));
    let top = i32(8u * tile_y(tile));
    let r = i32(frame.size / 2u);
    let area = i32(frame.size * frame.size);
    var sums = vec4(0u);
    for (var y = top - r; y < top + r; y++) {
        sums += row_sums(row_start(shot, y), x, r);
    }
    var bits = 0u;
    for (var k = 0; k < 8; k++) {
        let y = top + k;
        sums += row_sums(row_start(shot, y + r), x, r);
        let first = row_start(shot, y);
        for (var c = 0; c < 4; c++) {
            let value = pixel(first, x + c);
            let lit = area * (i32(value) - frame.offset) > i32(sums[c]) + (area - 1) / 2 && value >= frame.minimum;
            bits |= u32(lit) << u32(4 * k + c);
        }
        sums -= row_sums(row_start(shot, y - r), x, r);
    }
    for (var once = u32(slot < listing[3]); once > 0u; once--) {
        quads[id.x] = bits;
    }
}
