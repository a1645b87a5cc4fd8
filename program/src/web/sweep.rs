//! In: a recipe, the station, the robot's pose, the camera's frame rate, the measured rate. Out: the sweep that a
//! job would make, and how fast a scan along it goes.
//! Frame and unit: poses in the robot's convention; mm, mm/s, frame rates in Hz.

use super::message::{JobState as State, Order, Outcome, SweepAsk, SweepPlan};
use super::screen::{JOBS, Screen};
use super::work::{insertion_of, recipe_named};
use sheetlight::fault::Result;
use sheetlight::rig::Rig;
use sheetlight::robot::Convention;
use sheetlight::station::Settings;
use sheetlight::station::job::{JobState, PreviewOptions, preview};

/// Plans the sweep; nothing moves.
///
/// # Errors
/// Those of [`preview`]; an unknown recipe or job.
pub fn sweep(screen: &Screen, ask: &SweepAsk) -> Result<SweepPlan> {
    let station = &screen.place.station;
    let (settings, rig) = (Settings::load(station)?, Rig::load(station)?);
    let recipe = recipe_named(&screen.place, &ask.recipe)?;
    let job = match &ask.job {
        Some(id) => JobState::load(&insertion_of(&screen.jobs, id)?)?,
        None => None,
    };
    let camera = rig.need_camera()?.value;
    let stands = screen.robot().and_then(|r| r.track().newest());
    let options = PreviewOptions {
        job,
        start: stands,
        now: stands,
        distance_mm: ask.distance_mm,
        sweep_mm: ask.sweep_mm,
        step_mm: ask.step_mm,
        speed_mm_s: ask.speed_mm_s,
        camera_hz: ask.camera_hz.or_else(|| screen.camera()?.rate_hz()),
        chain_hz: measured(screen, [camera.width, camera.height]),
    };
    let robot = settings.robot.unwrap_or(Convention::Matrix);
    Ok(SweepPlan::of(preview(&settings, &rig, &recipe, &options)?, robot))
}

/// Shots per second of the newest scan with pictures of this size.
fn measured(screen: &Screen, size: [u32; 2]) -> Option<f64> {
    screen.jobs.list(JOBS).iter().find_map(|j| match (&j.order, &j.outcome) {
        (Order::Scan(_), Some(Outcome::Scan(f))) if j.state == State::Done && [f.width, f.height] == size => {
            Some(f.shots_per_second).filter(|hz| *hz > 0.0)
        }
        _ => None,
    })
}
