// In: the quads of the threshold. Out: the mask, one word for each row of a tile, only inside the picture and the
// region of interest. It is written twice: `mask` is thinned, `lit` stays. Also the list of the tiles that contain a
// lit pixel.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> quads: array<u32>;
@group(0) @binding(4) var<storage, read> roi: array<u32>;
@group(0) @binding(5) var<storage, read_write> mask: array<u32>;
@group(0) @binding(6) var<storage, read_write> lit: array<u32>;
@group(0) @binding(7) var<storage, read_write> lit_listing: Listing;
@group(0) @binding(8) var<storage, read_write> lit_list: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let tile = list[id.x].x;
        let columns = min(frame.width - 32u * tile_x(tile), 32u);
        var any_lit = 0u;
        for (var row = 0u; row < 8u; row++) {
            var bits = 0u;
            for (var q = 0u; q < 8u; q++) {
                bits |= ((quads[8u * id.x + q] >> (4u * row)) & 15u) << (4u * q);
            }
            bits &= 0xffffffffu >> (32u - columns);
            bits = select(0u, bits, 8u * tile_y(tile) + row < frame.height);
            if (frame.flags & HAS_ROI) != 0u {
                bits &= roi[8u * (tile_y(tile) * frame.tiles_x + tile_x(tile)) + row];
            }
            mask[mask_index(tile, row)] = bits;
            lit[mask_index(tile, row)] = bits;
            any_lit |= bits;
        }
        if any_lit != 0u {
            let place = atomicAdd(&lit_listing.count, 1u);
            lit_list[place] = tile;
            if place % 64u == 0u {
                atomicAdd(&lit_listing.groups, 1u);
            }
        }
    }
}
