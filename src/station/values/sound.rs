//! In: an imported camera and laser plane. Out: an error for a lens that cannot be inverted over the picture, and for a
//! plane that the camera does not see.
//! Frame and unit: camera frame, mm; px.

use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Plane};
use crate::rig::{Measured, depths_seen};

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

/// Refuses a plane that no ray of the picture meets in front of the camera.
pub(super) fn plane(camera: &Intrinsics, plane: &Plane<Camera>) -> Result<()> {
    if Measured::check(camera).and_then(|()| plane.check()).is_err() || depths_seen(camera, plane).is_some() {
        return Ok(());
    }
    let n = plane.normal;
    Err(Fault::input(format!(
        "no ray of the picture meets the laser plane in front of the camera: normal {:.4} {:.4} {:.4}, offset {:.3} mm",
        n.x, n.y, n.z, plane.offset
    ))
    .cause("most likely a plane a x + b y + c z + d = 0, whose d has the other sign; here normal · X = offset_mm")
    .next("change the sign of the offset"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

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

    #[test]
    fn a_plane_with_the_other_sign_is_refused() {
        let n = Vec3::new(0.024438688579233106, 0.8931550075263688, 0.4490844943115932);
        let of = |offset: f64| Plane::<Camera>::new(n, offset).unwrap();
        plane(&camera(0.0), &of(68.65)).unwrap();
        let fault = plane(&camera(0.0), &of(-68.65)).unwrap_err();
        assert!(fault.what.contains("offset -68.650 mm") && fault.next.contains("sign of the offset"), "{fault}");
        // A steep sheet that enters the picture at one side only.
        let steep = Plane::<Camera>::new(Vec3::new(0.0, 1.0, 0.0), 30.0).unwrap();
        plane(&camera(0.0), &steep).unwrap();
    }
}
