// Handles the tiles that stand alone in the list, each with the least sum of the windows around its pixels. A tile with
// one pixel that may pass against that sum is finished here, in both masks and the list of lit tiles. A tile with more
// such pixels becomes a run of one tile. In noise most listed tiles have one candidate, and one window's sum is half
// the work of the tile's.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
// (tile, least sum)
@group(0) @binding(3) var<storage, read> list: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read> roi: array<u32>;
@group(0) @binding(5) var<storage, read_write> mask: array<u32>;
@group(0) @binding(6) var<storage, read_write> lit: array<u32>;
@group(0) @binding(7) var<storage, read_write> lit_listing: Listing;
@group(0) @binding(8) var<storage, read_write> lit_list: array<u32>;
@group(0) @binding(9) var<storage, read_write> run_listing: Listing;
@group(0) @binding(10) var<storage, read_write> runs: array<vec2<u32>>;

// The window's edge is 2 radius + 1. A constant, so that the loops over a row are unrolled.
override radius: u32 = 15u;

// Loads that contain a row of a window, wherever it begins.
fn loads() -> u32 {
    return (2u * radius + 2u * per_load() - 1u) / per_load();
}

// Number of candidates, and sum of their positions in the tile: x + 32 y.
struct Candidates {
    count: vec4<u32>,
    place: vec4<u32>,
}

// Pixels of the tile with at least this brightness.
fn candidates(own: u32, top: i32, brightness: i32) -> Candidates {
    let last_row = i32(frame.height) - 1;
    let bits = 32u >> px_log2;
    var found = Candidates(vec4(0u), vec4(0u));
    for (var row = 0; row < 8; row++) {
        let first = own + u32(min(top + row, last_row)) * (frame.pitch / 4u);
        for (var i = 0u; i < 32u / per_load(); i++) {
            let v = image[first + i];
            for (var k = 0u; k < 1u << px_log2; k++) {
                let value = (v >> vec4(k * bits)) & vec4((1u << bits) - 1u);
                let x = vec4(i * per_load() + k) + vec4(0u, 1u, 2u, 3u) * vec4(1u << px_log2);
                let bright = vec4<i32>(value) >= vec4(brightness);
                found.count += select(vec4(0u), vec4(1u), bright);
                found.place += select(vec4(0u), x + vec4(32u * u32(row)), bright);
            }
        }
    }
    return found;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < listing[COUNT] {
        let single = list[id.x];
        let tile = single.x;
        let pitch = frame.pitch / 4u;
        let picture = tile_shot(tile) * (frame.shot_words / 4u);
        let area = frame.size * frame.size;
        // n^2 (value - offset) > sum + (n^2 - 1) / 2, as in `threshold`, with the least sum.
        let passing = i32(divide((single.y << depth_shift()) + (area - 1u) / 2u, area)) + frame.offset + 1;
        let own = picture + tile_x(tile) * (32u / per_load());
        let found = candidates(own, i32(8u * tile_y(tile)), max(passing, i32(frame.minimum)));
        let count = (found.count.x + found.count.y) + (found.count.z + found.count.w);
        let place = (found.place.x + found.place.y) + (found.place.z + found.place.w);
        if count > 1u {
            let slot = atomicAdd(&run_listing.count, 1u);
            runs[slot] = vec2(tile, 1u);
            if slot % 64u == 0u {
                atomicAdd(&run_listing.groups, 1u);
            }
        }
        // Without meaning if there is no candidate or more than one: then it is any pixel of the tile.
        let column = place & 31u;
        let row = (place >> 5u) & 7u;
        let x = i32(32u * tile_x(tile) + column);
        let y = i32(8u * tile_y(tile) + row);
        let r = i32(radius);
        let last_row = i32(frame.height) - 1;
        // Rounded down, also left of the picture.
        let first = (x - r) >> countTrailingZeros(per_load());
        clear_sums(loads());
        for (var dy = -r; dy <= r; dy++) {
            pass_row(picture + u32(clamp(y + dy, 0, last_row)) * pitch, first, loads(), 1u);
        }
        let begin = u32(x - r - first * i32(per_load()));
        let sum = sum_of_columns(begin, 2u * radius + 1u, loads());
        let word = image[own + u32(min(y, last_row)) * pitch + column / per_load()][(column % per_load()) >> px_log2];
        let bits = 32u >> px_log2;
        let value = (word >> ((column & ((1u << px_log2) - 1u)) * bits)) & ((1u << bits) - 1u);
        // A single candidate lies in the picture: beyond the border the border pixel repeats in the same tile and would
        // count too.
        var passes = count == 1u && i32(area) * (i32(value) - frame.offset) > i32(sum + (area - 1u) / 2u);
        let bit = 1u << column;
        if (frame.flags & HAS_ROI) != 0u {
            passes = passes && (roi[mask_word(0u, u32(x), u32(y))] & bit) != 0u;
        }
        if passes {
            let at = mask_index(tile, row);
            mask[at] = bit;
            lit[at] = bit;
            let slot = atomicAdd(&lit_listing.count, 1u);
            lit_list[slot] = tile;
            if slot % 64u == 0u {
                atomicAdd(&lit_listing.groups, 1u);
            }
        }
    }
}
