// In: skeleton pixels. Out: votes for straight lines: the number of pixels in each (angle, distance) cell. The sums are
// whole numbers and do not depend on order, so the votes are the same on every machine [duda72]. Frame and unit: pixels
// from the picture's middle, angles of the line's normal.
struct HoughFrame {
    // Half the picture's size, px.
    middle_x: i32,
    middle_y: i32,
    angles: u32,
    // Distance cells per angle, each one pixel wide; the middle one contains distance 0.
    cells: u32,
}
@group(0) @binding(0) var<uniform> frame: HoughFrame;
@group(0) @binding(1) var<storage, read> header: array<u32>;
@group(0) @binding(2) var<storage, read> pixels: array<vec2<u32>>;
// Cosine and sine of every angle in units of 1 / 16384.
@group(0) @binding(3) var<storage, read> table: array<vec2<i32>>;
@group(0) @binding(4) var<storage, read_write> votes: array<atomic<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < header[COUNT] {
        let point = pixels[id.x];
        let x = i32(point.x & 0xffffu) - frame.middle_x;
        let y = i32(point.x >> 16u) - frame.middle_y;
        let first = point.y * frame.angles;
        for (var k = 0u; k < frame.angles; k++) {
            let distance = (x * table[k].x + y * table[k].y + 8192) >> 14u;
            atomicAdd(&votes[(first + k) * frame.cells + u32(distance + i32(frame.cells / 2u))], 1u);
        }
    }
}
