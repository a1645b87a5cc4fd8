//! In: stops, an approximate camera. Out: stops as input of the joint solve, and the separate calibrations from the
//! same pictures.
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
use crate::calibrate::hand_eye::turns::{read_with, resolve};
use crate::calibrate::joint::shots::{LeftOut, Part, Shot, Spot, thinned};
use crate::calibrate::laser_plane::solve::{LaserPlaneFit, PeakUse};
use crate::calibrate::laser_plane::views::StripePeak;
use crate::calibrate::measured_pose::{MeasuredPose, SeenBoard, measure_view, pooled_factor};
use crate::calibrate::pointer::solve::{PointerFit, SpotView, solve as solve_pointer};
use crate::calibrate::pointer::spot::{SpotPicture, find_spots, hot_pixels};
use crate::camera::{CameraCovariance, Intrinsics};
use crate::fault::{Kind, Result};
use crate::raster::Image;
use crate::recording::Recording;

/// Fewest stops with a robot pose for one board position from which a separate hand-eye transform is computed.
const FEWEST_PAIRS: usize = 4;

/// Separate calibrations from the same pictures, each with the given camera.
#[derive(Default)]
pub struct Separate {
    /// Hand-eye from the board position that most stops show.
    pub hand_eye: Option<HandEyeFit>,
    /// Laser plane from all stops with a stripe.
    pub sheet: Option<LaserPlaneFit>,
    /// Pointer from all stops with a spot.
    pub beam: Option<PointerFit>,
}

/// Stops as input of the joint solve.
pub struct Measured {
    /// One shot per stop whose board has a pose.
    pub shots: Vec<Shot>,
    /// What is excluded, and why.
    pub left_out: Vec<LeftOut>,
    /// Separate calibrations from the same pictures.
    pub separate: Separate,
}

/// Inputs and settings for measuring stops.
pub struct Finders<'a> {
    /// The recordings that contain the stops' pictures.
    pub recordings: &'a [Recording],
    /// The approximate camera.
    pub camera: &'a Intrinsics,
    /// Covariance of its parameters.
    pub covariance: &'a CameraCovariance,
    /// Settings for the stripe.
    pub line: &'a LaserPlaneRun,
    /// Settings for the spot.
    pub pointer: &'a PointerRun,
    /// Whether the camera is on the flange or stands still.
    pub mount: Mount,
}

/// A stop with its board's pose.
type Placed<'a> = (&'a Stop, MeasuredPose);

impl Finders<'_> {
    fn picture(&self, p: &Picture) -> Result<Image> {
        self.recordings[p.recording].picture(&p.file)
    }

    /// A laser's picture of a stop without the room's light, and the picture in room light.
    fn alone(&self, (stop, pose): &Placed<'_>, laser: &Picture) -> Result<(Image, Image, FrameBoard)> {
        let board = stop.board.clone();
        let seen = SeenBoard::from_view(&stop.name, &stop.board, &stop.view);
        let b = FrameBoard { frame: 0, board, seen, pose: pose.clone(), ambiguous: stop.view.ambiguous };
        let room = self.picture(&stop.room)?;
        Ok((room_light::alone(self.picture(laser)?, &room, &b, self.camera), room, b))
    }
}

impl Measured {
    fn leave_out(&mut self, (stop, _): &Placed<'_>, part: Part, why: String) {
        self.left_out.push(LeftOut { name: stop.name.clone(), part, why });
    }
}

/// Measures boards, stripes and spots of all stops.
///
/// # Errors
/// Pictures that cannot be read; poses that do not belong to the pictures of their board; a stripe or a spot that
/// fits no sheet or beam.
pub fn measure(gathered: &Gathered, how: &Finders<'_>) -> Result<Measured> {
    let mut left_out = Vec::new();
    let mut boards: Vec<Placed<'_>> = Vec::new();
    for stop in &gathered.stops {
        match measure_view(&stop.name, how.camera, &stop.board, &stop.view) {
            Ok(pose) => boards.push((stop, pose)),
            Err(fault) => {
                left_out.push(LeftOut { name: stop.name.clone(), part: Part::Features, why: fault.what });
            }
        }
    }
    let seen = |(stop, _): &Placed<'_>| SeenBoard::from_view(&stop.name, &stop.board, &stop.view);
    let shot = |b: &Placed<'_>| Shot { seen: seen(b), robot: b.0.robot, stripe: Vec::new(), spot: None };
    let shots = boards.iter().map(shot).collect();
    let mut out = Measured { shots, left_out, separate: Separate::default() };
    for place in 0..gathered.places {
        robots(&boards, place, how, &mut out)?;
    }
    stripes(&boards, how, &mut out)?;
    spots(&boards, how, &mut out)?;
    Ok(out)
}

/// Gives a position's turned boards one common origin, and excludes poses that contradict the others.
fn robots(boards: &[Placed<'_>], place: usize, how: &Finders<'_>, out: &mut Measured) -> Result<()> {
    let here: Vec<usize> = (0..boards.len()).filter(|&i| boards[i].0.robot.is_some_and(|r| r.place == place)).collect();
    if here.len() < FEWEST_PAIRS {
        for &i in &here {
            out.shots[i].robot = None;
            let why = format!("{} pictures of this board have a pose, {FEWEST_PAIRS} are needed", here.len());
            out.leave_out(&boards[i], Part::RobotPlace, why);
        }
        return Ok(());
    }
    let pair = |&i: &usize| {
        let reported = boards[i].0.robot.expect("filtered");
        Pair::new(how.mount.near_from_far(&reported.pose), boards[i].1.clone())
    };
    let mut pairs: Vec<Pair> = here.iter().map(pair).collect();
    if here.iter().any(|&i| boards[i].0.view.ambiguous) {
        let turns = turns(&boards[here[0]].0.board);
        for ((k, &i), pair) in resolve(&pairs, &turns, 1)?.into_iter().zip(&here).zip(&mut pairs) {
            *pair = read_with(pair, &turns[k]);
            out.shots[i].seen.points.iter_mut().for_each(|p| *p = turns[k].turn.point(p));
        }
    }
    let board_length = format!("{} in meta.json", boards[here[0]].0.board.length_key());
    let o = HandEyeOptions { board_length, ..HandEyeOptions::default() };
    let fit = solve_hand_eye(&pairs, how.mount, how.covariance, how.camera, &o)?;
    for (r, &i) in fit.pairs.iter().zip(&here).filter(|(r, _)| !r.used) {
        out.shots[i].robot = None;
        out.leave_out(&boards[i], Part::RobotPlace, format!("pose and picture disagree by {:.2} mm", r.mm));
    }
    if out.separate.hand_eye.as_ref().is_none_or(|f| f.pairs.len() < here.len()) {
        out.separate.hand_eye = Some(fit);
    }
    Ok(())
}

fn stripes(boards: &[Placed<'_>], how: &Finders<'_>, out: &mut Measured) -> Result<()> {
    let (mut lit, mut images, mut seen) = (Vec::new(), Vec::new(), Vec::new());
    for (i, b) in boards.iter().enumerate() {
        if let Some(laser) = &b.0.line {
            let (image, _, board) = how.alone(b, laser)?;
            lit.push(i);
            images.push(image);
            seen.push(board);
        }
    }
    if lit.len() < 2 {
        return Ok(());
    }
    let (views, fit) = sheet_on_boards(&seen, &images, how.camera, how.covariance, how.line)?;
    for (k, &i) in lit.iter().enumerate() {
        let used = views[k].peaks.iter().zip(&fit.uses[k]).filter(|(_, u)| **u == PeakUse::Used).map(|(p, _)| *p);
        let used: Vec<StripePeak> = used.collect();
        if fit.views[k].used && !used.is_empty() {
            out.shots[i].stripe = thinned(&used);
            continue;
        }
        let why = if fit.views[k].contradicts {
            "its stripe lies off the sheet of the others".into()
        } else {
            format!("{} of {} peaks lie on the board and on the sheet", used.len(), views[k].peaks.len())
        };
        out.leave_out(&boards[i], Part::Stripe, why);
    }
    out.separate.sheet = Some(fit);
    Ok(())
}

/// The spots in the pictures, whether or not they lie on one beam: the stop's index, and its spot.
fn found_spots(boards: &[Placed<'_>], how: &Finders<'_>, out: &mut Measured) -> Result<Vec<(usize, SpotView)>> {
    let (mut lit, mut pictures) = (Vec::new(), Vec::new());
    for (i, b) in boards.iter().enumerate() {
        if let Some(laser) = &b.0.pointer {
            let (image, room, _) = how.alone(b, laser)?;
            lit.push(i);
            pictures.push((image, room));
        }
    }
    let hot = hot_pixels(&pictures.iter().map(|p| &p.0).collect::<Vec<_>>());
    let asked: Vec<SpotPicture<'_>> = pictures
        .iter()
        .zip(&lit)
        .map(|((laser, room), &i)| SpotPicture { name: &boards[i].0.name, laser, ambient: Some(room) })
        .collect();
    let mut views = Vec::new();
    for (found, &i) in find_spots(&asked, &hot, &how.pointer.spots)?.into_iter().zip(&lit) {
        match found {
            Ok(spot) => {
                let pose = boards[i].1.clone();
                views.push((i, SpotView { pose, pixel: spot.pixel, covariance: spot.covariance }));
            }
            Err(fault) => out.leave_out(&boards[i], Part::Spot, first_line(&fault.to_string()).to_owned()),
        }
    }
    Ok(views)
}

fn spots(boards: &[Placed<'_>], how: &Finders<'_>, out: &mut Measured) -> Result<()> {
    if boards.iter().all(|b| b.0.pointer.is_none()) {
        return Ok(());
    }
    let (of, views): (Vec<usize>, Vec<SpotView>) = found_spots(boards, how, out)?.into_iter().unzip();
    let factor = pooled_factor(views.iter().map(|v| &v.pose)).unwrap_or(f64::NAN);
    let fit = solve_pointer(&views, how.camera, how.covariance, factor, &how.pointer.solver)?;
    for ((view, r), &i) in views.iter().zip(&fit.spots).zip(&of) {
        if r.used {
            out.shots[i].spot = Some(Spot { pixel: view.pixel, covariance: view.covariance });
        } else {
            out.leave_out(&boards[i], Part::Spot, format!("it lies {:.1} px off the beam of the others", r.px));
        }
    }
    out.separate.beam = Some(fit);
    Ok(())
}

/// Stops whose poses, stripes and spots were not compared with anything yet: the joint solve does that. A stop
/// whose board has no pose is refused; stripes that determine no sheet are dropped.
pub fn unjudged(stops: &[&Stop], how: &Finders<'_>) -> Result<Vec<Shot>> {
    let mut boards: Vec<Placed<'_>> = Vec::new();
    for stop in stops {
        boards.push((stop, measure_view(&stop.name, how.camera, &stop.board, &stop.view)?));
    }
    let seen = |(stop, _): &Placed<'_>| SeenBoard::from_view(&stop.name, &stop.board, &stop.view);
    let shot = |b: &Placed<'_>| Shot { seen: seen(b), robot: b.0.robot, stripe: Vec::new(), spot: None };
    let shots = boards.iter().map(shot).collect();
    let mut out = Measured { shots, left_out: Vec::new(), separate: Separate::default() };
    match stripes(&boards, how, &mut out) {
        Err(fault) if fault.kind != Kind::Refused => return Err(fault),
        _ => {}
    }
    for (i, view) in found_spots(&boards, how, &mut out)? {
        out.shots[i].spot = Some(Spot { pixel: view.pixel, covariance: view.covariance });
    }
    Ok(out.shots)
}
