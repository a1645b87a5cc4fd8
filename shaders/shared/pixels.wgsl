// Pixels from packed words: x beyond the picture repeats the border pixel, y must lie inside. `first` is the first word
// of the row.
fn pixel(first: u32, x: i32) -> u32 {
    let at = u32(clamp(x, 0, i32(frame.width) - 1));
    let bits = 32u >> px_log2;
    let place = at & ((1u << px_log2) - 1u);
    return (image[first + (at >> px_log2)] >> (place * bits)) & ((1u << bits) - 1u);
}
// Word i of a row; beyond the row the border pixel repeats.
fn word(first: u32, i: i32) -> u32 {
    let last = i32(frame.pitch) - 1;
    let v = image[first + u32(clamp(i, 0, last))];
    let bits = 32u >> px_log2;
    let ones = select(0x01010101u, 0x00010001u, px_log2 == 1u);
    let left = (v & ((1u << bits) - 1u)) * ones;
    let right = (v >> (32u - bits)) * ones;
    return select(select(v, left, i < 0), right, i > last);
}
// First word of row y of a shot; beyond the picture the border row repeats.
fn row_start(shot: u32, y: i32) -> u32 {
    return shot * frame.shot_words + u32(clamp(y, 0, i32(frame.height) - 1)) * frame.pitch;
}
