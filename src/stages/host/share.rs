//! In: a picture's width. Out: how it is divided among threads.
//! Frame and unit: px.

/// Pixels that one thread takes at least: handing work to another costs as much as a tenth of this.
pub const LEAST: usize = 1 << 17;

/// So many rows of blocks or tiles.
pub fn rows_at_least(width: u32) -> usize {
    LEAST.div_ceil(8 * width as usize)
}
