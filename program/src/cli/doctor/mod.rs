//! In: this machine. Out: the capabilities of its adapters; each stage is tried in a process with limits.
//! Frame and unit: none.

pub mod command;
pub mod trial;
