//! In: this machine. Out: what its adapters can do, each stage tried in a process with limits.
//! Frame and unit: none.

pub mod command;
pub mod trial;
