//! In: pixels that are set or not. Out: one bit a pixel, 32 pixels a word, the layout of masks in the GPU stages.
//! Frame and unit: pixels; bit b of word i of a row is the pixel x = 32 i + b.

use super::Image;

/// A bit mask. Rows are `words_per_row()` words long; the bits beyond `width` are always 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Rows from the top, `words_per_row()` words each, bit b of word i for x = 32 i + b.
    pub words: Vec<u32>,
}

impl Mask {
    /// A mask without a set pixel, sizes in px.
    pub fn new(width: u32, height: u32) -> Mask {
        Mask { width, height, words: vec![0; width.div_ceil(32) as usize * height as usize] }
    }
    /// Sets the pixels for which `lit(x, y)` is true.
    pub fn from_fn(width: u32, height: u32, mut lit: impl FnMut(u32, u32) -> bool) -> Mask {
        let mut mask = Mask::new(width, height);
        for y in 0..height {
            for x in 0..width {
                if lit(x, y) {
                    mask.set(x, y);
                }
            }
        }
        mask
    }
    /// Sets the pixels where the picture is not 0.
    pub fn from_image(image: &Image) -> Mask {
        Mask::from_fn(image.width, image.height, |x, y| image.get(x, y) > 0)
    }
    /// Words in a row: the width over 32, rounded up.
    pub fn words_per_row(&self) -> usize {
        self.width.div_ceil(32) as usize
    }
    /// Whether a pixel inside the mask is set.
    pub fn get(&self, x: u32, y: u32) -> bool {
        self.words[y as usize * self.words_per_row() + (x / 32) as usize] >> (x % 32) & 1 == 1
    }
    /// Sets a pixel; panics outside the mask.
    pub fn set(&mut self, x: u32, y: u32) {
        assert!(x < self.width && y < self.height);
        let i = y as usize * self.words_per_row() + (x / 32) as usize;
        self.words[i] |= 1 << (x % 32);
    }
    /// Clears a pixel inside the mask.
    pub fn clear(&mut self, x: u32, y: u32) {
        let i = y as usize * self.words_per_row() + (x / 32) as usize;
        self.words[i] &= !(1 << (x % 32));
    }
    /// Number of set pixels.
    pub fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }
    /// As levels 0 and 255, row-major, for display.
    pub fn to_u8(&self) -> Vec<u8> {
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| if self.get(x, y) { 255 } else { 0 })
            .collect()
    }
    /// Leaves set only what is set in both masks; panics when the sizes differ.
    pub fn intersect(&mut self, other: &Mask) {
        assert_eq!((self.width, self.height), (other.width, other.height));
        for (a, b) in self.words.iter_mut().zip(&other.words) {
            *a &= b;
        }
    }
}
