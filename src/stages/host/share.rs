//! In: a picture's width. Out: how the picture is divided among threads. Frame and unit: px.

/// Least number of pixels for a thread: handing work to another thread costs as much as a tenth of this.
pub const LEAST: usize = 1 << 17;
/// Least number of rows of tiles in a band: its neighbours also compute its margin, which should be at most a fifth of
/// it.
const TALL: usize = 24;

/// Number of rows of tiles in a band.
pub fn rows_of_band(width: u32) -> usize {
    LEAST.div_ceil(8 * width as usize).max(TALL)
}
