// What every stage of the stripe chain knows: the size of the pictures, how they lie in memory, and
// the settings. Pictures of one batch lie behind each other ("shots"). A picture's rows are padded to
// whole tiles of 32 pixels by repeating the last pixel; masks hold one bit a pixel, the 8 words of a tile
// (one a row) behind each other, and have their height padded to whole tiles of 8 rows with zeros.
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
    // ALL_TILES, HAS_ROI, GAUSSIAN.
    flags: u32,
    // Number of thinning's sub-iteration.
    step: u32,
    // Most skeleton pixels of a batch.
    capacity: u32,
    full_scale: u32,
    // Ends of skeletons: most pixels added, and from bit 16 on the share of brightness in 4096ths.
    lengthen: u32,
    // Pixels from one of a run across the stripe to the next, and from bit 16 on 1 where runs lie along rows; 0 keeps
    // all.
    spacing: u32,
}

// Bits of flags: every tile is listed (the plain path), a region of interest is given, the window is Gaussian.
const ALL_TILES = 1u;
const HAS_ROI = 2u;
const GAUSSIAN = 4u;

// Pixels a word as a power of two: 2 for 8-bit pictures, 1 for 9 to 16 bits.
override px_log2: u32 = 2u;

// Arguments of an indirect dispatch with one invocation a tile and 64 a workgroup, and the list's length.
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
// Place of a tile in arrays that hold every tile.
fn tile_index(tile: u32) -> u32 {
    return (tile_shot(tile) * frame.tiles_y + tile_y(tile)) * frame.tiles_x + tile_x(tile);
}
// Place of a tile's row in a mask.
fn mask_index(tile: u32, row: u32) -> u32 {
    return 8u * tile_index(tile) + row;
}
// Place of a pixel's word in a mask; its bit is x % 32.
fn mask_word(shot: u32, x: u32, y: u32) -> u32 {
    return 8u * ((shot * frame.tiles_y + y / 8u) * frame.tiles_x + x / 32u) + y % 8u;
}
// Bits beyond eight of the pictures' depth.
fn depth_shift() -> u32 {
    return countOneBits(frame.full_scale) - 8u;
}
// a / b for a quotient below 2^20; four times faster than the integer division of a vector.
fn divide(a: u32, b: u32) -> u32 {
    let q = u32(f32(a) / f32(b));
    let r = i32(a - q * b);
    return q + select(0u, 1u, r >= i32(b)) - select(0u, 1u, r < 0);
}
