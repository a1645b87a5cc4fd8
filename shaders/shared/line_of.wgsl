// In: a skeleton pixel, x | y << 16; a uniform block `frame` with the fields of the lines. Out: the line across the
// stripe that the pixel lies on, in its shot. Twin: line_of in src/stages/stripe/choose.rs. Frame and unit: pixels.
fn line_of(pixel: u32) -> u32 {
    return select(pixel >> 16u, pixel & 0xffffu, frame.columns != 0u) / frame.line_px;
}
