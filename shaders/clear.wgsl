// In: the list of lit tiles of the previous batch. Out: zeros in all that the previous batch wrote, which is only in
// these tiles.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read_write> mask: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> other_mask: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> lit: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> stamps: array<u32>;
@group(0) @binding(7) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let at = tile_index(list[id.x]);
        let none = vec4(0u);
        mask[2u * at] = none;
        mask[2u * at + 1u] = none;
        other_mask[2u * at] = none;
        other_mask[2u * at + 1u] = none;
        lit[2u * at] = none;
        lit[2u * at + 1u] = none;
        counts[at] = 0u;
        stamps[at] = 0u;
    }
}
