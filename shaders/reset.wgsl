// In: the lists' headers of the previous batch. Out: empty lists; at a further round of thinning (step 1)
// the lists of tiles that may be lit, and of those that are, stay. Headers are HEADER_WORDS apart. Each of those
// has a buffer of its own: no buffer can be both read for the size of a dispatch and written by it.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read_write> first: array<u32>;
@group(0) @binding(2) var<storage, read_write> lit_first: array<u32>;
@group(0) @binding(3) var<storage, read_write> runs: array<u32>;
@group(0) @binding(4) var<storage, read_write> others: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let empty = vec4(0u, 1u, 1u, 0u);
    if id.x < 4u && frame.step == 0u {
        first[id.x] = empty[id.x];
        first[HEADER_WORDS + id.x] = empty[id.x];
        runs[id.x] = empty[id.x];
        lit_first[id.x] = empty[id.x];
    }
    if HEADER_WORDS * id.x < arrayLength(&others) {
        others[HEADER_WORDS * id.x + GROUPS] = 0u;
        others[HEADER_WORDS * id.x + GROUPS_Y] = 1u;
        others[HEADER_WORDS * id.x + GROUPS_Z] = 1u;
        others[HEADER_WORDS * id.x + COUNT] = 0u;
    }
}
