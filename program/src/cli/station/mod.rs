//! In: a station folder. Out: a new station, a summary, values imported or exported, the operator's screen.
//! Frame and unit: camera and flange frames, mm.

mod command;
mod keep;
mod serve;

pub use command::{Command, run};
