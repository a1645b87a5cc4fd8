// In: the stamps of a round of sub-iterations after which some tiles still change. Out: stamps of 0, with which another
// round begins.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read_write> stamps: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        stamps[tile_index(list[id.x])] = 0u;
    }
}
