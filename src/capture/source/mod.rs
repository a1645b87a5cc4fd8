//! In: the name of a source of pictures. Out: a [`PictureSource`](super::PictureSource) for each kind of source.
//! Frame and unit: as in [`super::Picture`].

pub mod cell;
pub mod ffmpeg;
#[cfg(feature = "folder")]
pub mod folder;
#[cfg(feature = "gige")]
pub mod gige;
pub mod pipe;
pub mod play;
pub mod sim;
