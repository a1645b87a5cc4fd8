// In: pictures and the tile list. Out: for every row of a listed tile, and as far to both sides as the window
// reaches, the sum of each column over the window's height. Neighbouring tiles write the same sums twice;
// that costs less than finding out. One word of pixels at a time: its columns are added up side by side.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> image: array<u32>;
@group(0) @binding(2) var<storage, read> listing: array<u32>;
@group(0) @binding(3) var<storage, read> list: array<u32>;
@group(0) @binding(4) var<storage, read_write> columns: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x / 8u;
    let per_word = 1u << px_log2;
    let words = 32u >> px_log2;
    let r = frame.size / 2u;
    let reach = (r + per_word - 1u) >> px_log2;
    let low = select(0x0000ffffu, 0x00ff00ffu, px_log2 == 2u);
    let half = select(16u, 8u, px_log2 == 2u);
    for (var inside = u32(slot < listing[3]); inside > 0u; inside--) {
        let tile = list[slot];
        let shot = tile_shot(tile);
        let first = shot * frame.shot_words;
        let top = i32(8u * tile_y(tile));
        let last_row = i32(frame.height) - 1;
        let own = i32(words * tile_x(tile));
        let begin = max(own - i32(reach), 0);
        let end = min(own + i32(words + reach), i32(frame.pitch));
        for (var w = begin + i32(id.x % 8u); w < end; w += 8) {
            var even = 0u; // two columns of 16 bits, or one
            var odd = 0u;
            for (var y = top - i32(r); y < top + i32(r); y++) {
                let v = image[first + u32(clamp(y, 0, last_row)) * frame.pitch + u32(w)];
                even += v & low;
                odd += (v >> half) & low;
            }
            var at = ((shot * frame.tiles_y * 8u + u32(top)) * frame.pitch + u32(w)) << px_log2;
            for (var k = 0; k < 8; k++) {
                let enters = image[first + u32(min(top + k + i32(r), last_row)) * frame.pitch + u32(w)];
                even += enters & low;
                odd += (enters >> half) & low;
                if px_log2 == 2u {
                    columns[at] = even & 0xffffu;
                    columns[at + 1u] = odd & 0xffffu;
                    columns[at + 2u] = even >> 16u;
                    columns[at + 3u] = odd >> 16u;
                } else {
                    columns[at] = even;
                    columns[at + 1u] = odd;
                }
                at += frame.pitch << px_log2;
                let leaves = image[first + u32(clamp(top + k - i32(r), 0, last_row)) * frame.pitch + u32(w)];
                even -= leaves & low;
                odd -= (leaves >> half) & low;
            }
        }
    }
}
