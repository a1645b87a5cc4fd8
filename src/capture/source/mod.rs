//! In: where pictures come from. Out: one [`PictureSource`](super::PictureSource) for each kind of place.
//! Frame and unit: as [`super::Picture`] has them.

pub mod cell;
pub mod ffmpeg;
pub mod folder;
#[cfg(feature = "gige")]
pub mod gige;
pub mod pipe;
pub mod play;
pub mod sim;
