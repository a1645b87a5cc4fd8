//! Reads a height picture, a PLY or a PCD by what it begins with.

use super::raw::Raw;
use super::{pcd, picture, ply};
use crate::fault::{Fault, Result};

/// Reads a file by what it begins with.
///
/// # Errors
/// Other files, damaged ones, more than 64 million points, several pages.
pub fn read_foreign(bytes: &[u8]) -> Result<Raw> {
    read_foreign_page(bytes, None)
}

/// Reads a file of which `page`, counted from 1, is meant.
///
/// # Errors
/// As [`read_foreign`]; a page that is not there.
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
