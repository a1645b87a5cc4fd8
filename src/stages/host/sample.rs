//! In: grey levels of 8 bits or of 9 to 16. Out: the numbers that their sums are held in.
//! Frame and unit: grey levels.

use std::ops::{AddAssign, SubAssign};

/// A pixel.
pub trait Sample: Copy + Ord + Default + Send + Sync + Into<f32> + 'static {
    /// Holds the sum of 101 pixels, and of a block.
    type Wide: Copy + Ord + Default + AddAssign + SubAssign + Into<u32>;
    fn wide(self) -> Self::Wide;
    /// Sums of eight pixels each.
    fn eights(row: &[Self; 32]) -> [Self::Wide; 4];
    fn number(wide: Self::Wide) -> u32 {
        wide.into()
    }
}

impl Sample for u8 {
    type Wide = u16;
    #[inline(always)]
    fn wide(self) -> u16 {
        u16::from(self)
    }
    #[inline(always)]
    fn eights(row: &[u8; 32]) -> [u16; 4] {
        // Bytes of a word are added up two, four and eight together.
        const PAIRS: u64 = 0x00ff_00ff_00ff_00ff;
        std::array::from_fn(|b| {
            let word = u64::from_le_bytes(std::array::from_fn(|i| row[8 * b + i]));
            let pairs = (word & PAIRS) + (word >> 8 & PAIRS);
            let fours = pairs + (pairs >> 32);
            (fours + (fours >> 16)) as u16
        })
    }
}

impl Sample for u16 {
    type Wide = u32;
    #[inline(always)]
    fn wide(self) -> u32 {
        u32::from(self)
    }
    #[inline(always)]
    fn eights(row: &[u16; 32]) -> [u32; 4] {
        std::array::from_fn(|b| (0..8).map(|i| u32::from(row[8 * b + i])).sum())
    }
}
