//! Reads a height picture, a PLY or a PCD; the first bytes decide which.

use super::raw::Raw;
use super::{pcd, picture, ply};
use crate::fault::{Fault, Result};
use crate::raster::other_format;

/// Reads a file whose first bytes decide its format.
///
/// # Errors
/// Files of other formats, damaged files, more than 64 million points, several pages.
pub fn read_foreign(bytes: &[u8]) -> Result<Raw> {
    read_foreign_page(bytes, None)
}

/// Reads page `page`, counted from 1, of a file.
///
/// # Errors
/// As [`read_foreign`]; a page that does not exist.
pub fn read_foreign_page(bytes: &[u8], page: Option<usize>) -> Result<Raw> {
    let cloud = match () {
        () if bytes.starts_with(b"ply") => ply::read(bytes),
        () if pcd::begins(bytes) => pcd::read(bytes),
        () if other_format(bytes).is_some() => return Err(unread(bytes)),
        () => return picture::read(bytes, page),
    };
    match page {
        Some(page) => Err(Fault::usage(format!("page {page} of a cloud is asked for; only a TIFF has pages"))
            .next("leave --page out")),
        None => cloud,
    }
}

/// The error for a file of a format that is not read.
fn unread(bytes: &[u8]) -> Fault {
    Fault::input(format!("is {}, which is not read", other_format(bytes).unwrap_or("of another format")))
        .cause("heights are read as TIFF, PNG, BMP and PGM, clouds as PLY and PCD")
        .next("export the heights as float TIFF or as PNG of 16 bits, or the points as PLY or PCD")
}
