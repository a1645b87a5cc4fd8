//! Finds the pages of a TIFF: pictures of full size, reduced copies of them and masks.

use crate::fault::{Fault, Result};
use std::collections::BTreeSet;
use std::io::Cursor;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// A file with more pages is a film, not a set of pictures.
const MOST_PAGES: usize = 1 << 16;

/// Page numbers, from 0 on, by type (NewSubfileType, tag 254, and SubfileType, tag 255).
#[derive(Debug, Default)]
pub(super) struct Pages {
    full: Vec<usize>,
    reduced: Vec<usize>,
    /// Masks, which state which pixels of other pages are valid.
    pub masks: Vec<usize>,
}

pub(super) fn pages(decoder: &mut Decoder<Cursor<&[u8]>>) -> Result<Pages> {
    let mut pages = Pages::default();
    let mut next = decoder.ifd_pointer();
    let mut seen = BTreeSet::new();
    // A directory after the first that cannot be read ends the list: careless writers leave such an end.
    while let Some(directory) = next.and_then(|at| decoder.read_directory(at).ok()) {
        let number = seen.len();
        if number == MOST_PAGES || !seen.insert(next.map(|at| at.0)) {
            return Err(Fault::input(format!("has a list of pages without an end, {number} of them read"))
                .cause("a damaged file")
                .next("write the picture again"));
        }
        let mut tags = decoder.read_directory_tags(&directory);
        let mut number_in = |tag| tags.find_tag_unsigned::<u32>(tag).ok().flatten().unwrap_or(0);
        let (kind, former) = (number_in(Tag::NewSubfileType), number_in(Tag::SubfileType));
        match () {
            () if kind & 4 != 0 => pages.masks.push(number),
            () if kind & 1 != 0 || former == 2 => pages.reduced.push(number),
            () => pages.full.push(number),
        }
        next = directory.next();
    }
    Ok(pages)
}

impl Pages {
    /// The page to read: the only one of full size, or the requested one of them, counted from 1.
    pub fn chosen(&self, page: Option<usize>) -> Result<usize> {
        let several = |what: String| {
            Err(Fault::input(what)
                .cause("several pictures in one file; which of them is meant is not said")
                .next("import-map takes --page N; otherwise save that page as a separate file"))
        };
        match (&self.full[..], page) {
            (full, Some(page)) => match page.checked_sub(1).and_then(|k| full.get(k)) {
                Some(index) => Ok(*index),
                None => several(format!("has {} pages of full size, page {page} is asked for", full.len())),
            },
            ([one], None) => Ok(*one),
            ([], None) if self.reduced.len() == 1 => Ok(self.reduced[0]),
            ([], None) => several(format!("has {} reduced copies and no page of full size", self.reduced.len())),
            (full, None) => several(format!("has {} pages of full size", full.len())),
        }
    }

    /// A note on reduced copies that were skipped.
    pub fn note(&self, chosen: usize) -> Option<String> {
        let reduced = self.reduced.iter().filter(|k| **k != chosen).count();
        (reduced > 0).then(|| format!("{reduced} reduced copies in the file were skipped (NewSubfileType, tag 254)"))
    }
}
