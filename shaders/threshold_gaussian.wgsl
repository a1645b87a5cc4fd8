// In: pictures and a list of tiles, each a run of one. Out: as `threshold`, with Gaussian weights: first along the row,
// then down the rows, in f32, both in ascending order as in the twin.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
@group(0) @binding(3) var<storage, read> list: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read> weights: array<f32>;
@group(0) @binding(5) var<storage, read_write> quads: array<u32>;

fn blurred(first: u32, x: i32, r: i32) -> vec4<f32> {
    var sum = vec4(0.0);
    var next = vec4<f32>(vec4(pixel(first, x - r), pixel(first, x - r + 1), pixel(first, x - r + 2), pixel(first,
        x - r + 3)));
    for (var k = 0; k <= 2 * r; k++) {
        sum = sum + weights[k] * next;
        next = vec4(next.yzw, f32(pixel(first, x - r + k + 4)));
    }
    return sum;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let r = i32(frame.size / 2u);
    if id.x < listing[COUNT] {
        let tile = list[id.x].x;
        let shot = tile_shot(tile);
        let top = i32(8u * tile_y(tile));
        for (var q = 0u; q < 8u; q++) {
            let x = i32(32u * tile_x(tile) + 4u * q);
            // One accumulator for each row of the tile; each blurred row enters all the windows that contain it.
            var sums = array<vec4<f32>, 8>();
            for (var y = -r; y < 8 + r; y++) {
                let row = blurred(row_start(shot, top + y), x, r);
                for (var k = 0; k < 8; k++) {
                    let tap = y - k + r;
                    let within = tap >= 0 && tap <= 2 * r;
                    let weight = select(0.0, weights[clamp(tap, 0, 2 * r)], within);
                    sums[k] = sums[k] + weight * row;
                }
            }
            var bits = 0u;
            for (var k = 0; k < 8; k++) {
                let first = row_start(shot, top + k);
                for (var c = 0; c < 4; c++) {
                    let value = pixel(first, x + c);
                    let lit = i32(value) - frame.offset > i32(round(sums[k][c])) && value >= frame.minimum;
                    bits |= u32(lit) << u32(4 * k + c);
                }
            }
            quads[8u * id.x + q] = bits;
        }
    }
}
