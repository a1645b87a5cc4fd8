// In: the thinned mask and the tile list. Out: the number of lit pixels of every listed tile.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> mask: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let at = tile_index(list[id.x]);
        let ones = countOneBits(mask[2u * at]) + countOneBits(mask[2u * at + 1u]);
        counts[at] = (ones.x + ones.y) + (ones.z + ones.w);
    }
}
