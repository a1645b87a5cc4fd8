// In: the lists' headers of the former batch. Out: empty lists, from entry `step` on; entries are 64
// words apart and take turns between two buffers, because no buffer can be both read for the size of a
// dispatch and written by it.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read_write> even: array<u32>;
@group(0) @binding(2) var<storage, read_write> odd: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    for (var inside = u32(id.x >= frame.step && 64u * id.x < arrayLength(&even)); inside > 0u; inside--) {
        even[64u * id.x] = 0u;
        even[64u * id.x + 1u] = 1u;
        even[64u * id.x + 2u] = 1u;
        even[64u * id.x + 3u] = 0u;
    }
    for (var inside = u32(64u * id.x < arrayLength(&odd)); inside > 0u; inside--) {
        odd[64u * id.x] = 0u;
        odd[64u * id.x + 1u] = 1u;
        odd[64u * id.x + 2u] = 1u;
        odd[64u * id.x + 3u] = 0u;
    }
}
