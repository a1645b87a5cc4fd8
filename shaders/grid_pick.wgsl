// In: span and sums of each cell. Out: the sums of one surface. If the cell has one surface, that is both halves, else
// the half with more points, the upper one in a tie. Twin and reasons: src/stages/grid.rs. Frame and unit: integer
// steps.
@group(0) @binding(0) var<uniform> frame: GridFrame;
@group(0) @binding(1) var<storage, read> span: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> layers: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> cells: array<vec4<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.y * 65535u * 64u + id.x;
    if i < frame.width * frame.height {
        let s = span[i];
        let two = i32(s.y + s.x) - 65536 > frame.layer_steps;
        let below = layers[2u * i];
        let above = layers[2u * i + 1u];
        cells[i] = select(below + above, select(above, below, below.x > above.x), two);
    }
}
