//! In: a job that found a part, a picture of the camera on the gripper, the robot's pose at that time. Out: the
//! part's outlines over that picture, and how far the arm's motion may have shifted them.
//! Frame and unit: base frame, mm; px of the picture.

use super::message::{Ghost, Outlines};
use super::screen::Screen;
use super::work::lies;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Flange, Rigid};
use sheetlight::station::ghost;

/// Time at which the camera's picture of this number was taken, ns of the host's clock.
///
/// # Errors
/// No camera, no robot, or a picture that is too old.
pub fn moment(screen: &Screen, number: u64) -> Result<u64> {
    let camera = screen.camera().ok_or_else(|| {
        Fault::input("no camera: the screen was served without --camera").next("start it with --camera URI")
    })?;
    if screen.robot().is_none() {
        return Err(Fault::input("no robot: the camera's pose is unknown")
            .cause("the screen was served without --robot")
            .next("start it with --robot URI"));
    }
    camera.moment(number).ok_or_else(|| Fault::input(format!("picture {number} is long gone")).next("take a newer one"))
}

/// Whether the robot's pose at that time has been read, so that the outlines need no guess.
pub fn known(screen: &Screen, at_ns: u64) -> bool {
    screen.robot().is_some_and(|r| r.track().newest_ns().is_some_and(|t| t >= at_ns))
}

/// The part's outlines over the picture of that time.
///
/// # Errors
/// No part was found, no calibration exists, or the robot's pose at that time was not read.
pub fn over(screen: &Screen, id: &str, number: u64, at_ns: u64) -> Result<Ghost> {
    let about = screen.robot().and_then(|r| r.track().about(at_ns));
    let Some([before, after]) = about else {
        return Err(Fault::refused("the robot's pose of this picture is unknown")
            .cause("its controller does not answer, or the picture is older than the link to it")
            .next("look at the robot's state in the bar; the ghost comes back with its poses"));
    };
    let what = screen.found.read(&screen.jobs, &screen.place.station, id)?;
    let drawn = |at: &Rigid<Base, Flange>| ghost(&what.0, &what.1, &what.2, at);
    let lines = drawn(&before)?;
    let moved_px = if before == after { 0.0 } else { farthest(&lines, &drawn(&after)?) };
    Ok(Ghost { number, lines, moved_px })
}

/// Largest distance between corresponding points of the two, px; `LOST` if they do not correspond.
fn farthest(a: &[Vec<[f64; 2]>], b: &[Vec<[f64; 2]>]) -> f64 {
    const LOST: f64 = 1e4;
    if a.iter().map(Vec::len).ne(b.iter().map(Vec::len)) {
        return LOST;
    }
    let both = a.iter().flatten().zip(b.iter().flatten());
    both.map(|(p, q)| (p[0] - q[0]).hypot(p[1] - q[1])).fold(0.0, f64::max)
}

/// The part's outlines in its scan's frame.
///
/// # Errors
/// As for [`over`], except for camera and robot, which are not needed.
pub fn outlines(screen: &Screen, id: &str) -> Result<Outlines> {
    let (lies, recipe) = lies(&screen.jobs, &screen.jobs.get(id)?)?;
    let lines = lies.outlines(&recipe.drawing());
    let lines = lines.into_iter().map(|l| l.into_iter().map(|p| [p.x, p.y, p.z]).collect()).collect();
    Ok(Outlines { frame: lies.frame, lines })
}
