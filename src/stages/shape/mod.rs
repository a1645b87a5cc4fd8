//! In: slopes of a picture, a model's features. Out: the stages that score the model at every turn and place. Frame and
//! unit: strided places of a pyramid level; a perfect feature scores 4.

pub mod cases;
pub mod frame;
pub mod maps;
pub mod sums;
