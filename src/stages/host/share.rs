//! In: a picture's width. Out: how it is divided among threads.
//! Frame and unit: px.

/// Pixels that one thread takes at least: handing work to another costs as much as a tenth of this.
pub const LEAST: usize = 1 << 17;
/// Rows of a band at least: its margin is looked at by its neighbours too, and shall stay a fifth of it.
const TALL: usize = 24;

/// Rows of tiles that make a band.
pub fn rows_of_band(width: u32) -> usize {
    LEAST.div_ceil(8 * width as usize).max(TALL)
}
