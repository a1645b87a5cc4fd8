//! Checks that all pictures of a set come from one camera with one readout. Parts of the set are compared while the
//! board may have any shape, because a turned picture must not pass for a bent board (docs/math.md, Camera
//! calibration (14)).

mod chance;
mod change;
mod pictures;
mod search;
mod two;
mod verdict;

pub use verdict::{Apart, apart};
