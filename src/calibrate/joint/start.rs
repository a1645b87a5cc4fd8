//! In: stops and an approximate camera. Out: a start state by closed forms that are robust against a third of wrong
//! stops.
//! Frame and unit: see `unknowns`; mm, rad, px.

use super::options::JointOptions;
use super::shots::{LeftOut, Part, Shot};
use super::unknowns::State;
use crate::calibrate::boards::{BoardPoint, BoardView};
use crate::calibrate::hand_eye::closed::{Far, Near, Pair, agree, canonical_order};
use crate::calibrate::laser_plane::agree::majority;
use crate::calibrate::laser_plane::options::LaserPlaneOptions;
use crate::calibrate::laser_plane::terms::{Seen, look, on_board};
use crate::calibrate::measured_pose::{MeasuredPose, SeenBoard, measure};
use crate::calibrate::pointer::beam::robust_line;
use crate::calibrate::pose::pose_of_points;
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, Plane, Ray, Rigid, Vec3, orthonormalise};

/// Measures the board's pose in a picture.
pub fn board(camera: &Intrinsics, seen: &SeenBoard) -> Result<MeasuredPose> {
    let points = seen.pixels.iter().zip(&seen.sigmas_px).enumerate();
    let points = points.map(|(feature_id, (&pixel, &sigma_px))| BoardPoint { feature_id, pixel, sigma_px }).collect();
    let view = BoardView { points, ..BoardView::default() };
    let start = pose_of_points(camera, &seen.points, &view).map_err(|e| e.at(&seen.name))?;
    measure(seen, camera, &start.camera_from_board)
}

/// A start state for all parts that the stops contain. `places`: number of boards' poses that the stops refer to.
/// Unknowns without data come from `given`; without it they are the camera's own frame, axis or middle plane. Stops
/// whose board has no pose are removed.
pub fn start(
    shots: &mut Vec<Shot>,
    places: usize,
    camera: &Intrinsics,
    given: Option<&State>,
    o: &JointOptions,
) -> Result<(State, Vec<LeftOut>)> {
    let mut left_out = Vec::new();
    let mut measured: Vec<MeasuredPose> = Vec::new();
    shots.retain(|s| match board(camera, &s.seen) {
        Ok(pose) => {
            measured.push(pose);
            true
        }
        Err(fault) => {
            left_out.push(LeftOut { name: s.seen.name.clone(), part: Part::Features, why: fault.what });
            false
        }
    });
    if shots.is_empty() {
        return Err(Fault::refused("no picture shows a board whose pose is determined")
            .cause("boards were not found, or the camera is another one")
            .next("take pictures with the whole board in view"));
    }
    let boards: Vec<Rigid<Camera, Board>> = measured.iter().map(|m| m.camera_from_board).collect();
    let (near_from_camera, far_from_board) = chain(shots, &measured, places, given, o)?;
    Ok((
        State {
            camera: *camera,
            near_from_camera,
            far_from_board,
            plane: sheet(shots, &boards, camera)
                .or(given.map(|g| g.plane))
                .unwrap_or_else(|| Plane::new(Vec3::z(), 1.0).expect("of length one")),
            beam: beam(shots, &boards, camera)
                .or(given.map(|g| g.beam))
                .unwrap_or_else(|| Ray::new(Vec3::zeros(), Vec3::z()).expect("of length one")),
            boards,
        },
        left_out,
    ))
}

/// Hand-eye from the board's pose that most stops refer to, then all boards' poses from that.
fn chain(
    shots: &[Shot],
    measured: &[MeasuredPose],
    places: usize,
    given: Option<&State>,
    o: &JointOptions,
) -> Result<(Rigid<Near, Camera>, Vec<Rigid<Far, Board>>)> {
    let of = |place: usize| -> Vec<Pair> {
        let here = shots.iter().zip(measured).filter(|(s, _)| s.robot.is_some_and(|r| r.place == place));
        let pair = |(s, m): (&Shot, &MeasuredPose)| {
            Pair::new(o.mount.near_from_far(&s.robot.expect("filtered").pose), m.clone())
        };
        let pairs: Vec<Pair> = here.map(pair).collect();
        canonical_order(&pairs).into_iter().map(|i| pairs[i].clone()).collect()
    };
    let all: Vec<Vec<Pair>> = (0..places).map(of).collect();
    let x = match all.iter().max_by_key(|p| p.len()).filter(|p| p.len() >= 3).map(|p| agree(p, 1)) {
        Some(Some(found)) => found.chain.near_from_camera,
        Some(None) if given.is_none() => {
            return Err(Fault::refused("the hand-eye transform is not determined by these poses")
                .cause("the flange turned about one axis only, or hardly at all")
                .next("turn the flange about a second axis by 20 degrees or more and take more pictures"));
        }
        _ => given.map_or_else(Rigid::identity, |g| g.near_from_camera),
    };
    let mean = |pairs: &Vec<Pair>| -> Rigid<Far, Board> {
        let each: Vec<Rigid<Far, Board>> =
            pairs.iter().map(|p| p.near_from_far.inverse() * x * p.seen.camera_from_board).collect();
        if each.is_empty() {
            return Rigid::identity();
        }
        let rotation = orthonormalise(&each.iter().map(|w| w.rotation).sum());
        // Median of each coordinate: robust against a board that was moved once.
        let middle = |k: usize| {
            let mut v: Vec<f64> = each.iter().map(|w| w.translation[k]).collect();
            v.sort_by(f64::total_cmp);
            v[v.len() / 2]
        };
        Rigid::new(rotation, Vec3::new(middle(0), middle(1), middle(2)))
    };
    Ok((x, all.iter().map(mean).collect()))
}

/// The laser plane on which the stripes of most pictures lie.
fn sheet(shots: &[Shot], boards: &[Rigid<Camera, Board>], camera: &Intrinsics) -> Option<Plane<Camera>> {
    let peaks: Vec<Seen> = shots
        .iter()
        .enumerate()
        .flat_map(|(v, s)| s.stripe.iter().enumerate().filter_map(move |(i, p)| look(camera, v, i, p)))
        .filter(|p| on_board(&boards[p.view], &p.ray).is_some())
        .collect();
    if peaks.len() < 3 {
        return None;
    }
    // An approximate camera bends the sheet, hence the wide gate.
    majority(&peaks, boards, camera, &LaserPlaneOptions { gate_px: 10.0, ..LaserPlaneOptions::default() }).ok()
}

/// The line on which most spots lie.
fn beam(shots: &[Shot], boards: &[Rigid<Camera, Board>], camera: &Intrinsics) -> Option<Ray<Camera>> {
    let lit = |(s, board): (&Shot, &Rigid<Camera, Board>)| {
        let n = camera.normalised_from_pixel(&s.spot?.pixel)?;
        on_board(board, &Vec3::new(n.x, n.y, 1.0))
    };
    let points: Vec<Vec3> = shots.iter().zip(boards).filter_map(lit).collect();
    if points.len() < 2 {
        return None;
    }
    let gates: Vec<f64> = points.iter().map(|p| 4.0 * p.z / camera.fx.min(camera.fy)).collect();
    robust_line(&points, &gates)
}
