//! In: a robot that sees a board. Out: small moves that keep the board in view, and from them a first camera with
//! its hand-eye transform.
//! Frame and unit: flange, mm, degrees; px.

use super::cell::{Cell, Went};
use super::notebook::Notebook;
use crate::calibrate::hand_eye::closed::{Pair, agree};
use crate::calibrate::hand_eye::options::Mount;
use crate::calibrate::joint::start::board;
use crate::calibrate::measured_pose::SeenBoard;
use crate::camera::{CameraCovariance, Distortion, Intrinsics, Parameters};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid, Vec3};
use crate::station::calibrate::joint::gather::Stop;

/// First moves: turns about the flange's axes with shifts along them, in units of [`TURN_DEG`] and [`SHIFT_MM`].
const MOVES: [[f64; 6]; 9] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    [-1.0, 0.0, 0.0, 0.0, 0.0, -1.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, -1.0],
    [0.0, -1.0, 0.0, 0.0, 0.0, 1.0],
    [0.0, 0.0, 1.5, 1.0, 0.0, 0.0],
    [0.0, 0.0, -1.5, 0.0, 1.0, 0.0],
    [0.7, 0.7, 0.0, -1.0, 0.0, 0.0],
    [-0.7, 0.7, 1.0, 0.0, -1.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.5],
];
const TURN_DEG: f64 = 6.0;
const SHIFT_MM: f64 = 12.0;
/// How often a move after which the board is not in view is repeated with half the distance.
const HALVINGS: usize = 3;
/// Fewest stops of the first moves, which determine the camera's focal length and the hand-eye transform.
const FEWEST: usize = 7;

/// Moves about `home` and takes pictures; finally returns to it.
pub fn moves(cell: &mut dyn Cell, home: &Rigid<Base, Flange>, book: &mut Notebook) -> Result<()> {
    let mut why = String::new();
    for m in MOVES {
        for halved in 0..=HALVINGS {
            let share = 0.5f64.powi(halved as i32);
            let turn = Vec3::new(m[0], m[1], m[2]) * (TURN_DEG.to_radians() * share);
            let step: Rigid<Flange, Flange> =
                Rigid::from_vectors(&turn, Vec3::new(m[3], m[4], m[5]) * (SHIFT_MM * share));
            let to = *home * step;
            if !cell.may(&to)? {
                continue;
            }
            let reported = match cell.go(&to)? {
                Went::There(reported) => reported,
                Went::NotBegun(reason) => {
                    why = reason;
                    continue;
                }
            };
            let (found, reason) = book.stop(cell, &reported)?;
            if found.is_some() {
                break;
            }
            why = reason;
        }
    }
    // If the return is refused, the procedure continues from the arm's present pose.
    let _ = cell.go(home)?;
    if book.stops.len() < FEWEST {
        return Err(Fault::refused(format!(
            "the board was found after {} of {} small moves, {FEWEST} are needed{}",
            book.stops.len() - 1,
            MOVES.len(),
            if why.is_empty() { String::new() } else { format!("; {why}") }
        ))
        .cause("the board lies at the edge of the view, or the moves are not allowed there")
        .next(
            "jog the robot until the board is in the middle of the picture and fills half of it, well inside the box",
        ));
    }
    Ok(())
}

/// Range of trial focal lengths: the shortest as a share of the picture's longer side, and the number of steps of 8
/// %.
const SHORTEST: f64 = 0.5;
const STEPS: i32 = 45;

/// The pinhole camera for which the robot's moves and the board's agree best. A wrong focal length puts the board
/// at a wrong distance, which contradicts the robot's shifts.
pub fn camera(stops: &[Stop], mount: Mount, size: [u32; 2]) -> Result<Intrinsics> {
    let [width, height] = size;
    let long = f64::from(width.max(height));
    let (cx, cy) = (f64::from(width - 1) / 2.0, f64::from(height - 1) / 2.0);
    let pinhole =
        |f: f64| Intrinsics { fx: f, fy: f, cx, cy, skew: 0.0, distortion: Distortion::default(), width, height };
    let misfit = |k: &Intrinsics| {
        let pair = |s: &Stop| {
            let seen = board(k, &SeenBoard::from_view(&s.name, &s.board, &s.view)).ok()?;
            Some(Pair::new(mount.near_from_far(&s.robot?.pose), seen))
        };
        let pairs: Vec<Pair> = stops.iter().filter_map(pair).collect();
        // In px: otherwise a camera that puts the board far away would be preferred for its smaller millimetres.
        let depth = pairs.iter().map(|p| p.seen.centre().z).sum::<f64>() / pairs.len().max(1) as f64;
        agree(&pairs, 1).filter(|a| a.agreeing.len() * 3 >= pairs.len() * 2).map(|a| a.spread * k.fx / depth)
    };
    (0..STEPS)
        .map(|i| pinhole(SHORTEST * long * 1.08f64.powi(i)))
        .filter_map(|k| Some((misfit(&k)?, k)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, k)| k)
        .ok_or_else(|| {
            Fault::input("no camera explains how the board moved with the robot")
                .cause(match mount {
                    Mount::EyeInHand => {
                        "the board moved, the robot's poses are of another tool or in another unit, \
                                         or the camera is not on the flange"
                    }
                    Mount::EyeToHand => {
                        "the board slips on the flange, the robot's poses are of another tool or in \
                                         another unit, or the camera moves"
                    }
                })
                .next(
                    "check tool and work number of the controller (0), that the board is fixed, and where the camera \
                     is (mount in station.toml)",
                )
        })
}

/// Prior of any camera, which keeps a solve from few pictures from diverging: a principal point near the middle and
/// a moderate distortion.
pub fn usual(k: &Intrinsics) -> CameraCovariance {
    let (w, h) = (f64::from(k.width), f64::from(k.height));
    let sigmas = [0.2 * k.fx, 0.2 * k.fx, 0.05 * w, 0.05 * h, 0.3, 0.5, 0.005, 0.005, 0.5];
    let sigma = Parameters::from_fn(|i, _| sigmas.get(i).copied().unwrap_or(0.0));
    CameraCovariance::independent(&sigma).expect("a camera's numbers are finite")
}
