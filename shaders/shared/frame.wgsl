// The block that every stage of the stripe chain reads: the size of the pictures, their layout in memory, and the
// settings. The pictures of one batch ("shots") are stored one after the other. A picture's rows are padded to whole
// tiles of 32 pixels by repeating the last pixel. Masks have one bit per pixel. The 8 words of a tile (one for each
// row) are stored one after the other, and the mask's height is padded to whole tiles of 8 rows with zeros.
struct Frame {
    width: u32,
    height: u32,
    // Words of one picture row, and of one picture.
    pitch: u32,
    shot_words: u32,
    tiles_x: u32,
    tiles_y: u32,
    shots: u32,
    // Threshold: window edge (odd), grey levels above the mean, absolute minimum.
    size: u32,
    offset: i32,
    minimum: u32,
    // Sum of ALL_TILES, HAS_ROI and GAUSSIAN.
    flags: u32,
    // Number of the sub-iteration of thinning.
    step: u32,
    // Most skeleton pixels in a batch.
    capacity: u32,
    full_scale: u32,
    // Lengthening of skeleton ends: most pixels added, and from bit 16 on the share of brightness in 4096ths.
    lengthen: u32,
    // Distance between the pixels of a run across the stripe that stay, px; from bit 16 on, 1 if runs lie along rows. 0
    // keeps all.
    spacing: u32,
}

// Bits of flags: every tile is listed (the plain path), a region of interest is given, the window is Gaussian.
const ALL_TILES = 1u;
const HAS_ROI = 2u;
const GAUSSIAN = 4u;

// Pixels per word as a power of two: 2 for 8-bit pictures, 1 for 9 to 16 bits.
override px_log2: u32 = 2u;

// Arguments of an indirect dispatch with one invocation per tile and 64 per workgroup; and the list's length.
struct Listing {
    groups: atomic<u32>,
    groups_y: u32,
    groups_z: u32,
    count: atomic<u32>,
}

// A tile in one word: 10 bits x, 12 bits y, 10 bits shot.
fn tile_pack(x: u32, y: u32, shot: u32) -> u32 {
    return x | (y << 10u) | (shot << 22u);
}
fn tile_x(tile: u32) -> u32 {
    return tile & 1023u;
}
fn tile_y(tile: u32) -> u32 {
    return (tile >> 10u) & 4095u;
}
fn tile_shot(tile: u32) -> u32 {
    return tile >> 22u;
}
// Index of a tile in arrays that contain every tile.
fn tile_index(tile: u32) -> u32 {
    return (tile_shot(tile) * frame.tiles_y + tile_y(tile)) * frame.tiles_x + tile_x(tile);
}
// Index of a tile's row in a mask.
fn mask_index(tile: u32, row: u32) -> u32 {
    return 8u * tile_index(tile) + row;
}
// Index of a pixel's word in a mask; its bit is x % 32.
fn mask_word(shot: u32, x: u32, y: u32) -> u32 {
    return 8u * ((shot * frame.tiles_y + y / 8u) * frame.tiles_x + x / 32u) + y % 8u;
}
// Number of bits by which the pictures' depth exceeds eight.
fn depth_shift() -> u32 {
    return countOneBits(frame.full_scale) - 8u;
}
// a / b for a quotient below 2^20; four times faster than the integer division of a vector.
fn divide(a: u32, b: u32) -> u32 {
    let q = u32(f32(a) / f32(b));
    let r = i32(a - q * b);
    return q + select(0u, 1u, r >= i32(b)) - select(0u, 1u, r < 0);
}
