//! In: the size and depth of the pictures, the settings. Out: the uniform block of the stripe stages and the layout of
//! their buffers. Frame and unit: pixels, words of 32 bits.

use super::{ThresholdParams, Window};
use crate::fault::{Fault, Result};
use crate::gpu::Field;
use crate::raster::{Image, Mask, Pixels};
use std::ops::Range;

/// The WGSL struct of the same name, shaders/shared/frame.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Frame {
    /// Width of a picture, px.
    pub width: u32,
    /// Height of a picture, px.
    pub height: u32,
    /// Words of one picture row, padded to whole tiles.
    pub pitch: u32,
    /// Words of one picture.
    pub shot_words: u32,
    /// Tiles in a row of tiles, each 32 px wide.
    pub tiles_x: u32,
    /// Rows of tiles in one picture, each 8 px high.
    pub tiles_y: u32,
    /// Pictures in a batch.
    pub shots: u32,
    /// Edge of the threshold's window, px, odd.
    pub size: u32,
    /// Amount by which a lit pixel exceeds the window's mean, grey levels of the picture's depth; may be negative.
    pub offset: i32,
    /// Least level of a lit pixel, grey levels of the picture's depth.
    pub minimum: u32,
    /// Sum of [`ALL_TILES`], [`HAS_ROI`] and [`GAUSSIAN`].
    pub flags: u32,
    /// Sub-iteration of thinning, counted from 0.
    pub step: u32,
    /// Most skeleton pixels that a batch can store.
    pub capacity: u32,
    /// Grey level of saturation.
    pub full_scale: u32,
    /// Most pixels added to an end of a line, and from bit 16 on the least share of brightness in 4096ths; 0 is off.
    pub lengthen: u32,
    /// Distance between the pixels of a run across the stripe that stay, px ([`crate::stages::stripe::spacing::word`]);
    /// and whether isolated lit pixels are excluded ([`crate::stages::stripe::spacing::COMPANY`]). 0 keeps all.
    pub spacing: u32,
}

/// `Frame::flags`: every tile is listed, which is the plain path.
pub const ALL_TILES: u32 = 1;
/// `Frame::flags`: a region of interest is given.
pub const HAS_ROI: u32 = 2;
/// `Frame::flags`: the window is Gaussian.
pub const GAUSSIAN: u32 = 4;

/// Lists name and byte offset of a struct's members for the contract tests.
#[macro_export]
macro_rules! uniform_fields {
    ($t:ty: $($f:ident),* $(,)?) => {
        ( stringify!($t), &[$($crate::gpu::Field { name: stringify!($f), offset: std::mem::offset_of!($t, $f) }),*],
          std::mem::size_of::<$t>() )
    };
}

pub(crate) use uniform_fields;

/// WGSL name, members and bytes of [`Frame`], for the contract tests.
pub const UNIFORM: (&str, &[Field], usize) = uniform_fields!(Frame: width, height, pitch, shot_words, tiles_x,
    tiles_y, shots, size, offset, minimum, flags, step, capacity, full_scale, lengthen, spacing);

pub(crate) const SHARED: &str =
    concat!(include_str!("../../shaders/shared/frame.wgsl"), include_str!("../../shaders/shared/listing.wgsl"));
pub(crate) const COLUMNS: &str = include_str!("../../shaders/shared/columns.wgsl");
pub(crate) const PIXELS: &str = include_str!("../../shaders/shared/pixels.wgsl");
pub(crate) const ACTIVITY: &str = include_str!("../../shaders/shared/activity.wgsl");
/// Pixels per word as a power of two: 2 for 8-bit pictures, 1 for deeper ones.
pub const PX_LOG2: &str = "px_log2";

/// The value of the override [`PX_LOG2`] for pictures of this depth.
pub fn px_log2(bits: u8) -> u32 {
    if bits == 8 { 2 } else { 1 }
}

impl Frame {
    /// The layout of `shots` pictures of one size and depth in one batch.
    pub fn new(width: u32, height: u32, bits: u8, shots: u32, p: &ThresholdParams) -> Result<Frame> {
        p.check()?;
        // A tile has 10 bits for its column, 12 for its row, 10 for its shot; a pixel has 16 + 16 bits.
        if !(1..=32 * 1023).contains(&width) || !(1..=8 * 4095).contains(&height) {
            return Err(Fault::input(format!(
                "a picture of {width} x {height} pixels, 1 x 1 to 32736 x 32760 are possible"
            ))
            .next("cut the pictures, or measure at less resolution"));
        }
        if !(8..=16).contains(&bits) {
            return Err(Fault::input(format!("pictures of {bits} bits, 8 to 16 are possible"))
                .next("give the depth that the pictures really have"));
        }
        if !(1..=1023).contains(&shots) {
            return Err(Fault::usage(format!("{shots} shots in one batch, 1 to 1023 are possible"))
                .next("take fewer shots a batch"));
        }
        let (tiles_x, tiles_y) = (width.div_ceil(32), height.div_ceil(8));
        let pitch = (tiles_x * 32) >> px_log2(bits);
        // One pixel in twenty, over the complete batch, is more than the skeleton of a scene with a stripe ever has: it
        // would be 24 lines across a picture of 480 rows. A small picture can store all its pixels.
        let a_shot = (u64::from(width) * u64::from(height) / 20).max((u64::from(width) * u64::from(height)).min(32768));
        let capacity = u32::try_from(a_shot * u64::from(shots)).map_err(|_| {
            Fault::usage(format!("{shots} shots of {width} x {height} pixels in one batch: their list has no room"))
                .next("send fewer shots a batch")
        })?;
        Ok(Frame {
            width,
            height,
            pitch,
            shot_words: pitch * height,
            tiles_x,
            tiles_y,
            shots,
            size: p.size,
            offset: p.offset,
            minimum: u32::from(p.minimum),
            flags: if p.window == Window::Gaussian { GAUSSIAN } else { 0 },
            step: 0,
            capacity,
            full_scale: (1 << bits) - 1,
            lengthen: 0,
            spacing: 0,
        })
    }
    /// Number of tiles in all pictures of a batch.
    pub fn tiles(&self) -> u32 {
        self.tiles_x * self.tiles_y * self.shots
    }
    /// Words of a mask of a complete batch, 8 per tile.
    pub fn mask_words(&self) -> u32 {
        self.tiles() * 8
    }
    /// Bytes of one picture, rows padded to whole tiles.
    pub fn image_bytes(&self) -> usize {
        self.shot_words as usize * 4
    }
    /// The threshold settings of the frame.
    pub fn threshold(&self) -> ThresholdParams {
        ThresholdParams {
            window: if self.flags & GAUSSIAN != 0 { Window::Gaussian } else { Window::Mean },
            size: self.size,
            offset: self.offset,
            minimum: self.minimum as u16,
        }
    }

    /// Passes rows of a picture to `put` piece by piece (byte offset from the first of these rows, bytes). Rows are
    /// padded to whole tiles with their last pixel.
    pub fn put_rows(&self, image: &Image, rows: Range<u32>, put: &mut dyn FnMut(usize, &[u8])) -> Result<()> {
        self.accept(image)?;
        let (bytes, px): (&[u8], usize) = match &image.pixels {
            Pixels::U8(p) => (p, 1),
            Pixels::U16(p) => (bytemuck::cast_slice(p), 2),
        };
        let (row, pitch) = (self.width as usize * px, self.pitch as usize * 4);
        let bytes = &bytes[rows.start as usize * row..rows.end as usize * row];
        if row == pitch {
            put(0, bytes);
            return Ok(());
        }
        let mut padding = [0u8; 64];
        for (y, from) in bytes.chunks_exact(row).enumerate() {
            padding.chunks_exact_mut(px).for_each(|p| p.copy_from_slice(&from[row - px..]));
            put(y * pitch, from);
            put(y * pitch + row, &padding[..pitch - row]);
        }
        Ok(())
    }

    /// Writes a picture into a slice of `image_bytes()` bytes.
    pub fn pack_image(&self, image: &Image, out: &mut [u8]) -> Result<()> {
        self.put_rows(image, 0..self.height, &mut |at, bytes| out[at..at + bytes.len()].copy_from_slice(bytes))
    }

    /// Returns an error for a picture of a different size or depth.
    pub fn accept(&self, image: &Image) -> Result<()> {
        let full = u32::from(image.full_scale());
        if (image.width, image.height, full) == (self.width, self.height, self.full_scale) {
            return Ok(());
        }
        Err(Fault::input(format!(
            "a picture of {} x {} pixels, {} bits among pictures of {} x {} pixels, {} bits",
            image.width,
            image.height,
            image.bits,
            self.width,
            self.height,
            (self.full_scale + 1).ilog2()
        ))
        .cause("pictures of two cameras or exports lie in one folder")
        .next("move them into a recording of their own"))
    }

    /// One shot's mask from the mask words of a batch.
    pub fn unpack_mask(&self, words: &[u32], shot: u32) -> Mask {
        let place = |y: u32| (0..self.tiles_x).map(move |i| self.mask_word(shot, 32 * i, y));
        let words = (0..self.height).flat_map(place).map(|at| words[at]).collect();
        Mask { width: self.width, height: self.height, words }
    }
    /// A mask in the layout of one shot: tile by tile, height padded to whole tiles.
    pub fn pack_mask(&self, mask: &Mask) -> Vec<u32> {
        assert_eq!((mask.width, mask.height), (self.width, self.height));
        let mut words = vec![0; (self.tiles_x * self.tiles_y * 8) as usize];
        for (i, &word) in (0..).zip(&mask.words) {
            words[self.mask_word(0, i % self.tiles_x * 32, i / self.tiles_x)] = word;
        }
        words
    }
    /// Index of a pixel's word in a mask; its bit is x % 32.
    pub fn mask_word(&self, shot: u32, x: u32, y: u32) -> usize {
        (8 * ((shot * self.tiles_y + y / 8) * self.tiles_x + x / 32) + y % 8) as usize
    }
}

/// Tile x, tile y and shot from a word of a list.
pub fn tile_unpack(tile: u32) -> (u32, u32, u32) {
    (tile & 1023, tile >> 10 & 4095, tile >> 22)
}
pub(crate) fn tile_pack(x: u32, y: u32, shot: u32) -> u32 {
    x | y << 10 | shot << 22
}

/// The uniform's words in a twin's bindings, read as `Frame`.
pub fn frame_of(bindings: &[Vec<u32>]) -> Frame {
    *bytemuck::from_bytes(bytemuck::cast_slice(&bindings[0]))
}
