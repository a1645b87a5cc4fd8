//! In: stops in the order in which they were made, and a solve with more robot noise than arms have. Out: the stop at
//! which the board was moved, and the distance.
//! Frame and unit: mm (docs/math.md, Joint calibration (13)).

use super::options::JointOptions;
use super::shots::Shot;
use super::solve::{JointFit, solve};
use crate::geometry::Vec3;

/// Largest plausible scatter of a robot arm per axis, mm.
const SUSPICIOUS_MM: f64 = 0.2;
/// Smallest number of stops before and after the move, so that both poses of the board are determined.
const EITHER_SIDE: usize = 3;
/// With two poses of the board, the robot's scatter must fall at least to this share.
const EXPLAINED: f64 = 1.0 / 3.0;

/// A move of the board.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// The first picture that shows the board at its new pose.
    pub name: String,
    /// Distance between the old and the new position of the board's middle, mm.
    pub mm: f64,
}

/// Searches for a single move of the one board that all stops show. `None` if the robot's scatter is plausible, or if
/// no move explains it.
pub fn moved(shots: &[Shot], fit: &JointFit, o: &JointOptions) -> Option<Moved> {
    if fit.noise.robot_mm < SUSPICIOUS_MM || fit.state.far_from_board.len() != 1 {
        return None;
    }
    let mut all = fit.state.clone();
    all.boards = shots
        .iter()
        .map(|s| super::start::board(&all.camera, &s.seen).map(|m| m.camera_from_board))
        .collect::<Result<_, _>>()
        .ok()?;
    all.far_from_board = vec![all.far_from_board[0]; 2];
    let split = |k: usize| -> Option<JointFit> {
        let mut parted = shots.to_vec();
        parted.iter_mut().skip(k).filter_map(|s| s.robot.as_mut()).for_each(|r| r.place = 1);
        solve(&parted, &all, fit.noise, o).ok().filter(|f| f.left_out.is_empty())
    };
    let (k, best) = (EITHER_SIDE..=shots.len().checked_sub(EITHER_SIDE)?)
        .filter_map(|k| Some((k, split(k)?)))
        .min_by(|a, b| a.1.noise.robot_mm.total_cmp(&b.1.noise.robot_mm))?;
    if best.noise.robot_mm > EXPLAINED * fit.noise.robot_mm {
        return None;
    }
    let points = &shots[k].seen.points;
    let middle = points.iter().sum::<Vec3>() / points.len() as f64;
    let [before, after] = [0, 1].map(|i| best.state.far_from_board[i].point(&middle));
    Some(Moved { name: shots[k].seen.name.clone(), mm: (after - before).norm() })
}
