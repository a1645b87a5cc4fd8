// In: pictures and one picture of the ambient light. Out: the pictures minus the ambient light, in place, never below
// 0. A saturated pixel stays saturated, because its true brightness is unknown.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read_write> image: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> ambient: array<vec4<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let words = frame.shot_words / 4u;
    let i = id.y * words + min(id.x, words - 1u);
    let v = image[i];
    let a = ambient[min(id.x, words - 1u)];
    let bits = 32u >> px_log2;
    let full = vec4(frame.full_scale);
    let mask = vec4((1u << bits) - 1u);
    var out = vec4(0u);
    for (var shift = 0u; shift < 32u; shift += bits) {
        let p = (v >> vec4(shift)) & mask;
        let q = (a >> vec4(shift)) & mask;
        out |= select(p - min(p, q), p, p >= full) << vec4(shift);
    }
    if id.x < words {
        image[i] = out;
    }
}
