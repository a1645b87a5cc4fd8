// In: lit pixels per shot. Out: the header of the pixel list: the arguments of a dispatch over all pixels, totals, and
// the first entry of each shot.
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
        header[STARTS + shot] = min(sum, frame.capacity);
        if shot + 1u == frame.shots {
            sum += totals[shot];
            let kept = min(sum, frame.capacity);
            header[GROUPS] = (kept + 63u) / 64u;
            header[GROUPS_Y] = 1u;
            header[GROUPS_Z] = 1u;
            header[COUNT] = kept;
            header[FOUND] = sum;
            header[LISTED] = listing[COUNT];
            var left = 0u;
            for (var list = 0u; HEADER_WORDS * list < arrayLength(&shortened); list++) {
                left += select(0u, 1u, shortened[HEADER_WORDS * list + COUNT] > 0u);
            }
            header[LEFT] = left;
            header[SHOTS] = frame.shots;
            header[STARTS + shot + 1u] = kept;
        }
    }
}
