//! In: a station folder. Out: a new one, what one knows, values moved in and out of it, its screen.
//! Frame and unit: camera and flange frames, mm.

mod command;
mod keep;
mod serve;

pub use command::{Command, run};
