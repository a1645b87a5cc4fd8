// In: nothing. Out: numbers that memory does not hold by accident.
@group(0) @binding(0) var<storage, read_write> words: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    words[id.x] = ((id.x + 1u) * 2654435761u) ^ 0x5bd1e995u;
}
