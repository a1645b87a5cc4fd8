//! In: pictures of laser stripes, drawn or simulated, with known truth. Out: whether the way from pixels to a cloud
//! is right on GPU and twins, and whether what cannot be scanned is explained.
//! Frame and unit: px of the picture, mm of the base frame.

#[path = "../common/mod.rs"]
mod common;

mod axis;
mod bad_input;
mod brackets;
mod chain;
mod clouds;
mod cramer_rao;
mod cut_stripes;
mod engine;
mod faint_stripes;
mod golden;
mod inputs;
mod live;
mod masks;
mod print;
mod profiles;
mod readout;
mod resume;
mod round_parts;
mod shift_scan;
mod speckle_grain;
mod steps;
mod wide_stripes;
