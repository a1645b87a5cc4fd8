//! Reads the samples of a picture file as they are written, and what the file itself states about them.

mod kind;
mod other;
mod pgm;
mod picture;
mod png;
mod read;
mod says;
mod tiff;
mod tiff_land;
mod tiff_pages;
mod tiff_said;
mod tiff_tags;
mod turn;
mod xmp;

pub use kind::Kind;
pub(super) use kind::Values;
pub use picture::{Samples, Wanted};
pub use read::read_samples;
pub use says::{Says, unit_mm};
