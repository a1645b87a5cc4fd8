// In: the skeleton. Out: a copy of its listed tiles, to which pixels are added. Frame and unit: one bit per pixel.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> mask: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> long: array<vec4<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let at = tile_index(list[id.x]);
        long[2u * at] = mask[2u * at];
        long[2u * at + 1u] = mask[2u * at + 1u];
    }
}
