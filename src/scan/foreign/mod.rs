//! In: height maps and clouds that other sensors and programs wrote. Out: their points in lines, as a scan's.
//! Frame and unit: files in their own frame and unit, which the caller states; points in that frame, mm.

mod fields;
mod lines;
mod missing;
mod pcd;
mod picture;
mod ply;
mod raw;
mod read;
mod stated;

pub use lines::{Lines, lines};
pub use raw::Raw;
pub use read::{read_foreign, read_foreign_page};
pub use stated::Stated;
