//! In: an imported camera. Out: an error for a lens that cannot be inverted over the picture.
//! Frame and unit: camera frame, mm; px.

use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::rig::Measured;

/// Refuses a camera whose lens folds inside its picture. What is invalid in other ways is left to its own check.
pub(super) fn lens(c: &Intrinsics) -> Result<()> {
    let Some(at) = Measured::check(c).ok().and_then(|()| c.fold()) else { return Ok(()) };
    let far = (at.x - c.cx).hypot(at.y - c.cy);
    Err(Fault::input(format!(
        "the lens folds back {far:.0} px from the principal point, at {:.0}, {:.0} px of pictures of {}x{} px",
        at.x, at.y, c.width, c.height
    ))
    .cause("lens terms of another model, in another order, with another sign, or of another camera")
    .next("correct the lens terms, or calibrate here: sheetlight calibrate camera"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(k1: f64) -> Intrinsics {
        let distortion = [k1, 0.0, 0.0, 0.0, 0.0].into();
        Intrinsics { fx: 605.7, fy: 605.5, cx: 313.9, cy: 245.2, skew: 0.0, distortion, width: 640, height: 480 }
    }

    #[test]
    fn a_lens_that_folds_in_the_picture_is_refused_with_the_place() {
        lens(&camera(-0.13)).unwrap();
        // r (1 + k1 r²) is largest at r² = -1 / (3 k1): r = 0.4714, seen at two thirds of it.
        let fault = lens(&camera(-1.5)).unwrap_err();
        assert!(fault.what.contains("folds back 190 px") && !fault.next.is_empty(), "{fault}");
        // Metres as focal lengths have an error of their own.
        lens(&Intrinsics { fx: 0.005, fy: 0.005, ..camera(-1.5) }).unwrap();
    }
}
