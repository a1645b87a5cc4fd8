//! In: a camera solved with the plain lens from a board as drawn. Out: the same with the additions that the pictures
//! support (the board's shape, further lens terms) and without the terms that they cannot distinguish from zero.
//! Frame and unit: those of the lens; px, mm.

mod evidence;
mod families;
mod held_out;
mod shape;

pub(super) use evidence::{by_evidence, by_folding};
pub use families::Doubt;
pub(super) use families::by_families;
pub(super) use shape::{by_shape, resized, shaped};
