// In: slopes of one pyramid level in whole numbers, 64 = the threshold. Out: one bit for each cell, at the nearest of
// 16 directions; 0 below the threshold or if the slope is unknown (docs/math.md, Shape matching (2)). Frame and unit:
// cells of the level, x right, y down; bit k = direction k * 22.5 degrees from x towards y.
@group(0) @binding(0) var<uniform> frame: ShapeFrame;
@group(0) @binding(1) var<storage, read> slopes: array<u32>;
@group(0) @binding(2) var<storage, read_write> bits: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < frame.width * frame.height {
        let word = slopes[id.x];
        // Sign-extended halves of the word; at most 8191 each, so that no product below overflows.
        let gx = i32(word << 16u) >> 16u;
        let gy = i32(word) >> 16u;
        let ax = abs(gx);
        let ay = abs(gy);
        let small = min(ax, ay);
        let large = max(ax, ay);
        // tan(11.25 degrees) and tan(33.75 degrees), in units of 1 / 65536, separate the directions of an octant.
        let within = u32(small * 65536 > 13036 * large) + u32(small * 65536 > 43790 * large);
        let quarter = select(within, 4u - within, ax < ay);
        let half = select(quarter, 8u - quarter, gx < 0);
        let whole = select(half, (16u - half) % 16u, gy < 0);
        bits[id.x] = select(0u, 1u << whole, gx * gx + gy * gy >= 4096);
    }
}
