//! In: command-line options for cameras and what moves. Out: streams, recordings, features.
//! Frame and unit: stated by the options.

pub mod camera;
pub mod options;
mod readout;
pub mod record;
pub mod scanning;
