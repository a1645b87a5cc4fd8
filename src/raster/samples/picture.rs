//! The samples of a picture file, what a reader accepts of it, and what all readers share.

use super::kind::{Kind, Values};
use super::says::Says;
use super::turn::{self, Orientation};
use crate::fault::{Fault, Result};
use crate::raster::Mask;
use crate::raster::budget::Budget;
use crate::raster::named::other_format;
use crate::raster::size::fits;

/// The samples of one picture, upright.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// 1: one number a pixel; 3: red, green and blue.
    pub channels: usize,
    /// Kind of the numbers that the file holds.
    pub kind: Kind,
    pub(in crate::raster) values: Values,
    /// Pixels that the file hides completely (alpha 0, a mask), if any.
    pub hidden: Option<Mask>,
    /// Number of pixels that it hides in part.
    pub veiled: usize,
    /// What else the file states.
    pub says: Says,
}

/// What a reader accepts.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// Width and height, if they are known.
    pub size: Option<[u32; 2]>,
    /// Most pixels that are accepted.
    pub most: u64,
    /// Page to read of several, from 1 on; `None`: the file must have one page.
    pub page: Option<usize>,
}

/// Memory for pictures during decoding, for all threads together, bytes.
pub(super) static DECODING: Budget = Budget::new(1 << 30);

impl Wanted {
    /// Refuses a size before anything is decoded; `stored` is the size before the picture is turned by `orientation`.
    pub(super) fn fits(&self, orientation: u16, stored: [u32; 2]) -> Result<()> {
        let [width, height] = turn::size(orientation, stored);
        let turned = |e: Fault| {
            e.cause(format!(
                "the file's orientation (tag 274 = {orientation}) swaps columns and rows of what it stores"
            ))
        };
        let swapped = [width, height] != stored;
        fits(width, height, self.size).map_err(|e| if swapped { turned(e) } else { e })?;
        let pixels = u64::from(width) * u64::from(height);
        if pixels > self.most {
            return Err(Fault::input(format!("has {pixels} pixels, limit {}", self.most))
                .cause("several pictures in one, or a damaged file")
                .next("cut out the part that is needed"));
        }
        Ok(())
    }
}

impl Samples {
    /// One sample of a pixel.
    pub fn get(&self, pixel: usize, channel: usize) -> f64 {
        self.values.get(pixel * self.channels + channel)
    }

    /// Width times height.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether no pixel is coloured: red, green and blue are the same number wherever the file hides nothing.
    pub fn grey(&self) -> bool {
        let width = self.width as usize;
        let hidden = |i: usize| self.hidden.as_ref().is_some_and(|h| h.get((i % width) as u32, (i / width) as u32));
        let plain = |i: usize| (1..self.channels).all(|c| self.get(i, c) == self.get(i, 0));
        self.channels == 1 || (0..self.pixel_count()).all(|i| plain(i) || hidden(i))
    }

    /// Separates the channel behind the colours, alpha, from them. Alpha 0 hides a pixel, `opaque` does not.
    pub(super) fn parted(mut self, opaque: f64) -> Samples {
        let all = self.channels;
        self.channels -= 1;
        let alpha = self.values.picked((0..self.pixel_count()).map(|i| i * all + all - 1));
        self.values = self.values.picked((0..self.values.len()).filter(|i| i % all < all - 1));
        self.hide(|i| alpha.get(i) / opaque);
        self
    }

    /// Hides pixels; `alpha` is 0 for a hidden one and 1 for a visible one. Values between are counted as veiled.
    pub(super) fn hide(&mut self, alpha: impl Fn(usize) -> f64) {
        let width = self.width as usize;
        let hidden = Mask::from_fn(self.width, self.height, |x, y| alpha(y as usize * width + x as usize) == 0.0);
        self.veiled = (0..self.pixel_count()).filter(|i| !(alpha(*i) == 0.0 || alpha(*i) == 1.0)).count();
        self.hidden = (hidden.count() > 0).then_some(hidden);
    }

    /// Turns stored samples upright and notes it; `by` names the statement.
    pub(super) fn upright(mut self, Orientation { number: orientation, by }: Orientation) -> Samples {
        if orientation <= 1 {
            return self;
        }
        let (stored, channels) = ([self.width, self.height], self.channels);
        let places = || turn::places(orientation, stored);
        self.values = self.values.picked(places().flat_map(|i| (0..channels).map(move |c| i * channels + c)));
        [self.width, self.height] = turn::size(orientation, stored);
        if let Some(hidden) = self.hidden.take() {
            let mut from = places();
            let at = |i: usize| hidden.get((i % stored[0] as usize) as u32, (i / stored[0] as usize) as u32);
            // Masks are built row by row, in the order of `places`.
            self.hidden = Some(Mask::from_fn(self.width, self.height, |_, _| from.next().is_some_and(at)));
        }
        self.says.orientation = Some(orientation);
        self.says.notes.push(format!("the picture was turned upright as its orientation says ({by} = {orientation})"));
        self
    }
}

/// The error for a picture that no reader can read.
pub(super) fn unreadable(bytes: &[u8], e: &dyn std::fmt::Display) -> Fault {
    let what = |why: &dyn std::fmt::Display| format!("is not a readable picture ({} bytes): {why}", bytes.len());
    match other_format(bytes) {
        Some(name) => Fault::input(what(&format!("it is {name}")))
            .cause("pictures are read as PNG, JPEG, TIFF, BMP and PGM")
            .next("save it in one of these formats"),
        None => Fault::input(what(e))
            .cause("the file is truncated, empty, or of a format other than PNG, JPEG, TIFF, BMP and PGM")
            .next("write the file again"),
    }
}
