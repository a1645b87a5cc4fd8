// In: nothing. Out: an empty list of the strongest peaks, one entry for each line across the stripe and each shot.
// Frame and unit: bits of positive amplitudes in grey levels, which sort as whole numbers.
@group(0) @binding(0) var<uniform> frame: PeakFrame;
@group(0) @binding(1) var<storage, read_write> strongest: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < frame.entries {
        strongest[id.x] = 0u;
    }
}
