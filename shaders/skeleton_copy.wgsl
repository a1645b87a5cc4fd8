// In: the skeleton. Out: its listed tiles once more, to be added to. Frame and unit: one bit a pixel.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> listing: array<u32>;
@group(0) @binding(2) var<storage, read> list: array<u32>;
@group(0) @binding(3) var<storage, read> mask: array<u32>;
@group(0) @binding(4) var<storage, read_write> long: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x / 8u;
    for (var inside = u32(slot < listing[3]); inside > 0u; inside--) {
        let at = mask_index(list[slot], id.x % 8u);
        long[at] = mask[at];
    }
}
