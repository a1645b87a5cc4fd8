//! In: the size that a picture's header states. Out: whether it may be decoded.
//! Frame and unit: px.

use crate::fault::{Fault, Result};

/// Longest side of a picture, px: stages pack a position into two numbers of 16 bits.
pub const MOST_SIDE: u32 = 65_535;
/// Most pixels of a picture; the largest sensors have 250 million.
pub const MOST_PIXELS: u64 = 1 << 28;
/// Refuses a size other than the known one, or above the limits, before anything is decoded.
pub(super) fn fits(width: u32, height: u32, size: Option<[u32; 2]>) -> Result<()> {
    match size {
        Some([w, h]) if [w, h] != [width, height] => {
            Err(Fault::input(format!("is {width}x{height}, it should be {w}x{h}"))
                .cause("pictures of two cameras or two resolutions in one folder")
                .next("correct the size that meta.json or an option states, or take the odd pictures out"))
        }
        None if width.max(height) > MOST_SIDE || u64::from(width) * u64::from(height) > MOST_PIXELS => {
            Err(Fault::input(format!(
                "is {width}x{height}, at most {MOST_SIDE} a side and {MOST_PIXELS} pixels in all are read"
            ))
            .cause("several pictures in one, or a damaged file")
            .next("cut it into pictures of the sensor's size"))
        }
        _ => Ok(()),
    }
}
