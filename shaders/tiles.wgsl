// In: the bands of block statistics. Out: the list of tiles (32 x 8) that may hold a lit pixel, and for every tile
// whether it is in it.
// For every block a lower bound on the window sums around all of its pixels is put together from the bands
// near it: whole blocks that every window covers, and smallest columns for the rest. Where even the block's
// largest pixel does not pass against that bound, none of its pixels can pass against its true mean: the
// block is proven dark.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> stats: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> bands: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> roi: array<u32>;
@group(0) @binding(4) var<storage, read_write> listed: array<u32>;
@group(0) @binding(5) var<storage, read_write> listing: Listing;
@group(0) @binding(6) var<storage, read_write> list: array<u32>;

// Half the window's edge, less a half: a constant, so that the loop over the blocks near is written out.
override radius: u32 = 15u;

// Lower bounds on the sums of all windows whose centre lies in the left, and in the right block of a tile,
// in 256ths of full scale. `row` is the first block of the tile's row of blocks.
fn bounds(row: u32, x: i32) -> vec2<u32> {
    let r = i32(radius);
    let last = i32(2u * frame.tiles_x) - 1;
    let full = select(-1, (r - 15) / 16, r >= 15);
    let reach = (r + 15) / 16;
    let rest = u32(2 * r + 1 - select(0, 16 * (2 * full + 1), full >= 0));
    let full_y = select(-1, (r - 7) / 8, r >= 7);
    let rest_y = u32(2 * r + 1 - select(0, 8 * (2 * full_y + 1), full_y >= 0));
    // What is covered in part in both directions holds, on both sides together, this many whole quads.
    let quads = ((rest - 1u) / 2u) * ((rest_y - 1u) / 2u);
    let singles = rest * rest_y - 4u * quads;
    var sums = vec2(0u);
    var columns = vec2(0xffffffffu);
    var least = vec2(0xffffffffu);
    var quad = vec2(0xffffffffu);
    for (var dx = -reach; dx <= reach + 1; dx++) {
        let cx = clamp(x + dx, 0, last);
        let band = bands[row + u32(cx)];
        let column = band.y & 0x7fffu;
        let small = (band.y >> 15u) & 0xffu;
        // Beyond the picture its border repeats: sixteen times the least column.
        let beyond = cx != x + dx;
        let sum = select(band.x & 0x7fffffu, (column + rest_y * small) << 4u, beyond);
        let four = select(band.y >> 23u, small << 1u, beyond);
        let away = vec2(abs(dx), abs(dx - 1));
        let whole = away <= vec2(full);
        let part = away <= vec2(reach) & !whole;
        sums += select(vec2(0u), vec2(sum), whole);
        columns = min(columns, select(vec2(0xffffffffu), vec2(column), part));
        least = min(least, select(vec2(0xffffffffu), vec2(small), part));
        quad = min(quad, select(vec2(0xffffffffu), vec2(four), part));
    }
    return sums + vec2(rest) * columns + vec2(2u * quads) * quad + vec2(singles) * least;
}

// Smallest pixel of all blocks that a window of the tile can touch: bounds any weighted mean.
fn darkest(x: i32, y: i32, shot: u32, go: bool) -> u32 {
    let r = i32(radius);
    let reach_x = (r + 15) / 16;
    let reach_y = (r + 7) / 8;
    let blocks_x = i32(2u * frame.tiles_x);
    let blocks_y = i32(frame.tiles_y);
    var least = 0xffu;
    for (var dy = -reach_y; dy <= select(-reach_y - 1, reach_y, go); dy++) {
        let row = (i32(shot) * blocks_y + clamp(y + dy, 0, blocks_y - 1)) * blocks_x;
        for (var dx = -reach_x; dx <= reach_x + 1; dx++) {
            least = min(least, stats[row + clamp(x + dx, 0, blocks_x - 1)].x >> 24u);
        }
    }
    return least;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let tiles = frame.tiles_x * frame.tiles_y * frame.shots;
    let i = min(id.x, tiles - 1u);
    let row = divide(i, frame.tiles_x);
    let shot = divide(row, frame.tiles_y);
    let y = row - shot * frame.tiles_y;
    let x = i - row * frame.tiles_x;
    var wanted = 0u;
    for (var r = 0u; r < select(0u, 8u, (frame.flags & 2u) != 0u); r++) {
        wanted |= roi[8u * (y * frame.tiles_x + x) + r];
    }
    let inside = wanted != 0u || (frame.flags & 2u) == 0u;
    let all = (frame.flags & 1u) != 0u;
    let gaussian = (frame.flags & 4u) != 0u;
    let deep = vec2(depth_shift());
    let largest = vec2<i32>(vec2(bands[2u * i].x >> 23u, bands[2u * i + 1u].x >> 23u) << deep);
    let bright = largest >= vec2(i32(frame.minimum));
    let go = inside && !all && any(bright);
    let area = i32(frame.size * frame.size);
    var sums = vec2(0u);
    for (var mean = u32(go && !gaussian); mean > 0u; mean--) {
        sums = bounds(2u * row * frame.tiles_x, i32(2u * x)) << deep;
    }
    let over_mean = area * (largest - vec2(frame.offset)) > vec2<i32>(sums) + vec2((area - 1) / 2);
    let least = darkest(i32(2u * x), i32(y), shot, go && gaussian) << deep.x;
    let over_any = largest - vec2(frame.offset) > vec2(i32(least));
    let lit = any(select(over_mean, over_any, vec2(gaussian)) & bright);
    // Invocations beyond the end repeat the last one: what they may not do is list it again.
    let listed_here = u32(inside && (lit || all));
    listed[i] = listed_here;
    for (var once = select(0u, listed_here, id.x < tiles); once > 0u; once--) {
        let at = atomicAdd(&listing.count, 1u);
        list[at] = tile_pack(x, y, shot);
        for (var group = u32(at % 64u == 0u); group > 0u; group--) {
            atomicAdd(&listing.groups, 1u);
        }
    }
}
