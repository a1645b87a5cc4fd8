// In: the tile list of the former batch. Out: what that batch wrote, zeroed; nothing else was.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read_write> mask: array<u32>;
@group(0) @binding(4) var<storage, read_write> other_mask: array<u32>;
@group(0) @binding(5) var<storage, read_write> lit: array<u32>;
@group(0) @binding(6) var<storage, read_write> stamps: array<u32>;
@group(0) @binding(7) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x / 8u;
    let row = id.x % 8u;
    for (var inside = u32(slot < listing[3]); inside > 0u; inside--) {
        let tile = list[slot];
        mask[mask_index(tile, row)] = 0u;
        other_mask[mask_index(tile, row)] = 0u;
        lit[mask_index(tile, row)] = 0u;
        stamps[tile_index(tile)] = 0u;
        counts[tile_index(tile)] = 0u;
    }
}
