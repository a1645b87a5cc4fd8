//! In: a camera solved with the plain lens from a board as drawn. Out: the same with what the pictures give reason
//! for: the board's shape, further terms of the lens; without the terms that they do not tell from zero.
//! Frame and unit: the lens's own; px, mm.

mod evidence;
mod families;
mod held_out;
mod shape;

pub(super) use evidence::by_evidence;
pub use families::Doubt;
pub(super) use families::by_families;
pub(super) use shape::{by_shape, resized, shaped};
