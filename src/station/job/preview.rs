//! In: a station, a recipe, data on board, camera and chain. Out: the sweep that a job would make and its possible
//! speed, before anything moves.
//! Frame and unit: base frame; mm, mm/s, pictures a second.

use super::pace::{Can, Pace, pace};
use super::state::JobState;
use super::sweep::{Board, SweepFigures, sweep};
use crate::fault::Result;
use crate::find::Recipe;
use crate::geometry::{Base, Flange, Rigid};
use crate::rig::Rig;
use crate::station::settings::Settings;

/// Options of a preview; `None` means the station's own value.
#[derive(Clone, Debug, Default)]
pub struct PreviewOptions {
    /// State of a job that has already touched the board.
    pub job: Option<JobState>,
    /// Flange pose of the camera's view of the board.
    pub start: Option<Rigid<Base, Flange>>,
    /// Flange pose of the picture that is drawn over; `None`: the same.
    pub now: Option<Rigid<Base, Flange>>,
    /// Distance from the camera to the board along its axis, mm, before the board was touched; `None`: the rig's
    /// working distance.
    pub distance_mm: Option<f64>,
    /// Length of the sweep, mm; `None`: the part's.
    pub sweep_mm: Option<f64>,
    /// Distance between shots, mm; `None`: the job's.
    pub step_mm: Option<f64>,
    /// Speed, mm/s; `None`: the fastest that camera, chain and station allow.
    pub speed_mm_s: Option<f64>,
    /// The camera's rate, if known.
    pub camera_hz: Option<f64>,
    /// The measured rate of the chain.
    pub chain_hz: Option<f64>,
}

/// A planned sweep.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Preview {
    /// Name of the recipe.
    pub recipe: String,
    /// The board was touched; otherwise it is assumed to lie squarely in front of the camera.
    pub touched: bool,
    /// The sweep.
    pub sweep: SweepFigures,
    /// The flange at the first and the last shot; `None` if the robot's pose is unknown.
    pub flange: Option<[Rigid<Base, Flange>; 2]>,
    /// Outline of the swept area, and of a part in its middle, in the camera's present picture, px; empty: unknown.
    pub seen_px: Vec<Vec<[f64; 2]>>,
    /// The limits of the pace.
    pub can: Can,
    /// `None` if no limit is known.
    pub pace: Option<Pace>,
}

/// Plans the sweep.
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
