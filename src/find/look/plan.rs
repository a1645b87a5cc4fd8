//! In: a part found in one scan, its camera's pose, the calibrations. Out: where the sensor goes for a verification
//! scan, and what share of the error of each number of each calibration the two scans together can show.
//! Frame and unit: base frame, mm; shares of 0 to 2. docs/math.md, Second look.

use super::levers::Lever;
use super::looks::other_side;
use crate::fault::{Fault, Result};
use crate::find::insert::locate::Report;
use crate::geometry::{Base, Rigid};
use crate::rig::Rig;

/// What the scans can show of one number of one calibration.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Shown {
    /// Name of the calibration, see [`Lever::name`].
    pub calibration: &'static str,
    /// The number, with its unit.
    pub parameter: &'static str,
    /// Difference between the scans over the error that it makes in the pose, in position and height, mm over mm. Below
    /// `HIDDEN` the scans cannot show it.
    pub share: f64,
}

/// A planned verification scan.
#[derive(Clone, Debug)]
pub struct LookPlan {
    /// The sensor's motion, which is applied to every pose of the first scan.
    pub base_from_base: Rigid<Base, Base>,
    /// One entry for each number of each calibration.
    pub shown: Vec<Shown>,
}

/// An error stays hidden if less than this share of it shows.
pub const HIDDEN: f64 = 0.3;

impl LookPlan {
    /// The errors that the two scans cannot show, in words.
    pub fn hidden(&self) -> Vec<String> {
        let hidden = self.shown.iter().filter(|s| s.share < HIDDEN);
        hidden.map(|s| format!("{} {}: {:.0} % shows", s.calibration, s.parameter, 100.0 * s.share)).collect()
    }
}

/// Plans a verification scan: turned about the part's normal by `turn_deg` (60 to 300) and tilted about its x by
/// `tilt_deg` (10 to 45 to either side). Errors: numbers out of range, a scan that does not fit the rig.
pub fn plan_look(report: &Report, rig: &Rig, turn_deg: f64, tilt_deg: f64) -> Result<LookPlan> {
    if !(60.0..=300.0).contains(&turn_deg) || !(10.0..=45.0).contains(&tilt_deg.abs()) {
        return Err(Fault::usage(format!(
            "the second scan is turned by {turn_deg} and tilted by {tilt_deg} degrees; allowed are 60 to 300 and 10 \
             to 45 to either side"
        ))
        .cause("a scan from nearly the same side repeats the same error")
        .next("give --turn 180 --tilt 20, or what the robot can reach"));
    }
    let part = &report.base_from_part;
    let Some(seen) = &report.budget.seen else {
        return Err(Fault::refused("the scan does not state its camera's poses")
            .cause("another station's scan, or too few points of one shot on the part")
            .next("give the station that scanned"));
    };
    let second = seen.moved(&other_side(part, turn_deg, tilt_deg)).levers(rig)?;
    let shown = report.budget.levers.iter().zip(&second).flat_map(|(a, b)| shares(a, b)).collect();
    Ok(LookPlan { base_from_base: other_side(part, turn_deg, tilt_deg), shown })
}

fn shares<'a>(first: &'a Lever, second: &'a Lever) -> impl Iterator<Item = Shown> + 'a {
    (0..first.jacobian.ncols()).map(move |k| {
        let (a, b) = (first.jacobian.column(k), second.jacobian.column(k));
        let (error, seen) = (a.rows(0, 3).norm(), (b.rows(0, 3) - a.rows(0, 3)).norm());
        let share = if error > 0.0 { seen / error } else { 1.0 };
        Shown { calibration: first.name, parameter: first.parameters[k], share }
    })
}
