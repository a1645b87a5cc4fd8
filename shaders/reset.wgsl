// In: the lists' headers of the previous batch. Out: empty lists. In a further round of thinning (step 1) the list of
// tiles that may be lit and the list of lit tiles stay. Headers are HEADER_WORDS apart. Those two lists have separate
// buffers, because no buffer can both give the size of a dispatch and be written by it.
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
