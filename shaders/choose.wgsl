// In: peaks and the strongest of each line across the stripe. Out: the reason of those that are weak beside another:
// echoes, and spots cut by an edge. Twin and reasons: src/stages/choose.rs. Frame and unit: pixels, grey levels.
@group(0) @binding(0) var<uniform> frame: PeakFrame;
@group(0) @binding(1) var<storage, read> header: array<u32>;
@group(0) @binding(2) var<storage, read> strongest: array<u32>;
@group(0) @binding(3) var<storage, read_write> peaks: array<Peak>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < header[3] {
        let k = peaks[id.x];
        let along = i32(select(k.pixel >> 16u, k.pixel & 0xffffu, frame.columns != 0u) / frame.line_px);
        let low = max(along - frame.echo_reach, 0);
        let high = min(along + frame.echo_reach, i32(frame.lines) - 1);
        var bits = 0u;
        for (var i = low; i <= high; i++) {
            bits = max(bits, strongest[k.shot * frame.lines + u32(i)]);
        }
        let top = bitcast<f32>(bits);
        let echo = k.amplitude < frame.echo * top;
        let cut = k.width_px < frame.cut_width && k.amplitude < frame.cut_amplitude * top;
        let why = select(select(0u, 3u, cut), 7u, echo);
        peaks[id.x].flags = select(k.flags, k.flags | why, (k.flags & 255u) == 0u);
    }
}
