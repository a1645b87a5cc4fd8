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

// Statistics of block (x, y) of a shot; a block outside the picture repeats the border's pixels.
fn block(x: i32, y: i32, shot: u32) -> vec4<u32> {
    let blocks_x = i32(2u * frame.tiles_x);
    let blocks_y = i32(frame.tiles_y);
    let cx = clamp(x, 0, blocks_x - 1);
    let cy = clamp(y, 0, blocks_y - 1);
    let s = stats[(i32(shot) * blocks_y + cy) * blocks_x + cx];
    let least = s.y >> 16u;
    let beside = x != cx;
    let above = y != cy;
    let sum = select(select(s.x, 16u * s.w, beside), select(8u * s.z, 128u * least, beside), above);
    let row = select(s.z, 16u * least, beside);
    let column = select(s.w, 8u * least, above);
    return vec4(sum, s.y, row, column);
}

// Lower bound on the sum of every window whose centre lies in the block.
fn bound(x: i32, y: i32, shot: u32, go: bool) -> u32 {
    let r = i32(frame.size / 2u);
    let n = i32(frame.size);
    // Blocks up to full_* away are covered whole by every such window, blocks up to reach_* in part.
    let full_x = select(-1, (r - 15) / 16, r >= 15);
    let full_y = select(-1, (r - 7) / 8, r >= 7);
    let reach_x = (r + 15) / 16;
    let reach_y = (r + 7) / 8;
    let rest_x = u32(n - 16 * (2 * full_x + 1) * i32(full_x >= 0));
    let rest_y = u32(n - 8 * (2 * full_y + 1) * i32(full_y >= 0));
    var sum = 0u;
    for (var dx = -full_x; dx <= select(-full_x - 1, full_x, go); dx++) {
        for (var dy = -full_y; dy <= full_y; dy++) {
            sum += block(x + dx, y + dy, shot).x;
        }
        var row = 0xffffffffu;
        for (var dy = full_y + 1; dy <= reach_y; dy++) {
            row = min(row, min(block(x + dx, y + dy, shot).z, block(x + dx, y - dy, shot).z));
        }
        sum += rest_y * row;
    }
    for (var dy = -full_y; dy <= select(-full_y - 1, full_y, go); dy++) {
        var column = 0xffffffffu;
        for (var dx = full_x + 1; dx <= reach_x; dx++) {
            column = min(column, min(block(x + dx, y + dy, shot).w, block(x - dx, y + dy, shot).w));
        }
        sum += rest_x * column;
    }
    var least = 0xffffu;
    for (var dy = full_y + 1; dy <= select(full_y, reach_y, go); dy++) {
        for (var dx = full_x + 1; dx <= reach_x; dx++) {
            let a = min(block(x + dx, y + dy, shot).y, block(x - dx, y + dy, shot).y);
            let b = min(block(x + dx, y - dy, shot).y, block(x - dx, y - dy, shot).y);
            least = min(least, min(a, b) >> 16u);
        }
    }
    return sum + rest_x * rest_y * least;
}

// Smallest pixel of all blocks that a window can touch: bounds any weighted mean.
fn darkest(x: i32, y: i32, shot: u32, go: bool) -> u32 {
    let r = i32(frame.size / 2u);
    let reach_x = (r + 15) / 16;
    let reach_y = (r + 7) / 8;
    var least = 0xffffu;
    for (var dy = -reach_y; dy <= select(-reach_y - 1, reach_y, go); dy++) {
        for (var dx = -reach_x; dx <= reach_x; dx++) {
            least = min(least, block(x + dx, y + dy, shot).y >> 16u);
        }
    }
    return least;
}

fn may_be_lit(x: i32, y: i32, shot: u32, wanted: bool) -> bool {
    let largest = i32(block(x, y, shot).y & 0xffffu);
    let bright = wanted && largest >= i32(frame.minimum);
    let area = i32(frame.size * frame.size);
    if (frame.flags & 4u) != 0u {
        return bright && largest - frame.offset > i32(darkest(x, y, shot, bright));
    }
    return bright && area * (largest - frame.offset) > i32(bound(x, y, shot, bright)) + (area - 1) / 2;
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
    let lit = may_be_lit(i32(2u * x), i32(y), shot, inside && !all)
        || may_be_lit(i32(2u * x) + 1, i32(y), shot, inside && !all);
    for (var once = u32(inside && (lit || all)); once > 0u; once--) {
        let at = atomicAdd(&listing.count, 1u);
        list[at] = tile_pack(x, y, shot);
        for (var group = u32(at % 8u == 0u); group > 0u; group--) {
            atomicAdd(&listing.groups, 1u);
        }
    }
}
