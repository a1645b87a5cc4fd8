//! Uncertainty of imported values: as stated at the import, else as usual for such calibrations. Standard
//! deviations in mm, degrees and px.

use crate::camera::{ALWAYS_NAMED, NAMES};
use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Mat3, Plane, Vec3};
use crate::rig::{Covariance, Kind};
use nalgebra::{DMatrix, DVector};

/// Stated standard deviations; `None` takes the usual value. No value counts as exact: otherwise two scans of the
/// right part would contradict each other through the errors of robot and calibrations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sigmas {
    /// Sigma of the robot's position, each axis, mm; usually 0.02, the repeatability (ISO 9283) that makers state
    /// for such arms.
    pub robot_mm: Option<f64>,
    /// Sigma of its rotation, each axis, degrees; usually 0.004, which moves a tool 300 mm long by those 0.02 mm.
    pub robot_deg: Option<f64>,
    /// Sigma of a hand-eye's translation, each axis, mm; usually 0.03: typical of 15 to 20 board poses with a robot
    /// as above.
    pub hand_eye_mm: Option<f64>,
    /// Sigma of its rotation, each axis, degrees; usually 0.006: those 0.03 mm seen at 300 mm.
    pub hand_eye_deg: Option<f64>,
    /// Sigma of a laser plane's distance where it is used, mm; usually 0.02: a tenth of a stripe's width of 0.2 mm.
    pub plane_mm: Option<f64>,
    /// Sigma of its tilt, degrees; usually 0.006: 0.02 mm over boards that were shown within 200 mm.
    pub plane_deg: Option<f64>,
    /// Sigma of focal lengths and principal point, px; usually 0.5: with larger ones a camera is not usable.
    pub camera_px: Option<f64>,
}

const MM: &str = "mm";
const DEGREES: &str = "degrees";

/// A standard deviation with its unit and whether somebody stated it.
struct Sigma {
    value: f64,
    unit: &'static str,
    stated: bool,
}

fn sigma(stated: Option<f64>, usual: f64, unit: &'static str) -> Sigma {
    Sigma { value: stated.unwrap_or(usual), unit, stated: stated.is_some() }
}

/// A covariance with its remarks for reports.
pub(super) struct Assumed {
    pub covariance: Covariance,
    pub remarks: Vec<String>,
}

impl Sigmas {
    /// Refuses values that cannot be a rig's standard deviation.
    pub fn check(&self) -> Result<()> {
        let all = [
            ("robot", self.robot_mm, MM),
            ("robot", self.robot_deg, DEGREES),
            ("hand-eye", self.hand_eye_mm, MM),
            ("hand-eye", self.hand_eye_deg, DEGREES),
            ("laser plane", self.plane_mm, MM),
            ("laser plane", self.plane_deg, DEGREES),
            ("camera", self.camera_px, "px"),
        ];
        match all.iter().find(|(_, s, _)| s.is_some_and(|s| !(s > 0.0 && s <= MOST))) {
            Some((what, s, unit)) => Err(Fault::usage(format!(
                "the sigma of the {what} is {} {unit}, above 0 and up to {MOST} are allowed",
                s.expect("just found")
            ))
            .cause("no value is exact, and a larger error is not a calibration")
            .next("state one standard deviation, or omit it: then a usual one is assumed")),
            None => Ok(()),
        }
    }

    /// Sigmas of the robot's poses, mm and degrees, and the remark.
    pub(super) fn robot(&self) -> ([f64; 2], String) {
        let both = [sigma(self.robot_mm, 0.02, MM), sigma(self.robot_deg, 0.004, DEGREES)];
        ([both[0].value, both[1].value], said("the robot's poses scatter", &both))
    }

    /// Covariance of a camera's pose on a flange or in a base frame.
    pub(super) fn pose(&self) -> Assumed {
        let both = [sigma(self.hand_eye_mm, 0.03, MM), sigma(self.hand_eye_deg, 0.006, DEGREES)];
        let (t, w) = (both[0].value.powi(2), both[1].value.to_radians().powi(2));
        let matrix = DMatrix::from_diagonal(&DVector::from_vec(vec![t, t, t, w, w, w]));
        let covariance = Covariance::new(Kind::HandEye.parameters().0, &matrix);
        Assumed { covariance, remarks: vec![said("it is off", &both)] }
    }

    /// Covariance of a plane that tilts about the point where the camera's axis meets it.
    pub(super) fn plane(&self, plane: &Plane<Camera>) -> Assumed {
        let both = [sigma(self.plane_mm, 0.02, MM), sigma(self.plane_deg, 0.006, DEGREES)];
        let n = plane.normal;
        let ahead = plane.offset / n.z;
        // A sheet nearly parallel to the camera's axis meets it outside the usable range.
        let pivot = if ahead > 0.0 && ahead < FARTHEST { Vec3::new(0.0, 0.0, ahead) } else { n * plane.offset };
        let tilt = (Mat3::identity() - n * n.transpose()) * both[1].value.to_radians();
        let mut root = DMatrix::zeros(4, 4);
        root.view_mut((0, 0), (3, 3)).copy_from(&tilt);
        root.view_mut((3, 0), (1, 3)).copy_from(&(pivot.transpose() * tilt));
        root[(3, 3)] = both[0].value;
        let covariance = Covariance::new(Kind::LaserPlane.parameters().0, &(&root * root.transpose()));
        Assumed { covariance, remarks: vec![said("it is off", &both)] }
    }

    /// Covariance of a camera; its lens terms count as known.
    pub(super) fn camera(&self) -> Assumed {
        let px = sigma(self.camera_px, 0.5, "px");
        let mut matrix = DMatrix::zeros(ALWAYS_NAMED, ALWAYS_NAMED);
        (0..4).for_each(|i| matrix[(i, i)] = px.value.powi(2));
        let covariance = Covariance::new(&NAMES[..ALWAYS_NAMED], &matrix);
        let remark = said("focal lengths and principal point are off", &[px]);
        Assumed { covariance, remarks: vec![remark + "; the lens terms count as known"] }
    }
}

/// Largest sigma that a calibration may have, mm, degrees or px.
const MOST: f64 = 10.0;
/// Largest working distance of a camera on an arm, mm.
const FARTHEST: f64 = 5000.0;

/// The remark that every report contains.
fn said(what: &str, sigmas: &[Sigma]) -> String {
    let each: Vec<String> = sigmas.iter().map(|s| format!("{} {}", s.value, s.unit)).collect();
    let whose = match (sigmas.iter().all(|s| s.stated), sigmas.iter().any(|s| s.stated)) {
        (true, _) => "stated at the import",
        (false, true) => "stated at the import in part, the rest assumed",
        (false, false) => "assumed at the import",
    };
    format!("{what} by {} (1 sigma): {whose}, not measured here", each.join(" and "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sigmas_are_those_that_were_stated_and_reports_say_which_were_not() {
        let plane = Plane::new(Vec3::new(0.0, 0.6, 0.8), 200.0).unwrap();
        let usual = Sigmas::default();
        let [tx, rx] = ["tx_mm", "rx_rad"].map(|n| usual.pose().covariance.sigma(n).unwrap());
        assert!((tx - 0.03).abs() < 1e-12 && (rx.to_degrees() - 0.006).abs() < 1e-12, "{tx} {rx}");
        assert!(usual.pose().remarks[0].contains("assumed at the import, not measured here"));
        assert!(usual.robot().1.contains("0.02 mm and 0.004 degrees"), "{}", usual.robot().1);
        let c = usual.plane(&plane).covariance;
        c.check(Kind::LaserPlane).unwrap();
        usual.camera().covariance.check(Kind::Camera).unwrap();
        // Where the camera's axis meets the plane, the depth has the offset's own sigma, whatever the tilt.
        let at = DVector::from_vec(vec![0.0, 0.0, -250.0, 1.0]);
        assert!(((&c.to_matrix() * &at).dot(&at).sqrt() - 0.02).abs() < 1e-9);
        let stated = Sigmas { plane_mm: Some(0.1), plane_deg: Some(0.02), hand_eye_mm: Some(0.2), ..usual };
        assert!(
            stated.plane(&plane).remarks[0].contains("0.1 mm and 0.02 degrees (1 sigma): stated at the import, not")
        );
        assert!(stated.pose().remarks[0].contains("in part"));
        for wrong in [0.0, -1.0, f64::NAN, 11.0] {
            let fault = Sigmas { camera_px: Some(wrong), ..usual }.check().unwrap_err();
            assert!(fault.what.contains("camera"), "{fault}");
        }
        stated.check().unwrap();
    }
}
