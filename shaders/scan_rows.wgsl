// In: lit pixels per tile. Out: for each tile the number of lit pixels before it in its row of tiles, and each row's
// total.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read_write> starts: array<u32>;
@group(0) @binding(3) var<storage, read_write> rows: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = frame.tiles_y * frame.shots;
    let row = min(id.x, n - 1u);
    var sum = 0u;
    for (var x = 0u; x < frame.tiles_x; x++) {
        let at = row * frame.tiles_x + x;
        starts[at] = sum;
        sum += counts[at];
    }
    if id.x < n {
        rows[row] = sum;
    }
}
