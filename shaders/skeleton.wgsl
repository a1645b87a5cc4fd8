// In: the thinned mask and the prefix sums of its counts. Out: its pixels as a list (x | y << 16, shot), ordered by
// tile and therefore always the same, cut at the list's capacity.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> mask: array<u32>;
@group(0) @binding(4) var<storage, read> starts: array<u32>;
@group(0) @binding(5) var<storage, read> row_starts: array<u32>;
@group(0) @binding(6) var<storage, read> header: array<u32>;
@group(0) @binding(7) var<storage, read_write> pixels: array<vec2<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let tile = list[id.x];
        let shot = tile_shot(tile);
        var at = header[STARTS + shot] + row_starts[shot * frame.tiles_y + tile_y(tile)] + starts[tile_index(tile)];
        for (var row = 0u; row < 8u; row++) {
            var bits = mask[mask_index(tile, row)];
            let y = 8u * tile_y(tile) + row;
            while bits != 0u && at < frame.capacity {
                pixels[at] = vec2((32u * tile_x(tile) + countTrailingZeros(bits)) | (y << 16u), shot);
                bits &= bits - 1u;
                at += 1u;
            }
        }
    }
}
