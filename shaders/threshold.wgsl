// In: pictures, the tile list, column sums. Out: the pixels brighter than the mean of the window around them,
// one word a tile row, inside the picture and the region of interest only, twice: `mask` is thinned, `lit`
// stays. Tiles with a lit pixel are stamped as changed, so that thinning starts there.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
@group(0) @binding(3) var<storage, read> list: array<u32>;
@group(0) @binding(4) var<storage, read> columns: array<u32>;
@group(0) @binding(5) var<storage, read> roi: array<u32>;
@group(0) @binding(6) var<storage, read_write> mask: array<u32>;
@group(0) @binding(7) var<storage, read_write> lit: array<u32>;
@group(0) @binding(8) var<storage, read_write> stamps: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x / 8u;
    let row = id.x % 8u;
    let per_word = 1u << px_log2;
    let bits_px = 32u >> px_log2;
    let full = (1u << bits_px) - 1u;
    let r = i32(frame.size / 2u);
    // n^2 (value - offset) > sum + (n^2 - 1) / 2: the mean rounded to a whole level, without a division.
    let area = i32(frame.size * frame.size);
    for (var inside = u32(slot < listing[3]); inside > 0u; inside--) {
        let tile = list[slot];
        let y = 8u * tile_y(tile) + row;
        let x0 = i32(32u * tile_x(tile));
        let wide = i32(32u * frame.tiles_x);
        let base = (tile_shot(tile) * frame.tiles_y * 8u + y) * u32(wide);
        var sum = (area - 1) / 2 + frame.offset * area;
        for (var x = x0 - r; x < x0 + r; x++) {
            sum += i32(columns[base + u32(clamp(x, 0, wide - 1))]);
        }
        let first = tile_shot(tile) * frame.shot_words + min(y, frame.height - 1u) * frame.pitch + (u32(x0) >> px_log2);
        var bits = 0u;
        var x = x0;
        for (var w = 0u; w < (32u >> px_log2); w++) {
            var pixels = image[first + w];
            for (var k = 0u; k < per_word; k++) {
                sum += i32(columns[base + u32(min(x + r, wide - 1))]);
                let value = pixels & full;
                let over = area * i32(value) > sum && value >= frame.minimum;
                bits = (bits >> 1u) | select(0u, 0x80000000u, over);
                sum -= i32(columns[base + u32(max(x - r, 0))]);
                pixels >>= bits_px;
                x += 1;
            }
        }
        let inner = min(frame.width - u32(x0), 32u);
        bits &= 0xffffffffu >> (32u - inner);
        bits = select(0u, bits, y < frame.height);
        for (var region = frame.flags & 2u; region != 0u; region = 0u) {
            bits &= roi[y * frame.tiles_x + tile_x(tile)];
        }
        mask[mask_index(tile, row)] = bits;
        lit[mask_index(tile, row)] = bits;
        for (var some = u32(bits != 0u); some > 0u; some--) {
            stamps[tile_index(tile)] = 2u;
        }
    }
}
