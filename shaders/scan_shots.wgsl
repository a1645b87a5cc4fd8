// In: lit pixels per row of tiles. Out: how many lie before each row in the batch, and the header: the
// arguments of a dispatch over all points, totals, and where each shot's points begin.
// header: 0..2 workgroups of 64 points, 3 points kept, 4 points found, 5 listed tiles, 6 how many of the shortened
// lists still held a tile, 7 shots, 8.. first point of every shot and the end.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> rows: array<u32>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
@group(0) @binding(3) var<storage, read> shortened: array<u32>;
@group(0) @binding(4) var<storage, read_write> row_starts: array<u32>;
@group(0) @binding(5) var<storage, read_write> header: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let shot = min(id.x, frame.shots - 1u);
    var sum = 0u;
    let end = shot * frame.tiles_y;
    for (var y = 0u; y < end; y += 4u) {
        let some = vec4(rows[y], rows[y + 1u], rows[y + 2u], rows[y + 3u]);
        let inside = select(vec4(0u), some, vec4(y) + vec4(0u, 1u, 2u, 3u) < vec4(end));
        sum += (inside.x + inside.y) + (inside.z + inside.w);
    }
    let before = min(sum, frame.capacity);
    for (var y = 0u; y < frame.tiles_y; y++) {
        let at = shot * frame.tiles_y + y;
        row_starts[at] = sum;
        sum += rows[at];
    }
    if id.x < frame.shots {
        header[8u + shot] = before;
        if shot + 1u == frame.shots {
            let kept = min(sum, frame.capacity);
            header[0] = (kept + 63u) / 64u;
            header[1] = 1u;
            header[2] = 1u;
            header[3] = kept;
            header[4] = sum;
            header[5] = listing[3];
            header[6] = 0u;
            for (var list = 0u; 64u * list < arrayLength(&shortened); list++) {
                header[6] += select(0u, 1u, shortened[64u * list + 3u] > 0u);
            }
            header[7] = frame.shots;
            header[9u + shot] = kept;
        }
    }
}
