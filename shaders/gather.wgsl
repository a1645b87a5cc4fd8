// In: the quads of the threshold. Out: the mask, one word a tile row, inside the picture and the region
// of interest only, twice: `mask` is thinned, `lit` stays. Tiles with a lit pixel are stamped as changed,
// so that thinning starts there.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> quads: array<u32>;
@group(0) @binding(4) var<storage, read> roi: array<u32>;
@group(0) @binding(5) var<storage, read_write> mask: array<u32>;
@group(0) @binding(6) var<storage, read_write> lit: array<u32>;
@group(0) @binding(7) var<storage, read_write> stamps: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x / 8u;
    let row = id.x % 8u;
    let tile = list[min(slot, max(listing[3], 1u) - 1u)];
    var bits = 0u;
    for (var q = 0u; q < 8u; q++) {
        bits |= ((quads[8u * slot + q] >> (4u * row)) & 15u) << (4u * q);
    }
    let y = 8u * tile_y(tile) + row;
    let columns = min(frame.width - 32u * tile_x(tile), 32u);
    bits &= 0xffffffffu >> (32u - columns);
    bits = select(0u, bits, y < frame.height);
    for (var region = frame.flags & 2u; region != 0u; region = 0u) {
        bits &= roi[y * frame.tiles_x + tile_x(tile)];
    }
    for (var once = u32(slot < listing[3]); once > 0u; once--) {
        mask[mask_index(tile, row)] = bits;
        lit[mask_index(tile, row)] = bits;
        for (var some = u32(bits != 0u); some > 0u; some--) {
            stamps[tile_index(tile)] = 2u;
        }
    }
}
