// In: points of a cloud, the span of heights in each cell. Out: sums of the points below and above the middle of the
// span: count, height, intensity, sigma. Twin and reasons: src/stages/grid.rs. Frame and unit: integer steps.
@group(0) @binding(0) var<uniform> frame: GridFrame;
@group(0) @binding(1) var<storage, read> records: array<u32>;
@group(0) @binding(2) var<storage, read> span: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> layers: array<atomic<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < frame.points {
        let i = id.x * RECORD;
        let at = place(frame, vec3(records[i], records[i + 1u], records[i + 2u]), bitcast<i32>(records[i + 5u]));
        if at.y > 0u {
            let s = span[at.x];
            // Twice the height is compared with the sum of lowest and highest: 2 (at.y - 32768) > (32768 - s.x) + (s.y
            // - 32768).
            let above = u32(2 * (i32(at.y) - 32768) > i32(s.y) - i32(s.x));
            let to = 8u * at.x + 4u * above;
            atomicAdd(&layers[to], 1u);
            atomicAdd(&layers[to + 1u], bitcast<u32>(i32(at.y) - 32768));
            atomicAdd(&layers[to + 2u], u32(clamp(fixed(records[i + 4u], frame.intensity_places), 0, 65535)));
            atomicAdd(&layers[to + 3u], (u32(clamp(fixed(records[i + 3u], 16), 0, 429000)) * 10000u + 32768u) >> 16u);
        }
    }
}
