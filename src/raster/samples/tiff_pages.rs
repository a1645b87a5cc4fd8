//! Finds the pages of a TIFF: pictures of full size, reduced copies of them and masks, in the list of pages and in the
//! directories below a page (SubIFDs).

use crate::fault::{Fault, Result};
use std::collections::BTreeSet;
use std::io::Cursor;
use tiff::Directory;
use tiff::decoder::Decoder;
use tiff::tags::{IfdPointer, Tag};

/// A file with more pages is a film, not a set of pictures.
const MOST_PAGES: usize = 1 << 16;

/// Where a page is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Number in the list of pages, from 0 on; `None` for a page below another one.
    pub listed: Option<usize>,
    /// Position of its directory in the file.
    pub at: u64,
    /// Width and height as stored, px.
    pub size: [u32; 2],
}

/// Pages by type (NewSubfileType, tag 254, and SubfileType, tag 255).
#[derive(Debug, Default)]
pub(super) struct Pages {
    full: Vec<Place>,
    reduced: Vec<Place>,
    /// Masks, which state which pixels of other pages are valid.
    masks: Vec<Place>,
    reduced_masks: Vec<Place>,
}

type File<'a> = Decoder<Cursor<&'a [u8]>>;

pub(super) fn pages(file: &mut File) -> Result<Pages> {
    let mut list: Vec<(u64, Directory)> = vec![];
    let mut seen = BTreeSet::new();
    let mut next = file.ifd_pointer();
    // A directory after the first that cannot be read ends the list: careless writers leave such an end.
    while let Some(at) = next
        && let Ok(directory) = file.read_directory(at)
    {
        if list.len() == MOST_PAGES || !seen.insert(at.0) {
            return Err(Fault::input(format!("has a list of pages without an end, {} of them read", list.len()))
                .cause("a damaged file")
                .next("write the picture again"));
        }
        next = directory.next();
        list.push((at.0, directory));
    }
    let mut pages = Pages::default();
    for (number, (at, directory)) in list.iter().enumerate() {
        let above = pages.take(file, directory, Place { listed: Some(number), at: *at, size: [0; 2] }, None);
        let subs = file.read_directory_tags(directory).find_tag(Tag::SubIfd).ok().flatten();
        for sub in subs.and_then(|v| v.into_ifd_vec().ok()).unwrap_or_default() {
            let mut next = Some(sub);
            while let Some(IfdPointer(at)) = next
                && seen.len() < MOST_PAGES
                && seen.insert(at)
                && let Ok(directory) = file.read_directory(IfdPointer(at))
            {
                pages.take(file, &directory, Place { listed: None, at, size: [0; 2] }, above);
                next = directory.next();
            }
        }
    }
    Ok(pages)
}

impl Pages {
    /// Adds a page; `above` is the size of the full page that it lies below. Returns its size if it is a full page.
    fn take(&mut self, file: &mut File, from: &Directory, place: Place, above: Option<[u32; 2]>) -> Option<[u32; 2]> {
        let mut tags = file.read_directory_tags(from);
        let mut number_in = |tag| tags.find_tag_unsigned::<u32>(tag).ok().flatten().unwrap_or(0);
        let (kind, former) = (number_in(Tag::NewSubfileType), number_in(Tag::SubfileType));
        let size = [number_in(Tag::ImageWidth), number_in(Tag::ImageLength)];
        let place = Place { size, ..place };
        if place.listed.is_none() && size.contains(&0) {
            return None;
        }
        // Some writers do not name the reduced copies below a page as such.
        let smaller = kind == 0 && above.is_some_and(|above| size[0] < above[0] && size[1] < above[1]);
        match (kind & 4 != 0, kind & 1 != 0 || former == 2 || smaller) {
            (true, false) => self.masks.push(place),
            (true, true) => self.reduced_masks.push(place),
            (false, true) => self.reduced.push(place),
            (false, false) => {
                self.full.push(place);
                return Some(size);
            }
        }
        None
    }

    /// The page to read: the only one of full size, or the requested one of them, counted from 1.
    pub fn chosen(&self, page: Option<usize>) -> Result<Place> {
        let several = |what: String| {
            Err(Fault::input(what)
                .cause("several pictures in one file; which of them is meant is not said")
                .next("import-map takes --page N; otherwise save that page as a separate file"))
        };
        let below = match self.full.iter().filter(|p| p.listed.is_none()).count() {
            0 => String::new(),
            n => format!(", {n} of them below another page (SubIFDs, tag 330)"),
        };
        match (&self.full[..], page) {
            (full, Some(page)) => match page.checked_sub(1).and_then(|k| full.get(k)) {
                Some(place) => Ok(*place),
                None => several(format!("has {} pages of full size{below}, page {page} is asked for", full.len())),
            },
            ([one], None) => Ok(*one),
            ([], None) if self.reduced.len() == 1 => Ok(self.reduced[0]),
            ([], None) => several(format!("has {} reduced copies and no page of full size", self.reduced.len())),
            (full, None) => several(format!("has {} pages of full size{below}", full.len())),
        }
    }

    /// The mask of a page. Reduced masks belong to reduced copies, as long as there is one of full size.
    pub fn mask(&self, page: Place) -> Result<Option<Place>> {
        let whole: Vec<Place> = match self.masks[..] {
            [] => self.reduced_masks.iter().filter(|mask| mask.size == page.size).copied().collect(),
            _ => self.masks.clone(),
        };
        match whole[..] {
            [] if self.reduced_masks.is_empty() => Ok(None),
            [mask] => Ok(Some(mask)),
            _ => {
                let all = self.masks.len() + self.reduced_masks.len();
                Err(Fault::input(format!("has {all} masks (NewSubfileType, tag 254)"))
                    .cause("masks of several pages, or of reduced copies alone")
                    .next("save that page with its mask as a separate file"))
            }
        }
    }

    /// Number of pictures in the file, masks left out.
    pub fn pictures(&self) -> usize {
        self.full.len() + self.reduced.len()
    }

    /// A note on reduced copies that were skipped.
    pub fn note(&self, chosen: Place) -> Option<String> {
        let reduced = self.reduced.iter().filter(|k| **k != chosen).count();
        (reduced > 0).then(|| format!("{reduced} reduced copies in the file were skipped (NewSubfileType, tag 254)"))
    }
}
