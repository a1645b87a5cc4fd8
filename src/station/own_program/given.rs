//! In: pictures and flange poses, one pair after the other. Out: shots of one format.
//! Frame and unit: base_from_flange, mm; grey levels of the pictures' depth.

use crate::capture::Format;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::Image;
use crate::recording::Stand;
use crate::scan::{BadShot, Shot, Source};
use std::iter::Peekable;

/// A picture with the pose of the flange at its exposure, or the error that ends the scan.
pub type Given = Result<(Image, Rigid<Base, Flange>)>;

/// Shots from an iterator.
pub(super) struct GivenSource<I: Iterator<Item = Given>> {
    items: Peekable<I>,
    format: Format,
    count: u32,
    ended: bool,
}

impl<I: Iterator<Item = Given>> GivenSource<I> {
    /// Looks at the first picture, whose format all must have.
    pub fn new(items: I) -> Result<GivenSource<I>> {
        let mut items = items.peekable();
        let format = match items.peek() {
            Some(Ok((image, _))) => format_of(image),
            Some(Err(fault)) => return Err(fault.clone()),
            None => {
                return Err(Fault::input("there is no picture to scan")
                    .cause("an empty list, or an iterator that was used up")
                    .next("give at least one picture with its pose"));
            }
        };
        Ok(GivenSource { items, format, count: 0, ended: false })
    }

    fn shot(&self, index: u32, given: Given) -> Result<Shot> {
        let (image, pose) = given?;
        let (is, first) = (format_of(&image), self.format);
        if is != first {
            let words = |f: Format| format!("{}x{} with {} bits", f.width, f.height, f.bits);
            return Err(Fault::input(format!("picture {index} is {}, the first one is {}", words(is), words(first)))
                .cause("another camera, or its region was changed meanwhile")
                .next("scan pictures of one size and depth together"));
        }
        let (name, stand) = (format!("picture {index}"), Stand::Robot(pose));
        Ok(Shot { index, name, image, stand, slip: None, here_ns: None })
    }
}

/// Size and depth of a picture.
pub(super) fn format_of(image: &Image) -> Format {
    Format { width: image.width, height: image.height, bits: image.bits }
}

impl<I: Iterator<Item = Given>> Source for GivenSource<I> {
    fn format(&self) -> Format {
        self.format
    }
    fn remaining(&self) -> Option<usize> {
        let (least, most) = self.items.size_hint();
        most.filter(|most| *most == least)
    }
    fn next(&mut self) -> Option<std::result::Result<Shot, BadShot>> {
        let given = self.items.next().filter(|_| !self.ended)?;
        let index = self.count;
        self.count += 1;
        Some(self.shot(index, given).map_err(|fault| {
            self.ended = true;
            BadShot { index, name: format!("picture {index}"), fault, last: true }
        }))
    }
    fn resumable(&self) -> bool {
        false
    }
}
