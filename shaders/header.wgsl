// In: lit pixels per shot. Out: the point list's header: the arguments of a dispatch over all points, totals, and where
// each shot's points begin.
// header: 0..2 workgroups of 64 points, 3 points kept, 4 points found, 5 listed tiles, 6 how many of the shortened
// lists still held a tile, 7 shots, 8.. first point of every shot and the end.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> totals: array<u32>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
@group(0) @binding(3) var<storage, read> shortened: array<u32>;
@group(0) @binding(4) var<storage, read_write> header: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let shot = id.x;
    if shot < frame.shots {
        var sum = 0u;
        for (var before = 0u; before < shot; before++) {
            sum += totals[before];
        }
        header[8u + shot] = min(sum, frame.capacity);
        if shot + 1u == frame.shots {
            sum += totals[shot];
            let kept = min(sum, frame.capacity);
            header[0] = (kept + 63u) / 64u;
            header[1] = 1u;
            header[2] = 1u;
            header[3] = kept;
            header[4] = sum;
            header[5] = listing[3];
            var left = 0u;
            for (var list = 0u; 64u * list < arrayLength(&shortened); list++) {
                left += select(0u, 1u, shortened[64u * list + 3u] > 0u);
            }
            header[6] = left;
            header[7] = frame.shots;
            header[9u + shot] = kept;
        }
    }
}
