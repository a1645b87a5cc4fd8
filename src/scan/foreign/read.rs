//! In: the bytes of a TIFF, PNG, PGM, BMP, PLY or PCD. Out: what it holds.
//! Frame and unit: the file's own.

use super::raw::Raw;
use super::{pcd, picture, ply};
use crate::fault::Result;

/// Reads a file by what it begins with.
///
/// # Errors
/// Other files, damaged ones, more than 64 million points.
pub fn read_foreign(bytes: &[u8]) -> Result<Raw> {
    if bytes.starts_with(b"ply") {
        return ply::read(bytes);
    }
    if pcd::begins(bytes) {
        return pcd::read(bytes);
    }
    picture::read(bytes)
}
