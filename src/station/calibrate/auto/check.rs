//! In: a calibration, stops that it did not see. Out: how far points that it scans there lie from where the board is.
//! Frame and unit: mm.

use crate::calibrate::hand_eye::options::Mount;
use crate::calibrate::joint::shots::Shot;
use crate::calibrate::joint::solve::JointFit;
use crate::calibrate::joint::volume::scanned;
use crate::geometry::{Vec2, Vec3};

/// What stops that no solve saw say of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SelfCheck {
    /// How many stops.
    pub stops: usize,
    /// How many points of the stripe.
    pub points: usize,
    /// Distance of scanned points from the board's plane, mm rms.
    pub off_mm: f64,
    /// What calibration and robot together are expected to make of it, mm rms.
    pub expected_mm: f64,
}

/// Of stops whose stripe lies on the board at place 0; `calibration_mm` is the expected error of a scanned point.
/// `None` where no stop shows a stripe.
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
            // The flange's turn moves the point against the board by its lever: how far it lies from the flange.
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
