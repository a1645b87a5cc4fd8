//! In: stops, a camera that is roughly right. Out: stops as the joint solve takes them, and what separate calibrations of the
//! same pictures come to.
//! Frame and unit: mm, px.

use super::super::board_views::FrameBoard;
use super::super::hand_eye::first_line;
use super::super::laser_plane::{LaserPlaneRun, sheet_on_boards};
use super::super::pointer::PointerRun;
use super::super::room_light;
use super::gather::{Gathered, Picture, Stop};
use crate::calibrate::boards::turns;
use crate::calibrate::hand_eye::closed::Pair;
use crate::calibrate::hand_eye::fit::HandEyeFit;
use crate::calibrate::hand_eye::options::{HandEyeOptions, Mount};
use crate::calibrate::hand_eye::solve::solve as solve_hand_eye;
use crate::calibrate::hand_eye::turns::resolve;
use crate::calibrate::joint::shots::{LeftOut, Part, Shot, Spot, thinned};
use crate::calibrate::joint::start::near_from_far;
use crate::calibrate::laser_plane::solve::{LaserPlaneFit, PeakUse};
use crate::calibrate::laser_plane::views::StripePeak;
use crate::calibrate::measured_pose::{MeasuredPose, SeenBoard, measure_view, pooled_factor};
use crate::calibrate::pointer::solve::{PointerFit, SpotView, solve as solve_pointer};
use crate::calibrate::pointer::spot::{SpotPicture, find_spots, hot_pixels};
use crate::camera::{Intrinsics, ParameterCovariance};
use crate::fault::Result;
use crate::raster::Image;
use crate::recording::Recording;

/// Fewest stops with a robot's pose before one board from which a hand-eye transform is worked out by itself.
const FEWEST_PAIRS: usize = 4;

/// What separate calibrations of the same pictures come to, each with the camera that was given.
#[derive(Default)]
pub struct Separate {
    /// From the place that most stops show.
    pub hand_eye: Option<HandEyeFit>,
    /// From all stops with a stripe.
    pub sheet: Option<LaserPlaneFit>,
    /// From all stops with a spot.
    pub beam: Option<PointerFit>,
}

/// Stops as the joint solve takes them.
pub struct Measured {
    /// One a stop whose board has a pose.
    pub shots: Vec<Shot>,
    /// What does not count, and why.
    pub left_out: Vec<LeftOut>,
    /// Of the same pictures.
    pub separate: Separate,
}

/// How stripes and spots are found, and who carries the camera.
pub struct Finders<'a> {
    /// Of the stripe.
    pub line: &'a LaserPlaneRun,
    /// Of the spot.
    pub pointer: &'a PointerRun,
    /// Who carries the camera.
    pub mount: Mount,
}

fn picture(recordings: &[Recording], p: &Picture) -> Result<Image> {
    recordings[p.recording].picture(&p.file)
}

/// Measures boards, stripes and spots of all stops.
///
/// # Errors
/// Pictures that cannot be read; poses that do not belong to the pictures of their board; a stripe or a spot that no sheet or
/// beam explains.
pub fn measure(
    recordings: &[Recording],
    gathered: &Gathered,
    camera: &Intrinsics,
    covariance: &ParameterCovariance,
    how: &Finders<'_>,
) -> Result<Measured> {
    let mut left_out = Vec::new();
    let mut boards: Vec<(&Stop, MeasuredPose)> = Vec::new();
    for stop in &gathered.stops {
        match measure_view(&stop.name, camera, &stop.board, &stop.view) {
            Ok(pose) => boards.push((stop, pose)),
            Err(fault) => {
                left_out.push(LeftOut { name: stop.name.clone(), part: Part::Features, why: fault.what });
            }
        }
    }
    let seen = |(stop, _): &(&Stop, MeasuredPose)| SeenBoard::from_view(&stop.name, &stop.board, &stop.view);
    let mut shots: Vec<Shot> =
        boards.iter().map(|b| Shot { seen: seen(b), robot: b.0.robot, stripe: Vec::new(), spot: None }).collect();
    let mut separate = Separate::default();
    robots(&boards, gathered.places, camera, covariance, how, &mut shots, &mut left_out, &mut separate)?;
    stripes(recordings, &boards, camera, covariance, how, &mut shots, &mut left_out, &mut separate)?;
    spots(recordings, &boards, camera, covariance, how, &mut shots, &mut left_out, &mut separate)?;
    Ok(Measured { shots, left_out, separate })
}

/// Reads turned boards alike, leaves out the poses that contradict the others of their board, place by place.
#[allow(clippy::too_many_arguments)]
fn robots(
    boards: &[(&Stop, MeasuredPose)],
    places: usize,
    camera: &Intrinsics,
    covariance: &ParameterCovariance,
    how: &Finders<'_>,
    shots: &mut [Shot],
    left_out: &mut Vec<LeftOut>,
    separate: &mut Separate,
) -> Result<()> {
    let mut most = 0;
    for place in 0..places {
        let here: Vec<usize> =
            (0..boards.len()).filter(|&i| boards[i].0.robot.is_some_and(|r| r.place == place)).collect();
        if here.len() < FEWEST_PAIRS {
            for &i in &here {
                shots[i].robot = None;
                let why = format!("{} pictures of this board have a pose, {FEWEST_PAIRS} are needed", here.len());
                left_out.push(LeftOut { name: boards[i].0.name.clone(), part: Part::RobotPlace, why });
            }
            continue;
        }
        let pair = |&i: &usize| {
            let reported = boards[i].0.robot.expect("filtered");
            Pair { near_from_far: near_from_far(how.mount, &reported.pose), seen: boards[i].1.clone() }
        };
        let mut pairs: Vec<Pair> = here.iter().map(pair).collect();
        if here.iter().any(|&i| boards[i].0.view.ambiguous) {
            let turns = turns(&boards[here[0]].0.board);
            for ((k, &i), pair) in resolve(&pairs, &turns, 1)?.into_iter().zip(&here).zip(&mut pairs) {
                *pair = crate::calibrate::hand_eye::turns::read_with(pair, &turns[k]);
                shots[i].seen.points.iter_mut().for_each(|p| *p = turns[k].turn.point(p));
            }
        }
        let o = HandEyeOptions {
            board_length: format!("{} in meta.json", boards[here[0]].0.board.length_key()),
            ..HandEyeOptions::default()
        };
        let fit = solve_hand_eye(&pairs, how.mount, covariance, camera, &o)?;
        for (r, &i) in fit.pairs.iter().zip(&here).filter(|(r, _)| !r.used) {
            shots[i].robot = None;
            let why = format!("pose and picture disagree by {:.2} mm", r.mm);
            left_out.push(LeftOut { name: boards[i].0.name.clone(), part: Part::RobotPlace, why });
        }
        if here.len() > most {
            most = here.len();
            separate.hand_eye = Some(fit);
        }
    }
    Ok(())
}

#[allow(clippy::too_many_arguments)]
fn stripes(
    recordings: &[Recording],
    boards: &[(&Stop, MeasuredPose)],
    camera: &Intrinsics,
    covariance: &ParameterCovariance,
    how: &Finders<'_>,
    shots: &mut [Shot],
    left_out: &mut Vec<LeftOut>,
    separate: &mut Separate,
) -> Result<()> {
    let lit: Vec<usize> = (0..boards.len()).filter(|&i| boards[i].0.line.is_some()).collect();
    if lit.len() < 2 {
        return Ok(());
    }
    let (mut images, mut seen) = (Vec::new(), Vec::new());
    for &i in &lit {
        let (stop, pose) = &boards[i];
        let b = FrameBoard { frame: 0, board: stop.board.clone(), pose: pose.clone(), ambiguous: stop.view.ambiguous };
        let laser = picture(recordings, stop.line.as_ref().expect("filtered"))?;
        images.push(room_light::alone(laser, &picture(recordings, &stop.room)?, &b, camera));
        seen.push(b);
    }
    let (views, fit) = sheet_on_boards(&seen, &images, camera, covariance, how.line)?;
    for (k, &i) in lit.iter().enumerate() {
        let used = views[k].peaks.iter().zip(&fit.uses[k]).filter(|(_, u)| **u == PeakUse::Used).map(|(p, _)| *p);
        let used: Vec<StripePeak> = used.collect();
        if !fit.views[k].used || used.is_empty() {
            let why = if fit.views[k].contradicts {
                "its stripe lies off the sheet of the others".into()
            } else {
                format!("{} of {} peaks lie on the board and on the sheet", used.len(), views[k].peaks.len())
            };
            left_out.push(LeftOut { name: boards[i].0.name.clone(), part: Part::Stripe, why });
            continue;
        }
        shots[i].stripe = thinned(&used);
    }
    separate.sheet = Some(fit);
    Ok(())
}

#[allow(clippy::too_many_arguments)]
fn spots(
    recordings: &[Recording],
    boards: &[(&Stop, MeasuredPose)],
    camera: &Intrinsics,
    covariance: &ParameterCovariance,
    how: &Finders<'_>,
    shots: &mut [Shot],
    left_out: &mut Vec<LeftOut>,
    separate: &mut Separate,
) -> Result<()> {
    let lit: Vec<usize> = (0..boards.len()).filter(|&i| boards[i].0.pointer.is_some()).collect();
    if lit.is_empty() {
        return Ok(());
    }
    let mut pictures = Vec::new();
    for &i in &lit {
        let (stop, pose) = &boards[i];
        let b = FrameBoard { frame: 0, board: stop.board.clone(), pose: pose.clone(), ambiguous: stop.view.ambiguous };
        let room = picture(recordings, &stop.room)?;
        let laser = picture(recordings, stop.pointer.as_ref().expect("filtered"))?;
        pictures.push((room_light::alone(laser, &room, &b, camera), room));
    }
    let hot = hot_pixels(&pictures.iter().map(|p| &p.0).collect::<Vec<_>>());
    let asked: Vec<SpotPicture<'_>> = pictures
        .iter()
        .zip(&lit)
        .map(|((laser, room), &i)| SpotPicture { name: &boards[i].0.name, laser, ambient: Some(room) })
        .collect();
    let (mut views, mut of) = (Vec::new(), Vec::new());
    for (found, &i) in find_spots(&asked, &hot, &how.pointer.spots)?.into_iter().zip(&lit) {
        match found {
            Ok(spot) => {
                views.push(SpotView { pose: boards[i].1.clone(), pixel: spot.pixel, covariance: spot.covariance });
                of.push(i);
            }
            Err(fault) => {
                let why = first_line(&fault.to_string()).to_owned();
                left_out.push(LeftOut { name: boards[i].0.name.clone(), part: Part::Spot, why });
            }
        }
    }
    let factor = pooled_factor(views.iter().map(|v| &v.pose)).unwrap_or(f64::NAN);
    let fit = solve_pointer(&views, camera, covariance, factor, &how.pointer.solver)?;
    for ((view, r), &i) in views.iter().zip(&fit.spots).zip(&of) {
        if r.used {
            shots[i].spot = Some(Spot { pixel: view.pixel, covariance: view.covariance });
        } else {
            let why = format!("the spot lies {:.1} px off the beam of the others", r.px);
            left_out.push(LeftOut { name: boards[i].0.name.clone(), part: Part::Spot, why });
        }
    }
    separate.beam = Some(fit);
    Ok(())
}
