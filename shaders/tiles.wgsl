// In: the block statistics. Out: the tiles (32 x 8) that may contain a lit pixel. Tiles that stand alone are listed
// with the least sum of the windows around their pixels. Longer runs have up to four tiles, one below the other. The
// number of all tiles is counted. A run never crosses from one group of four rows of tiles to the next.
// For every block, the blocks near it give a lower bound on the window sums around all of its pixels. The bound
// consists of the sums of the whole blocks that every window covers, and of smallest rows, columns and quads for the
// rest. If even the block's largest pixel does not pass against that bound, none of its pixels can pass against its
// true mean: the block is proven dark. Blocks beyond the picture repeat its border. One invocation handles four tiles,
// which share their loads.
@group(0) @binding(0) var<uniform> frame: Frame;
// The two blocks of a tile, two words each.
@group(0) @binding(1) var<storage, read> stats: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> roi: array<vec4<u32>>;
// Only the count is used.
@group(0) @binding(3) var<storage, read_write> listing: Listing;
@group(0) @binding(4) var<storage, read_write> single_listing: Listing;
// (tile, least sum in 256ths of full scale)
@group(0) @binding(5) var<storage, read_write> singles: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> run_listing: Listing;
// (first tile, number of tiles)
@group(0) @binding(7) var<storage, read_write> runs: array<vec2<u32>>;

// The window's edge is 2 radius + 1. A constant, so that the compiled code has no rows that no window reaches.
override radius: u32 = 15u;
// 1: the window has weights. Then only the smallest pixel bounds its mean, and every tile is listed as standing alone.
override weighted: u32 = 0u;

const NONE = vec4(0xffffffffu);
const ROWS = vec4(0, 1, 2, 3);

// How the windows of all pixels of a block cover blocks of `edge` pixels, along one axis. Blocks up to `full` away are
// covered whole. `rest` more pixels lie in the blocks beyond them, up to `reach` away.
fn full(edge: i32) -> i32 {
    let r = i32(radius);
    return select(-1, (r - edge + 1) / edge, r >= edge - 1 && weighted == 0u);
}
fn reach(edge: i32) -> i32 {
    return (i32(radius) + edge - 1) / edge;
}
fn rest(edge: i32) -> u32 {
    return 2u * radius + 1u - u32(select(0, edge * (2 * full(edge) + 1), full(edge) >= 0));
}

// Contribution of a column of blocks to the windows around four of its blocks, one component for each. For blocks that
// the windows cover whole: the sum of their sums, and of their smallest columns. For blocks covered in part: the
// smallest row, pixel and half quad.
struct Band {
    sum: vec4<u32>,
    column: vec4<u32>,
    row: vec4<u32>,
    smallest: vec4<u32>,
    quad: vec4<u32>,
}
const EMPTY = Band(vec4(0u), vec4(0u), NONE, NONE, NONE);

// Adds a block that is `dy` rows of blocks below the first of the four; its words are as in `stats`.
fn more(b: Band, block: vec2<u32>, dy: i32, beyond: bool) -> Band {
    let smallest = block.x >> 24u;
    let row = block.y & 0xfffu;
    let sum = select(block.x & 0x7fffu, row << 3u, beyond);
    let column = select((block.y >> 12u) & 0x7ffu, smallest << 3u, beyond);
    let quad = select(block.y >> 23u, smallest << 1u, beyond);
    let away = abs(vec4(dy) - ROWS);
    let whole = away <= vec4(full(8));
    let part = away <= vec4(reach(8)) & !whole;
    return Band(
        b.sum + select(vec4(0u), vec4(sum), whole),
        b.column + select(vec4(0u), vec4(column), whole),
        min(b.row, select(NONE, vec4(row), part)),
        min(b.smallest, select(NONE, vec4(smallest), part)),
        min(b.quad, select(NONE, vec4(quad), part)),
    );
}

// Four tiles, one below the other: the column of tiles, the row of the first tile in its shot, the shot's first row of
// tiles and its last row.
struct Strip {
    x: i32,
    y: i32,
    first: u32,
    last: i32,
}

// The bands of a column of tiles: of its left and its right blocks.
struct Bands {
    left: Band,
    right: Band,
}
// Adds one row of blocks of the column of tiles `x`; if it lies beyond the picture, the border's blocks repeat.
fn add_row(bands: ptr<function, Bands>, strip: Strip, x: i32, dy: i32) {
    let y = strip.y + dy;
    let near_x = clamp(x, 0, i32(frame.tiles_x) - 1);
    let near_y = clamp(y, 0, strip.last);
    let s = stats[(strip.first + u32(near_y)) * frame.tiles_x + u32(near_x)];
    (*bands).left = more((*bands).left, select(s.xy, s.zw, x > near_x), dy, y != near_y);
    (*bands).right = more((*bands).right, select(s.zw, s.xy, x < near_x), dy, y != near_y);
}

// Contribution of the columns of blocks near a block to the windows around it, for four blocks below each other at
// once.
struct Near {
    sum: vec4<u32>,
    column: vec4<u32>,
    smallest: vec4<u32>,
    quad: vec4<u32>,
}
const NOTHING = Near(vec4(0u), NONE, NONE, NONE);
fn join(n: Near, b: Band, away: i32, beyond: bool) -> Near {
    let whole = vec4(away <= full(16));
    let part = vec4(away <= reach(16)) & !whole;
    // Beyond the border the block's smallest column repeats sixteen times, and its smallest pixel four times.
    let column = b.column + rest(8) * b.smallest;
    let sum = select(b.sum + rest(8) * b.row, column << vec4(4u), vec4(beyond));
    let quad = select(b.quad, b.smallest << vec4(1u), vec4(beyond));
    return Near(
        n.sum + select(vec4(0u), sum, whole),
        min(n.column, select(NONE, b.column, part)),
        min(n.smallest, select(NONE, b.smallest, part)),
        min(n.quad, select(NONE, quad, part)),
    );
}

// Contributions to the windows around both blocks of a tile.
struct Around {
    left: Near,
    right: Near,
}
// Adds the column of tiles `dx` beside the strip. Its rows, and the columns, are unrolled by hand: Mesa does not unroll
// the loop, and half of this is constant. Rows and columns that no window reaches are excluded at the call, before Mesa
// sees them (decision 0015). A radius of 50 reaches 7 rows of blocks and 2 columns of tiles.
fn add_column(around: ptr<function, Around>, strip: Strip, dx: i32) {
    let x = strip.x + dx;
    var bands = Bands(EMPTY, EMPTY);
    add_row(&bands, strip, x, 0);
    add_row(&bands, strip, x, 1);
    add_row(&bands, strip, x, 2);
    add_row(&bands, strip, x, 3);
    if radius > 0u {
        add_row(&bands, strip, x, -1);
        add_row(&bands, strip, x, 4);
    }
    if radius > 8u {
        add_row(&bands, strip, x, -2);
        add_row(&bands, strip, x, 5);
    }
    if radius > 16u {
        add_row(&bands, strip, x, -3);
        add_row(&bands, strip, x, 6);
    }
    if radius > 24u {
        add_row(&bands, strip, x, -4);
        add_row(&bands, strip, x, 7);
    }
    if radius > 32u {
        add_row(&bands, strip, x, -5);
        add_row(&bands, strip, x, 8);
    }
    if radius > 40u {
        add_row(&bands, strip, x, -6);
        add_row(&bands, strip, x, 9);
    }
    if radius > 48u {
        add_row(&bands, strip, x, -7);
        add_row(&bands, strip, x, 10);
    }
    let beyond = x < 0 || x >= i32(frame.tiles_x);
    (*around).left = join((*around).left, bands.left, abs(2 * dx), beyond);
    (*around).left = join((*around).left, bands.right, abs(2 * dx + 1), beyond);
    (*around).right = join((*around).right, bands.left, abs(2 * dx - 1), beyond);
    (*around).right = join((*around).right, bands.right, abs(2 * dx), beyond);
}

// The least sum of the windows around four blocks.
fn least_sum(n: Near) -> vec4<u32> {
    // The area covered in part in both directions contains this many whole quads, on both sides together.
    let quads = ((rest(16) - 1u) / 2u) * ((rest(8) - 1u) / 2u);
    let singles = rest(16) * rest(8) - 4u * quads;
    let sum = n.sum + rest(16) * n.column + 2u * quads * n.quad + singles * n.smallest;
    return select(sum, frame.size * frame.size * n.smallest, vec4(weighted != 0u));
}

// Blocks whose largest pixel may pass against that sum. The largest pixel is in the first word of the statistics.
fn passes(words: vec4<u32>, sum: vec4<u32>) -> vec4<bool> {
    let area = i32(frame.size * frame.size);
    let deep = vec4(depth_shift());
    let largest = vec4<i32>(((words >> vec4(15u)) & vec4(511u)) << deep);
    let limit = vec4<i32>(sum << deep) + select((area - 1) / 2, 0, weighted != 0u);
    return (area * (largest - frame.offset) > limit) & (largest >= vec4(i32(frame.minimum)));
}

fn places_of(lit: vec4<bool>) -> u32 {
    let bits = select(vec4(0u), vec4(1u, 2u, 4u, 8u), lit);
    return (bits.x | bits.y) | (bits.z | bits.w);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let strips = (frame.tiles_y + 3u) / 4u;
    if id.x < frame.tiles_x * strips * frame.shots {
        let row = divide(id.x, frame.tiles_x);
        let x = id.x - row * frame.tiles_x;
        let shot = divide(row, strips);
        let y = 4u * (row - shot * strips);
        let last = i32(frame.tiles_y) - 1;
        let strip = Strip(i32(x), i32(y), shot * frame.tiles_y, last);
        var around = Around(NOTHING, NOTHING);
        add_column(&around, strip, -1);
        add_column(&around, strip, 0);
        add_column(&around, strip, 1);
        if radius > 32u {
            add_column(&around, strip, -2);
            add_column(&around, strip, 2);
        }
        let rows = min(vec4(i32(y)) + ROWS, vec4(last));
        let places = (vec4(strip.first) + vec4<u32>(rows)) * frame.tiles_x + x;
        let s0 = stats[places.x];
        let s1 = stats[places.y];
        let s2 = stats[places.z];
        let s3 = stats[places.w];
        let sum_left = least_sum(around.left);
        let sum_right = least_sum(around.right);
        let least = min(sum_left, sum_right);
        var lit = passes(vec4(s0.x, s1.x, s2.x, s3.x), sum_left) | passes(vec4(s0.z, s1.z, s2.z, s3.z), sum_right);
        // The plain path uses no bound: it lists all tiles.
        let all = (frame.flags & ALL_TILES) != 0u;
        lit |= vec4(all);
        lit &= vec4(i32(y)) + ROWS <= vec4(last);
        var left = places_of(lit);
        if (frame.flags & HAS_ROI) != 0u {
            var wanted = vec4(false);
            for (var k = 0u; k < 4u; k++) {
                let at = 2u * (u32(rows[k]) * frame.tiles_x + x);
                wanted[k] = any((roi[at] | roi[at + 1u]) != vec4(0u));
            }
            left &= places_of(wanted);
        }
        if left != 0u {
            atomicAdd(&listing.count, countOneBits(left));
        }
        while left != 0u {
            let lowest = left & (0u - left);
            let run = select(left & ~(left + lowest), lowest, weighted != 0u);
            left ^= run;
            let length = countOneBits(run);
            let k = countTrailingZeros(lowest);
            let tile = tile_pack(x, y + k, shot);
            let alone = weighted != 0u || (length == 1u && !all);
            if alone {
                let slot = atomicAdd(&single_listing.count, 1u);
                singles[slot] = vec2(tile, least[k]);
                if slot % 64u == 0u {
                    atomicAdd(&single_listing.groups, 1u);
                }
            }
            if !alone {
                let slot = atomicAdd(&run_listing.count, 1u);
                runs[slot] = vec2(tile, length);
                if slot % 64u == 0u {
                    atomicAdd(&run_listing.groups, 1u);
                }
            }
        }
    }
}
