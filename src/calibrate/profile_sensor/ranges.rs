//! In: numbers of profiles and poses, a user's settings with their ranges. Out: a refusal of what does not fit.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::recording::profiles::Profile;

/// Refuses a setting outside its range: name, value, least and largest value.
pub fn in_ranges(settings: &[(&str, f64, f64, f64)]) -> Result<()> {
    match settings.iter().find(|(_, v, low, high)| !(low..=high).contains(&v)) {
        Some((name, v, low, high)) => {
            Err(Fault::usage(format!("{name} is {v}, {low} to {high} is allowed")).next("choose a value in that range"))
        }
        None => Ok(()),
    }
}

/// Refuses lists of which one is longer, and empty ones.
pub fn paired(profiles: &[Profile], poses: &[Rigid<Base, Flange>]) -> Result<()> {
    if profiles.len() != poses.len() || profiles.is_empty() {
        return Err(Fault::input(format!("{} profiles and {} poses", profiles.len(), poses.len()))
            .cause("a profile or a pose is missing")
            .next("give one pose a profile, in the same order"));
    }
    Ok(())
}

/// Refuses fewer profiles than needed. `target`: the ball, or the plate.
pub fn enough(profiles: &[Profile], poses: &[Rigid<Base, Flange>], least: usize, target: &str) -> Result<()> {
    if profiles.len() == poses.len() && profiles.len() < least {
        return Err(Fault::refused(format!("{} profiles, {least} are needed", profiles.len()))
            .next(format!("scan the {target} from more poses")));
    }
    paired(profiles, poses)
}
