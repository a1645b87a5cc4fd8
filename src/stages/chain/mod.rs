//! In: pictures, a batch at a time. Out: the stages in their order on one GPU: skeleton pixels, peaks, points.
//! Frame and unit: pixels; points in the poses' frame, mm.

pub mod batches;
pub mod config;
pub mod measure;
pub mod measured;
pub mod part;
mod recorded;

pub use batches::{Batch, Chain};
pub use config::ChainConfig;
pub use measure::Measure;
