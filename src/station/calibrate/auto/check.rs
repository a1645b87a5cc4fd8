//! In: a calibration, stops that it did not use. Out: the distance of points scanned there from the board.
//! Frame and unit: mm.

use crate::calibrate::hand_eye::options::Mount;
use crate::calibrate::joint::shots::Shot;
use crate::calibrate::joint::solve::JointFit;
use crate::calibrate::joint::volume::scanned;
use crate::geometry::{Vec2, Vec3};

/// Check of a calibration with stops that no solve used.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SelfCheck {
    /// Number of stops.
    pub stops: usize,
    /// Number of points of the stripe.
    pub points: usize,
    /// Distance of scanned points from the board's plane, mm rms.
    pub off_mm: f64,
    /// The expected distance from calibration and robot together, mm rms.
    pub expected_mm: f64,
}

/// Checks stops whose stripe lies on the board at place 0; `calibration_mm` is the expected error of a scanned
/// point. `None` if no stop shows a stripe.
pub fn check(fit: &JointFit, mount: Mount, shots: &[Shot], calibration_mm: f64) -> Option<SelfCheck> {
    let (mut squares, mut expected, mut points, mut stops) = (0.0, 0.0, 0usize, 0usize);
    let place = fit.state.far_from_board.first()?;
    for shot in shots {
        let Some(robot) = shot.robot else { continue };
        let board_from_near = place.inverse() * mount.near_from_far(&robot.pose).inverse();
        let height = |pixel: &Vec2| Some(board_from_near.point(&scanned(&fit.state, pixel)?).z);
        let from_flange = |p: &Vec3| match mount {
            Mount::EyeInHand => p.norm(),
            Mount::EyeToHand => mount.near_from_far(&robot.pose).inverse().point(p).norm(),
        };
        let before = points;
        for p in &shot.stripe {
            let Some([z, right, below]) = [Vec2::zeros(), Vec2::x(), Vec2::y()]
                .map(|d| height(&(p.pixel + d)))
                .into_iter()
                .collect::<Option<Vec<f64>>>()
                .and_then(|z| <[f64; 3]>::try_from(z).ok())
            else {
                continue;
            };
            let peak = (right - z).hypot(below - z) * p.sigma_px * fit.noise.stripe;
            // The flange's rotation error moves the point relative to the board by its lever, the distance from the
            // flange.
            let lever = scanned(&fit.state, &p.pixel).map_or(0.0, |p| from_flange(&p)) * fit.noise.robot_rad;
            squares += z * z;
            expected += calibration_mm.powi(2) / 3.0 + fit.noise.robot_mm.powi(2) + lever.powi(2) + peak.powi(2);
            points += 1;
        }
        stops += usize::from(points > before);
    }
    let n = points as f64;
    (points > 0).then(|| SelfCheck { stops, points, off_mm: (squares / n).sqrt(), expected_mm: (expected / n).sqrt() })
}
