//! In: simulated stations and recordings, right and damaged ones. Out: whether `scan`, `live` and `scan-profiles` make
//! the cloud that the truth asks for, and whether what cannot be scanned is explained.
//! Frame and unit: px of the picture, mm of the base frame.

#[path = "../common/mod.rs"]
mod common;

mod axis;
mod bad_input;
mod clouds;
mod engine;
mod golden;
mod inputs;
mod live;
mod print;
mod profiles;
mod readout;
mod resume;
mod round_parts;
mod steps;
