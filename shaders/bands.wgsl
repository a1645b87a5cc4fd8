// In: the block statistics. Out: per block what its column of blocks gives to a window around it: the least sum of
// the window's rows over the block's width, beside the block's own largest pixel; the least sum over one column
// of pixels of the rows that every window covers, beside the smallest pixel and the smallest quad of the others.
// Rows of blocks up to `full` away are covered whole by the window of every pixel of the block; the `rest` rows that
// remain come from those up to `reach`. Blocks above and below the picture repeat its border. Four rows of tiles an
// invocation share their loads.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> stats: array<vec4<u32>>;
// Of both blocks of a tile: (sum | largest << 23, column | smallest << 15 | half quad << 23)
@group(0) @binding(2) var<storage, read_write> bands: array<vec4<u32>>;

// Half the window's edge, less a half: a constant, so that the loop over the blocks near is written out.
override radius: u32 = 15u;

const NONE = vec4(0xffffffffu);

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let strips = (frame.tiles_y + 3u) / 4u;
    let i = min(id.x, frame.tiles_x * strips * frame.shots - 1u);
    let strip = divide(i, frame.tiles_x);
    let x = i - strip * frame.tiles_x;
    let shot = divide(strip, strips);
    let y = i32(4u * (strip - shot * strips));
    let last = i32(frame.tiles_y) - 1;
    let first = shot * frame.tiles_y;
    let r = i32(radius);
    let full = select(-1, (r - 7) / 8, r >= 7);
    let reach = (r + 7) / 8;
    let rest = vec4(u32(2 * r + 1 - select(0, 8 * (2 * full + 1), full >= 0)));
    // One component a row of tiles; a is the left block of the tiles, b the right one.
    var sum_a = vec4(0u);
    var sum_b = vec4(0u);
    var columns_a = vec4(0u);
    var columns_b = vec4(0u);
    var row_a = NONE;
    var row_b = NONE;
    var least_a = NONE;
    var least_b = NONE;
    var quad_a = NONE;
    var quad_b = NONE;
    var largest_a = vec4(0u);
    var largest_b = vec4(0u);
    for (var dy = -reach; dy < 4 + reach; dy++) {
        let cy = clamp(y + dy, 0, last);
        let s = stats[(first + u32(cy)) * frame.tiles_x + x];
        let beyond = y + dy != cy;
        let small = s.xz >> vec2(24u);
        let row = s.yw & vec2(0xfffu);
        let sum = select(s.xz & vec2(0x7fffu), row << vec2(3u), beyond);
        let column = select((s.yw >> vec2(12u)) & vec2(0x7ffu), small << vec2(3u), beyond);
        let quad = select(s.yw >> vec2(23u), small << vec2(1u), beyond);
        let largest = (s.xz >> vec2(15u)) & vec2(511u);
        let away = abs(vec4(dy) - vec4(0, 1, 2, 3));
        let whole = away <= vec4(full);
        let part = away <= vec4(reach) & !whole;
        sum_a += select(vec4(0u), vec4(sum.x), whole);
        sum_b += select(vec4(0u), vec4(sum.y), whole);
        columns_a += select(vec4(0u), vec4(column.x), whole);
        columns_b += select(vec4(0u), vec4(column.y), whole);
        row_a = min(row_a, select(NONE, vec4(row.x), part));
        row_b = min(row_b, select(NONE, vec4(row.y), part));
        least_a = min(least_a, select(NONE, vec4(small.x), part));
        least_b = min(least_b, select(NONE, vec4(small.y), part));
        quad_a = min(quad_a, select(NONE, vec4(quad.x), part));
        quad_b = min(quad_b, select(NONE, vec4(quad.y), part));
        largest_a = select(largest_a, vec4(largest.x), away == vec4(0));
        largest_b = select(largest_b, vec4(largest.y), away == vec4(0));
    }
    sum_a = (sum_a + rest * row_a) | (largest_a << vec4(23u));
    sum_b = (sum_b + rest * row_b) | (largest_b << vec4(23u));
    columns_a |= (least_a << vec4(15u)) | (quad_a << vec4(23u));
    columns_b |= (least_b << vec4(15u)) | (quad_b << vec4(23u));
    // Invocations beyond the end repeat the last one.
    let at = (first + u32(y)) * frame.tiles_x + x;
    bands[at] = vec4(sum_a.x, columns_a.x, sum_b.x, columns_b.x);
    for (var k = 1; k <= min(3, last - y); k++) {
        bands[at + u32(k) * frame.tiles_x] = vec4(sum_a[k], columns_a[k], sum_b[k], columns_b[k]);
    }
}
