//! In: a grey picture and its skeleton pixels. Out: one sub-pixel peak per skeleton pixel, with width, amplitude,
//! background, signal-to-noise ratio and its standard deviation across the stripe. Frame and unit: image pixels (an
//! integer is a pixel's centre), grey levels of the picture's depth.

pub(in crate::stages) mod across;
pub(in crate::stages) mod fit;
pub mod found;
pub mod frame;
pub mod grey;
pub(in crate::stages) mod lanes;
mod measure;
pub(in crate::stages) mod methods;
mod noise;
pub mod params;
pub(in crate::stages) mod profile;
pub(in crate::stages) mod scoring;
mod stage;
mod twin;
pub(in crate::stages) mod windows;

pub use found::{Peak, Reject, SATURATED};
pub(super) use frame::frame_of;
pub use frame::{PeakFrame, SHARED, UNIFORM};
pub use measure::{CLEAR, DIM, measure};
pub use noise::noise;
pub use params::{Method, PeakParams, Stripe};
pub use stage::{METHOD, QUADS, STAGE, apart, stage_twin};
pub use twin::{TOGETHER, fitted, peaks};
