//! In: grey pictures of the stripe. Out: the steps from them to points, each as a WGSL stage with its CPU twin. Frame
//! and unit: image pixels (x right, y down, an integer is a pixel's centre), grey levels.

pub mod cases;
pub mod chain;
mod entry;
pub mod frame;
pub mod grid;
pub mod host;
mod list;
pub mod listing;
pub mod noise;
mod numbers;
pub mod peak;
mod same;
pub mod shape;
pub mod step;
pub mod stripe;
pub mod support;

pub use entry::{Case, Entry, Verdict};
pub use frame::Frame;
pub use list::all;
pub use numbers::NUMBERS;
pub use same::{Same, differing_words, differing_words_beside_order};
pub use stripe::thin::Thinning;
pub use stripe::threshold_params::{ThresholdParams, Window};
