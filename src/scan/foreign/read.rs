//! Reads a height picture, a PLY or a PCD; the first bytes decide which.

use super::raw::Raw;
use super::{pcd, picture, ply};
use crate::fault::{Fault, Result};

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
        () => return picture::read(bytes, page),
    };
    match page {
        Some(page) => Err(Fault::usage(format!("page {page} of a cloud is asked for; only a TIFF has pages"))
            .next("leave --page out")),
        None => cloud,
    }
}
