// In: lit pixels per row of tiles. Out: the number of lit pixels before each row in its shot, and each shot's total.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> rows: array<u32>;
@group(0) @binding(2) var<storage, read_write> row_starts: array<u32>;
@group(0) @binding(3) var<storage, read_write> totals: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let shot = min(id.x, frame.shots - 1u);
    var sum = 0u;
    for (var y = 0u; y < frame.tiles_y; y++) {
        let at = shot * frame.tiles_y + y;
        row_starts[at] = sum;
        sum += rows[at];
    }
    if id.x < frame.shots {
        totals[shot] = sum;
    }
}
