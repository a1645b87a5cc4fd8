//! In: a camera's URI. Out: its newest picture, its settings, the camera itself for a job.
//! Frame and unit: px of the picture, grey levels, ms; features by their standard names.

mod lent;
mod settings;
mod state;
mod watch;

pub use watch::Camera;
#[cfg(test)]
pub use watch::FRESH;
