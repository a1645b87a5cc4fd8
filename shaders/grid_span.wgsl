// In: points of a cloud. Out: the span of heights in each cell, as the largest height and the largest depth; 0 if the
// cell has no point. Maxima do not depend on order. Twin and reasons: src/stages/grid.rs. Frame and unit: integer
// height steps.
@group(0) @binding(0) var<uniform> frame: GridFrame;
@group(0) @binding(1) var<storage, read> records: array<u32>;
@group(0) @binding(2) var<storage, read_write> span: array<atomic<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < frame.points {
        let i = id.x * RECORD;
        let at = place(frame, vec3(records[i], records[i + 1u], records[i + 2u]), bitcast<i32>(records[i + 5u]));
        if at.y > 0u {
            atomicMax(&span[2u * at.x], 65536u - at.y);
            atomicMax(&span[2u * at.x + 1u], at.y);
        }
    }
}
