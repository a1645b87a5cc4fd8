//! In: grey levels of 8 bits or of 9 to 16. Out: the number types of their sums; the statistics of four blocks for the
//! proof. Frame and unit: grey levels.

use std::ops::{AddAssign, SubAssign};

/// Edge of a block, px.
pub const EDGE: usize = 8;
/// Number of blocks in a tile, side by side.
pub const FOUR: usize = 4;

/// Statistics of four blocks side by side: sum, smallest sums of a row and of a column, largest and smallest pixel.
#[derive(Debug, Default, PartialEq)]
pub struct Four {
    pub sum: [u32; FOUR],
    pub row: [u32; FOUR],
    pub column: [u32; FOUR],
    pub largest: [u32; FOUR],
    pub smallest: [u32; FOUR],
}

/// A pixel's grey level.
pub trait Sample: Copy + Ord + Default + Send + Sync + Into<f32> + 'static {
    /// A type that can hold the sum of 101 pixels, and of a block.
    type Wide: Copy + Ord + Default + AddAssign + SubAssign + Into<u32>;
    fn wide(self) -> Self::Wide;
    fn number(wide: Self::Wide) -> u32 {
        wide.into()
    }
    /// Statistics of the four blocks that begin at pixel `from` of eight lines.
    fn four(lines: &[&[Self]; EDGE], from: usize) -> Four;
}

/// Sum of a word's bytes; `even` and `odd` have 16 bits for each of them.
#[inline(always)]
fn together(even: u64, odd: u64) -> u32 {
    let pairs = even + odd;
    let fours = pairs + (pairs >> 32);
    (fours + (fours >> 16)) as u32 & 0xffff
}

impl Sample for u8 {
    type Wide = u16;
    #[inline(always)]
    fn wide(self) -> u16 {
        u16::from(self)
    }
    #[inline(always)]
    fn four(lines: &[&[u8]; EDGE], from: usize) -> Four {
        // The eight pixels of a block's row are one word. Its even and odd bytes, summed separately over the rows, give
        // the sums of the columns. Bytes added up two, four and eight at a time give the sum of the row.
        const EVERY_OTHER: u64 = 0x00ff_00ff_00ff_00ff;
        let (mut even, mut odd, mut row) = ([0u64; FOUR], [0u64; FOUR], [u32::MAX; FOUR]);
        let (mut largest, mut smallest) = ([0u8; 32], [u8::MAX; 32]);
        for line in lines {
            let line: [u8; 32] = line[from..from + 32].try_into().expect("a tile's row");
            for i in 0..32 {
                largest[i] = largest[i].max(line[i]);
                smallest[i] = smallest[i].min(line[i]);
            }
            for b in 0..FOUR {
                let word = u64::from_le_bytes(line[8 * b..8 * b + 8].try_into().expect("eight bytes"));
                let (e, o) = (word & EVERY_OTHER, word >> 8 & EVERY_OTHER);
                even[b] += e;
                odd[b] += o;
                row[b] = row[b].min(together(e, o));
            }
        }
        // The halves of the words are folded onto each other, for all blocks at once; the result is in the lowest lane.
        let mut least: [u16; 16] = bytemuck::cast(even);
        let others: [u16; 16] = bytemuck::cast(odd);
        for i in 0..16 {
            least[i] = least[i].min(others[i]);
        }
        for half in [32, 16] {
            let upper: [u16; 16] = bytemuck::cast(bytemuck::cast::<_, [u64; FOUR]>(least).map(|word| word >> half));
            for i in 0..16 {
                least[i] = least[i].min(upper[i]);
            }
        }
        for half in [32, 16, 8] {
            let upper = |of| -> [u8; 32] {
                bytemuck::cast(bytemuck::cast::<[u8; 32], [u64; FOUR]>(of).map(|word| word >> half))
            };
            let (high, low) = (upper(largest), upper(smallest));
            for i in 0..32 {
                largest[i] = largest[i].max(high[i]);
                smallest[i] = smallest[i].min(low[i]);
            }
        }
        let lowest = |words: [u64; FOUR], lane: u64| words.map(|word| (word & lane) as u32);
        Four {
            sum: std::array::from_fn(|b| together(even[b], odd[b])),
            row,
            column: lowest(bytemuck::cast(least), 0xffff),
            largest: lowest(bytemuck::cast(largest), 0xff),
            smallest: lowest(bytemuck::cast(smallest), 0xff),
        }
    }
}

impl Sample for u16 {
    type Wide = u32;
    #[inline(always)]
    fn wide(self) -> u32 {
        u32::from(self)
    }
    #[inline(always)]
    fn four(lines: &[&[u16]; EDGE], from: usize) -> Four {
        let (mut row, mut columns) = ([u32::MAX; FOUR], [0u32; 32]);
        let (mut largest, mut smallest) = ([0u16; 32], [u16::MAX; 32]);
        for line in lines {
            let line = &line[from..from + 32];
            for i in 0..32 {
                columns[i] += u32::from(line[i]);
                largest[i] = largest[i].max(line[i]);
                smallest[i] = smallest[i].min(line[i]);
            }
            for b in 0..FOUR {
                let mut all = 0;
                for i in 0..EDGE {
                    all += u32::from(line[EDGE * b + i]);
                }
                row[b] = row[b].min(all);
            }
        }
        let mut four = Four { row, column: [u32::MAX; FOUR], smallest: [u32::MAX; FOUR], ..Four::default() };
        for b in 0..FOUR {
            for i in EDGE * b..EDGE * b + EDGE {
                four.sum[b] += columns[i];
                four.column[b] = four.column[b].min(columns[i]);
                four.largest[b] = four.largest[b].max(u32::from(largest[i]));
                four.smallest[b] = four.smallest[b].min(u32::from(smallest[i]));
            }
        }
        four
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same statistics, computed pixel by pixel.
    fn plain<T: Sample>(lines: &[[T; 32]; EDGE]) -> Four {
        let of = |b: usize, r: usize, i: usize| T::number(lines[r][EDGE * b + i].wide());
        let all = |b: usize| (0..EDGE * EDGE).map(move |k| of(b, k / EDGE, k % EDGE));
        let row = |b: usize| (0..EDGE).map(|r| (0..EDGE).map(|i| of(b, r, i)).sum::<u32>()).min().unwrap();
        let column = |b: usize| (0..EDGE).map(|i| (0..EDGE).map(|r| of(b, r, i)).sum::<u32>()).min().unwrap();
        Four {
            sum: std::array::from_fn(|b| all(b).sum()),
            row: std::array::from_fn(row),
            column: std::array::from_fn(column),
            largest: std::array::from_fn(|b| all(b).max().unwrap()),
            smallest: std::array::from_fn(|b| all(b).min().unwrap()),
        }
    }

    fn same<T: Sample + std::fmt::Debug>(level: impl Fn(u64) -> T) {
        let mut s = 7u64;
        for round in 0..200u64 {
            let lines: [[T; 32]; EDGE] = std::array::from_fn(|_| {
                std::array::from_fn(|_| {
                    s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    // All bits 0, all bits 1, and random values.
                    level(match round {
                        0 => 0,
                        1 => u64::MAX,
                        _ => s >> 48,
                    })
                })
            });
            assert_eq!(T::four(&lines.each_ref().map(|line| &line[..]), 0), plain(&lines), "{lines:?}");
        }
    }

    #[test]
    fn four_blocks_at_once_are_what_their_pixels_say() {
        same(|v| v as u8);
        same(|v| v as u16);
    }
}
