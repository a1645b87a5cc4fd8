// In: the thinned mask of the lit tiles. Out: the same without the pixels on the picture's border, whose profile is
// cut off.
// Frame and unit: pixels. Twin and reasons: src/stages/stripe/border.rs.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read_write> mask: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let tile = list[id.x];
        var columns = 0xffffffffu;
        if tile_x(tile) == 0u {
            columns &= ~1u;
        }
        if tile_x(tile) == (frame.width - 1u) / 32u {
            columns &= ~(1u << ((frame.width - 1u) % 32u));
        }
        for (var row = 0u; row < 8u; row++) {
            let y = 8u * tile_y(tile) + row;
            mask[mask_index(tile, row)] &= select(columns, 0u, y == 0u || y == frame.height - 1u);
        }
    }
}
