//! In: stops in the order in which they were made, a solve in which the robot scatters more than arms do. Out: after
//! which stop the board was moved, and how far.
//! Frame and unit: mm (docs/math.md, Joint calibration (13)).

use super::options::JointOptions;
use super::shots::Shot;
use super::solve::{JointFit, solve};
use crate::geometry::Vec3;

/// No arm that calibrates anything scatters more than this per axis, mm.
const SUSPICIOUS_MM: f64 = 0.2;
/// Stops on either side of the move, so that both places are determined.
const EITHER_SIDE: usize = 3;
/// Two places must explain the robot's scatter to this share.
const EXPLAINED: f64 = 1.0 / 3.0;

/// When a board was moved.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// The first picture that shows it at its new place.
    pub name: String,
    /// Distance of its middle from where it was, mm.
    pub mm: f64,
}

/// Looks for one move of the one board that all stops show. `None` where the robot scatters as arms do, or where no
/// move explains it.
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
