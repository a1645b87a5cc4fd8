//! Whether the pictures of a set are all of one camera that was read out in one way. Parts of the set are compared
//! while the board may have any shape: a turned picture is no bent board (docs/math.md, Camera calibration (14)).

mod chance;
mod change;
mod pictures;
mod search;
mod two;
mod verdict;

pub use verdict::{Apart, apart};
