//! In: the words of the command line about cameras and what moves. Out: streams, recordings, features.
//! Frame and unit: as the options say.

pub mod camera;
pub mod options;
mod readout;
pub mod record;
pub mod scanning;
