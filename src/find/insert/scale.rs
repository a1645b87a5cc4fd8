//! In: a scan in which a part was not found. Out: the factor of all distances with which it would be found. A
//! calibration board whose stated size is wrong scales every distance from the camera, and nothing else shows it.
//! Frame and unit: the scan's frame, mm.

use super::locate::{LocateOptions, locate, search, seen};
use super::recipe::Recipe;
use crate::fault::Result;
use crate::scan::{CloudPoint, Shots};

/// The distances with which a part would be found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherScale {
    /// All distances from the camera times this.
    pub factor: f64,
    /// The score that the part then has.
    pub score: f64,
}

/// The largest factor that is tried; the smallest is 1 / `FARTHEST`. Two sizes of one kind of board differ by less.
const FARTHEST: f64 = 1.6;
/// Ratio of neighbouring factors. A model whose size is wrong by half of it still matches.
const STEP: f64 = 1.025;
/// The score has to exceed the recipe's least one by this, because one of forty tries may match clutter.
const LEAD: f64 = 0.15;

/// The scale with which most points lie where the drawing says, if score and agreement keep their limits. The score
/// alone gave 1.16 for a flash whose distances had been divided by 1.25.
///
/// # Errors
/// Those of [`super::locate::locate`] for a cloud or a recipe that cannot be used.
pub fn other_scale(
    cloud: &[CloudPoint],
    shots: &Shots,
    recipe: &Recipe,
    options: &LocateOptions,
) -> Result<Option<OtherScale>> {
    let least = recipe.search.min_score.max(recipe.gates.min_score) + LEAD;
    let options = &LocateOptions { all: false, ..options.clone() };
    let tries = (FARTHEST.ln() / STEP.ln()).floor() as i32;
    let mut best: Option<(f64, OtherScale)> = None;
    for factor in (-tries..=tries).filter(|k| *k != 0).map(|k| STEP.powi(k)) {
        let scaled: Vec<CloudPoint> = cloud
            .iter()
            .filter_map(|p| {
                let place = shots.place(p.shot)?;
                Some(p.moved_to(place.point(&(place.inverse().point(&p.at()) * factor))))
            })
            .collect();
        let (_, map) = seen(&scaled, shots, recipe, options)?;
        let Some(score) = search(&map, recipe, options, least)?.first().map(|m| m.score) else { continue };
        let Ok(report) = locate(&scaled, shots, recipe, None, options) else { continue };
        let gate = report.gates.iter().find(|g| g.name == "agreement").filter(|g| g.passed);
        if let Some(gate) = gate.filter(|g| best.is_none_or(|(agreement, _)| g.value > agreement)) {
            best = Some((gate.value, OtherScale { factor, score }));
        }
    }
    Ok(best.map(|(_, other)| other))
}
