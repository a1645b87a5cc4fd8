//! In: where pictures come from. Out: one [`PictureSource`](super::PictureSource) for each kind of place.
//! Frame and unit: as [`super::Picture`] has them.

pub mod cell;
pub mod pipe;
