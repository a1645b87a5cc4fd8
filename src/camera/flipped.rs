//! The camera model for pictures that were turned or mirrored after they were read from the sensor.

use super::{Intrinsics, LENS, SKEW};

/// A picture that is turned by 180 degrees or mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flip {
    /// Turned by 180 degrees.
    Turned,
    /// Left and right are exchanged.
    LeftRight,
    /// Top and bottom are exchanged.
    UpDown,
}

impl Flip {
    /// All flips.
    pub const ALL: [Flip; 3] = [Flip::Turned, Flip::LeftRight, Flip::UpDown];

    /// Whether the columns and the rows are reversed.
    pub fn reversed(self) -> [bool; 2] {
        [self != Flip::UpDown, self != Flip::LeftRight]
    }

    /// In words; completes "the pictures are ...".
    pub fn words(self) -> &'static str {
        match self {
            Flip::Turned => "turned by 180 degrees",
            Flip::LeftRight => "mirrored left to right",
            Flip::UpDown => "mirrored top to bottom",
        }
    }
}

impl Intrinsics {
    /// The camera model that sees in flipped pictures what this one sees in unflipped ones. Terms of the lens that
    /// shift along x change their sign with the columns, those along y with the rows; radial terms stay.
    pub fn flipped(&self, flip: Flip) -> Intrinsics {
        let [columns, rows] = flip.reversed();
        let mut k = self.parameters();
        let [p1, p2, s1, tau_x, tau_y] = [LENS + 2, LENS + 3, LENS + 8, LENS + 12, LENS + 13];
        let mut opposite = |which: &[usize]| which.iter().for_each(|&i| k[i] = -k[i]);
        if columns {
            opposite(&[p2, s1, s1 + 1, tau_y, SKEW]);
        }
        if rows {
            opposite(&[p1, s1 + 2, s1 + 3, tau_x, SKEW]);
        }
        if columns {
            k[2] = f64::from(self.width) - 1.0 - k[2];
        }
        if rows {
            k[3] = f64::from(self.height) - 1.0 - k[3];
        }
        self.with_parameters(&k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Distortion;
    use crate::geometry::Vec3;

    #[test]
    fn a_flipped_camera_sees_the_flipped_picture() {
        let mut distortion = Distortion::default();
        distortion.0.copy_from_slice(&[
            -0.2, 0.05, 1e-3, -5e-4, 0.01, 0.02, -0.01, 0.005, 1e-3, -2e-3, 5e-4, 1e-3, 0.01, -0.02,
        ]);
        let camera =
            Intrinsics { fx: 700.0, fy: 690.0, cx: 331.0, cy: 222.0, skew: 0.5, distortion, width: 640, height: 480 };
        for flip in Flip::ALL {
            let [columns, rows] = flip.reversed();
            for p in [Vec3::new(20.0, -30.0, 200.0), Vec3::new(-50.0, -10.0, 180.0)] {
                let seen = camera.pixel_from_point(&p).unwrap();
                let sign = |reversed: bool| if reversed { -1.0 } else { 1.0 };
                let other = Vec3::new(p.x * sign(columns), p.y * sign(rows), p.z);
                let flipped = camera.flipped(flip).pixel_from_point(&other).unwrap();
                let u = if columns { 639.0 - seen.x } else { seen.x };
                let v = if rows { 479.0 - seen.y } else { seen.y };
                assert!((flipped.x - u).abs() < 1e-9 && (flipped.y - v).abs() < 1e-9, "{flip:?}: {flipped} {u} {v}");
            }
        }
    }
}
