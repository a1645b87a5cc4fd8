//! Speed and turning rate of the flange along a leg, so that no carried point is faster than the leg states; mm/s,
//! degrees/s.

use super::super::{Motion, Pace, Way};
use super::carried::Carried;
use super::limits::Limits;
use super::straight::Straight;
use crate::geometry::{Base, Flange, Rigid};

/// The pace of a leg that begins at `from`. Its fastest point has the leg's speed. Where the flange would then turn
/// faster than the limit, speed and turning rate are reduced together.
pub fn pace(from: &Rigid<Base, Flange>, leg: &Motion, carried: &Carried, limits: &Limits) -> Pace {
    let lever_mm = carried.lever_mm();
    if leg.way == Way::Joint {
        // The controller chooses the path: its link has to keep both limits for any path.
        return Pace { flange_mm_s: leg.speed_mm_s, turn_deg_s: limits.max_turn_deg_s, lever_mm };
    }
    let way = Straight::new(from, &leg.to);
    let angle = way.turn.norm().to_degrees();
    let seconds = (carried.fastest(&way) / leg.speed_mm_s).max(angle / limits.max_turn_deg_s);
    if seconds == 0.0 {
        return Pace { flange_mm_s: leg.speed_mm_s, turn_deg_s: 0.0, lever_mm };
    }
    let turn_deg_s = (angle / seconds).min(limits.max_turn_deg_s);
    Pace { flange_mm_s: way.shift.norm() / seconds, turn_deg_s, lever_mm }
}
