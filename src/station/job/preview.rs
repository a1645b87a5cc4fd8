//! In: a station, a recipe, what is known of board, camera and chain. Out: the sweep that a job would make, and how
//! fast a scan along it goes, before anything moves.
//! Frame and unit: base frame; mm, mm/s, pictures a second.

use super::pace::{Can, Pace, pace};
use super::state::JobState;
use super::sweep::{Board, SweepFigures, sweep};
use crate::fault::Result;
use crate::find::Recipe;
use crate::geometry::{Base, Flange, Rigid};
use crate::rig::Rig;
use crate::station::settings::Settings;

/// What is asked for; what is left open is the station's own.
#[derive(Clone, Debug, Default)]
pub struct PreviewOptions {
    /// A job that touched the board already.
    pub job: Option<JobState>,
    /// Where the flange stands.
    pub start: Option<Rigid<Base, Flange>>,
    /// Where the flange stands when a picture is drawn over; `None`: there.
    pub now: Option<Rigid<Base, Flange>>,
    /// From the camera to the board along its axis, mm, before it was touched; `None`: as far as the rig works.
    pub distance_mm: Option<f64>,
    /// Length of the sweep, mm; `None`: over the part.
    pub sweep_mm: Option<f64>,
    /// From one shot to the next, mm; `None`: the job's.
    pub step_mm: Option<f64>,
    /// `None`: the fastest that camera, chain and station bear.
    pub speed_mm_s: Option<f64>,
    /// The camera's rate, where it is known.
    pub camera_hz: Option<f64>,
    /// The chain's, as it was measured.
    pub chain_hz: Option<f64>,
}

/// A sweep that is looked at.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Preview {
    /// Name of the recipe.
    pub recipe: String,
    /// The board was touched; else it is taken to lie squarely before the camera.
    pub touched: bool,
    /// The sweep.
    pub sweep: SweepFigures,
    /// The flange at the first and the last shot; none where nobody knows where the robot stands.
    pub flange: Option<[Rigid<Base, Flange>; 2]>,
    /// What is swept, and how far a part in its middle reaches, in the camera's picture as it stands now, px; empty:
    /// not known.
    pub seen_px: Vec<Vec<[f64; 2]>>,
    /// What limits the pace.
    pub can: Can,
    /// None where nothing is known that limits it.
    pub pace: Option<Pace>,
}

/// Plans it.
///
/// # Errors
/// Those of [`sweep`] and [`pace`].
pub fn preview(settings: &Settings, rig: &Rig, recipe: &Recipe, options: &PreviewOptions) -> Result<Preview> {
    rig.belong_together()?;
    let touched = options.job.as_ref().and_then(|j| Some(Board { start: j.start, surface: j.surface? }));
    let known = touched.is_some() || options.start.is_some();
    let is_touched = touched.is_some();
    let presumed = || Board::presumed(settings, rig, options.start, options.distance_mm);
    let board = touched.map_or_else(presumed, Ok)?;
    let now = options.now.or(if is_touched { None } else { Some(board.start) });
    let planned = sweep(settings, rig, recipe, options.sweep_mm, 0, &board)?;
    let seen_px = now.and_then(|at| planned.seen(rig, &at)).map_or_else(Vec::new, Vec::from);
    let speed_mm_s = settings.motion.as_ref().map(|m| m.speed_mm_s);
    let can = Can { camera_hz: options.camera_hz, chain_hz: options.chain_hz, speed_mm_s };
    let step = options.step_mm.unwrap_or(planned.figures.step_mm);
    let limited = options.speed_mm_s.is_some() || can != Can::default();
    let pace = limited.then(|| pace(step, options.speed_mm_s, planned.figures.length_mm, &can)).transpose()?;
    let ends = [planned.flanges[0], planned.flanges[planned.flanges.len() - 1]];
    Ok(Preview {
        recipe: recipe.name.clone(),
        touched: is_touched,
        sweep: planned.figures,
        flange: known.then_some(ends),
        seen_px,
        can,
        pace,
    })
}
