//! Reads a picture file of any format, recognised by its first bytes.

use super::picture::{Samples, Wanted};
use super::{other, pgm, png, tiff};
use crate::fault::{Fault, Result};

/// Reads the samples of a picture that is held in memory.
///
/// # Errors
/// Other files, damaged ones, another size, and kinds of samples that no reader here supports.
pub fn read_samples(bytes: &[u8], wanted: &Wanted) -> Result<Samples> {
    let paged = tiff::begins(bytes);
    if let Some(page) = wanted.page.filter(|_| !paged) {
        return Err(
            Fault::usage(format!("page {page} is asked for, but only a TIFF has pages")).next("leave the page out")
        );
    }
    if paged {
        return tiff::read(bytes, wanted);
    }
    if bytes.starts_with(b"P5") || bytes.starts_with(b"P2") {
        return pgm::read(bytes, wanted);
    }
    if bytes.starts_with(png::SIGNATURE) {
        return png::read(bytes, wanted);
    }
    other::read(bytes, wanted)
}
