// In: peaks. Out: the reason of those that fail by themselves; the strongest of the others on each line across the
// stripe. Twin and reasons: src/stages/choose.rs. Frame and unit: pixels, grey levels.
@group(0) @binding(0) var<uniform> frame: PeakFrame;
@group(0) @binding(1) var<storage, read> header: array<u32>;
@group(0) @binding(2) var<storage, read_write> peaks: array<Peak>;
@group(0) @binding(3) var<storage, read_write> strongest: array<atomic<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < header[3] {
        let k = peaks[id.x];
        let across = k.normal_u * frame.across_u + k.normal_v * frame.across_v;
        // The first test that fails names the reason; the numbers are those of `Reject`.
        var why = 0u;
        why = select(why, 6u, abs(across) < frame.upright);
        why = select(why, 5u, !(k.sigma_px <= frame.uncertain));
        why = select(why, 4u, k.width_px > frame.widest);
        why = select(why, 3u, k.width_px < frame.narrowest);
        why = select(why, 2u, k.amplitude < frame.faintest);
        let flags = select(k.flags, k.flags | why, (k.flags & 255u) == 0u);
        peaks[id.x].flags = flags;
        let along = select(k.pixel >> 16u, k.pixel & 0xffffu, frame.columns != 0u) / frame.line_px;
        if (flags & 255u) == 0u {
            atomicMax(&strongest[k.shot * frame.lines + along], bitcast<u32>(k.amplitude));
        }
    }
}
