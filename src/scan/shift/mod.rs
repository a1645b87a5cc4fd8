//! In: pictures of a stripe on a moving bed. Out: heights from the stripe's sideways shift; no calibration is
//! needed.
//! Frame and unit: x along the stripe, y along the travel, z up from the bed; mm (docs/math.md, Shift).

mod crossing;
mod folder;
mod judge;
pub(super) mod plateau;
pub(super) mod scan;
