// In: pictures, a list of runs of tiles. Out: the pixels brighter than the mean of the window around them, only inside
// the picture and the region of interest. They are written twice: `mask` is thinned, `lit` stays. Also the list of
// tiles that contain a lit pixel, on which all later stages work. One invocation per run: it carries the sums of the
// columns of its windows down the run's rows, four words of pixels per load. The radius is a constant of the pipeline,
// so that every index is constant too.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
// (first tile, number of tiles one below the other)
@group(0) @binding(3) var<storage, read> list: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read> roi: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> mask: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> lit: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> lit_listing: Listing;
@group(0) @binding(8) var<storage, read_write> lit_list: array<u32>;

// The window's edge is 2 radius + 1.
override radius: u32 = 15u;
// Loads on each side of the tile, and in total.
fn beside() -> u32 {
    return (radius + per_load() - 1u) / per_load();
}
fn loads() -> u32 {
    return 2u * beside() + 32u / per_load();
}

// The tile's own pixels of one row.
var<private> own: array<vec4<u32>, 4>;

// Sum of column c, counted from the first one loaded.
fn column(c: u32) -> u32 {
    let pair = sums[2u * (c / per_load()) + (c & 1u)];
    let word = pair[(c % per_load()) >> px_log2];
    return select(word, (word >> (8u * (c & 2u))) & 0xffffu, px_log2 == 2u);
}

fn own_pixel(i: u32) -> u32 {
    let word = own[i / per_load()][(i % per_load()) >> px_log2];
    let bits = 32u >> px_log2;
    return (word >> ((i & ((1u << px_log2) - 1u)) * bits)) & ((1u << bits) - 1u);
}

// First column of the first pixel's window.
fn begin() -> u32 {
    return beside() * per_load() - radius;
}

// Moves the window's sum by one pixel: the last column enters, the pixel is compared, the first column leaves.
var<private> sum: i32;
var<private> bits: u32;
fn pixel_step(i: u32, area: i32) {
    sum += i32(column(begin() + 2u * radius + i));
    let value = own_pixel(i);
    bits |= select(0u, 1u << i, area * i32(value) > sum && value >= frame.minimum);
    sum -= i32(column(begin() + i));
}
// Unrolled by hand: Mesa does not unroll a loop of 32, and an index that is not constant costs 10 cycles.
fn eight_steps(i: u32, area: i32) {
    pixel_step(i, area);
    pixel_step(i + 1u, area);
    pixel_step(i + 2u, area);
    pixel_step(i + 3u, area);
    pixel_step(i + 4u, area);
    pixel_step(i + 5u, area);
    pixel_step(i + 6u, area);
    pixel_step(i + 7u, area);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    // n^2 (value - offset) > sum + (n^2 - 1) / 2: the mean rounded to a whole level, without a division.
    let area = i32(frame.size * frame.size);
    let r = i32(radius);
    if id.x < listing[COUNT] {
        let run = list[id.x];
        let x = tile_x(run.x);
        let shot = tile_shot(run.x);
        let picture = shot * (frame.shot_words / 4u);
        let pitch = frame.pitch / 4u;
        let last_row = i32(frame.height) - 1;
        let own_first = x * (32u / per_load());
        let first = i32(own_first) - i32(beside());
        clear_sums(loads());
        let begins = i32(8u * tile_y(run.x));
        for (var y = begins - r; y < begins + r; y++) {
            pass_row(picture + u32(clamp(y, 0, last_row)) * pitch, first, loads(), 1u);
        }
        let inner = min(frame.width - 32u * x, 32u);
        let wanted = 0xffffffffu >> (32u - inner);
        for (var t = 0u; t < run.y; t++) {
            let ty = tile_y(run.x) + t;
            let top = i32(8u * ty);
            var upper = vec4(0u);
            var lower = vec4(0u);
            for (var k = 0; k < 8; k++) {
                pass_row(picture + u32(min(top + k + r, last_row)) * pitch, first, loads(), 1u);
                let row = picture + u32(min(top + k, last_row)) * pitch + own_first;
                for (var i = 0u; i < 32u / per_load(); i++) {
                    own[i] = image[row + i];
                }
                sum = (area - 1) / 2 + frame.offset * area + i32(sum_of_columns(begin(), 2u * radius, loads()));
                bits = 0u;
                eight_steps(0u, area);
                eight_steps(8u, area);
                eight_steps(16u, area);
                eight_steps(24u, area);
                bits = select(0u, bits & wanted, top + k <= last_row);
                upper = select(upper, vec4(bits), vec4(k) == vec4(0, 1, 2, 3));
                lower = select(lower, vec4(bits), vec4(k) == vec4(4, 5, 6, 7));
                pass_row(picture + u32(clamp(top + k - r, 0, last_row)) * pitch, first, loads(), 0xffffffffu);
            }
            if (frame.flags & HAS_ROI) != 0u {
                let at = ty * frame.tiles_x + x;
                upper &= roi[2u * at];
                lower &= roi[2u * at + 1u];
            }
            let tile = tile_pack(x, ty, shot);
            let at = tile_index(tile);
            mask[2u * at] = upper;
            mask[2u * at + 1u] = lower;
            lit[2u * at] = upper;
            lit[2u * at + 1u] = lower;
            if any((upper | lower) != vec4(0u)) {
                let place = atomicAdd(&lit_listing.count, 1u);
                lit_list[place] = tile;
                if place % 64u == 0u {
                    atomicAdd(&lit_listing.groups, 1u);
                }
            }
        }
    }
}
