// In: the block statistics. Out: the list of tiles (32 x 8) that may hold a lit pixel.
// For every block a lower bound on the window sums around all of its pixels is put together from the
// blocks near it: whole blocks that every window covers, and smallest rows, columns and pixels for
// the rest. Where even the block's largest pixel does not pass against that bound, none of its pixels
// can pass against its true mean: the block is proven dark.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> stats: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> roi: array<u32>;
@group(0) @binding(3) var<storage, read_write> listing: Listing;
@group(0) @binding(4) var<storage, read_write> list: array<u32>;

// What a column of blocks gives to a window: the least sum of the window's rows over one block's width, and
// the least sum of the window's rows over one column of pixels. Rows of blocks up to full_y away are covered
// whole by the window of every pixel of the block, the rest_y rows that remain come from those up to reach_y.
// Blocks outside the picture repeat the border's pixels.
fn column_bound(x: i32, y: i32, shot: u32, full_y: i32, reach_y: i32, rest_y: u32) -> vec2<u32> {
    let blocks_x = i32(2u * frame.tiles_x);
    let blocks_y = i32(frame.tiles_y);
    let cx = clamp(x, 0, blocks_x - 1);
    let beside = x != cx;
    let base = i32(shot) * blocks_y;
    var sum = 0u;
    var columns = 0u;
    var row = 0xffffffffu;
    var least = 0xffffffffu;
    for (var dy = -reach_y; dy <= reach_y; dy++) {
        let cy = clamp(y + dy, 0, blocks_y - 1);
        let s = stats[(base + cy) * blocks_x + cx];
        let above = y + dy != cy;
        let small = s.y >> 16u;
        let block_row = select(s.z, small << 4u, beside);
        let block_column = select(s.w, small << 3u, above);
        let block_sum = select(select(s.x, s.w << 4u, beside), block_row << 3u, above);
        let whole = abs(dy) <= full_y;
        sum += select(0u, block_sum, whole);
        columns += select(0u, block_column, whole);
        row = min(row, select(block_row, 0xffffffffu, whole));
        least = min(least, select(small, 0xffffffffu, whole));
    }
    return vec2(sum + rest_y * row, columns + rest_y * least);
}

// Lower bounds on the sums of all windows whose centre lies in the left, and in the right block of a tile.
fn bounds(x: i32, y: i32, shot: u32, go: bool) -> vec2<u32> {
    let r = i32(frame.size / 2u);
    let n = i32(frame.size);
    let full_x = select(-1, (r - 15) / 16, r >= 15);
    let full_y = select(-1, (r - 7) / 8, r >= 7);
    let reach_x = (r + 15) / 16;
    let reach_y = (r + 7) / 8;
    let rest_x = u32(n - select(0, 16 * (2 * full_x + 1), full_x >= 0));
    let rest_y = u32(n - select(0, 8 * (2 * full_y + 1), full_y >= 0));
    var sums = vec2(0u);
    var columns = vec2(0xffffffffu);
    for (var dx = -reach_x; dx <= select(-reach_x - 1, reach_x + 1, go); dx++) {
        let column = column_bound(x + dx, y, shot, full_y, reach_y, rest_y);
        let away = vec2(abs(dx), abs(dx - 1));
        let whole = away <= vec2(full_x);
        let part = away <= vec2(reach_x) & !whole;
        sums += select(vec2(0u), vec2(column.x), whole);
        columns = min(columns, select(vec2(0xffffffffu), vec2(column.y), part));
    }
    return sums + vec2(rest_x) * columns;
}

// Smallest pixel of all blocks that a window of the tile can touch: bounds any weighted mean.
fn darkest(x: i32, y: i32, shot: u32, go: bool) -> u32 {
    let r = i32(frame.size / 2u);
    let reach_x = (r + 15) / 16;
    let reach_y = (r + 7) / 8;
    let blocks_x = i32(2u * frame.tiles_x);
    let blocks_y = i32(frame.tiles_y);
    var least = 0xffffu;
    for (var dy = -reach_y; dy <= select(-reach_y - 1, reach_y, go); dy++) {
        let row = (i32(shot) * blocks_y + clamp(y + dy, 0, blocks_y - 1)) * blocks_x;
        for (var dx = -reach_x; dx <= reach_x + 1; dx++) {
            least = min(least, stats[row + clamp(x + dx, 0, blocks_x - 1)].y >> 16u);
        }
    }
    return least;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let tiles = frame.tiles_x * frame.tiles_y * frame.shots;
    let i = min(id.x, tiles - 1u);
    let row = i / frame.tiles_x;
    let shot = row / frame.tiles_y;
    let y = row - shot * frame.tiles_y;
    let x = i - row * frame.tiles_x;
    var wanted = 0u;
    for (var r = 0u; r < select(0u, 8u, (frame.flags & 2u) != 0u); r++) {
        wanted |= roi[(8u * y + r) * frame.tiles_x + x];
    }
    let inside = id.x < tiles && (wanted != 0u || (frame.flags & 2u) == 0u);
    let all = (frame.flags & 1u) != 0u;
    let gaussian = (frame.flags & 4u) != 0u;
    let block = row * 2u * frame.tiles_x + 2u * x;
    let largest = vec2<i32>(vec2(stats[block].y, stats[block + 1u].y) & vec2(0xffffu));
    let bright = largest >= vec2(i32(frame.minimum));
    let go = inside && !all && any(bright);
    let area = i32(frame.size * frame.size);
    let mean = vec2<i32>(bounds(i32(2u * x), i32(y), shot, go && !gaussian)) + vec2((area - 1) / 2);
    let over_mean = area * (largest - vec2(frame.offset)) > mean;
    let over_any = largest - vec2(frame.offset) > vec2(i32(darkest(i32(2u * x), i32(y), shot, go && gaussian)));
    let lit = any(select(over_mean, over_any, vec2(gaussian)) & bright);
    for (var once = u32(inside && (lit || all)); once > 0u; once--) {
        let at = atomicAdd(&listing.count, 1u);
        list[at] = tile_pack(x, y, shot);
        for (var group = u32(at % 8u == 0u); group > 0u; group--) {
            atomicAdd(&listing.groups, 1u);
        }
    }
}
