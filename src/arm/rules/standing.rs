//! Whether an arm that was told to move stands still, or its poses do; mm, degrees, ms.

use super::super::TimedPose;
use super::carried::Carried;
use super::tolerances::{ARRIVED, STILL};
use crate::geometry::{Base, Flange, Rigid};
use std::time::{Duration, Instant};

/// From the order to the first movement an arm may take so long, or as long as it may stand on its way where that is more: the controller
/// plans the way and lets go of the brakes.
pub const START: Duration = Duration::from_millis(1000);

/// The leg that is under way.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    /// Where to.
    pub to: Rigid<Base, Flange>,
    /// When it was ordered.
    pub ordered: Instant,
}

/// Where it was when it moved last.
#[derive(Debug, Default)]
pub struct Standing {
    since: Option<Since>,
}

#[derive(Debug)]
struct Since {
    ordered: Instant,
    pose: TimedPose,
    moved: bool,
}

impl Standing {
    /// Why the arm ought to be moving and is not seen to. A pose has changed where a carried point lies more than 0.01 mm or the flange
    /// 0.005 degrees from where it was: the slowest leg, 0.1 mm/s, does three times that in 300 ms. The time has to pass by this machine's clock and
    /// by the controller's: a simulated one may stand still. Within its goal's tolerance an arm may stand: it settles there.
    pub fn judge(&mut self, pose: &TimedPose, leg: Option<&Leg>, carried: &Carried, most: Duration) -> Option<String> {
        let Some(leg) = leg else {
            self.since = None;
            return None;
        };
        let apart = |a: &Rigid<Base, Flange>, b: &Rigid<Base, Flange>, (mm, deg): (f64, f64)| {
            carried.moved(a, b).1 > mm || a.difference(b).0.to_degrees() > deg
        };
        let begun = self.since.as_ref().filter(|s| s.ordered == leg.ordered);
        let Some(since) = begun else {
            // The first pose of this leg: asked for after the order, it is where the arm began, or near it.
            self.since =
                (pose.asked >= leg.ordered).then_some(Since { ordered: leg.ordered, pose: *pose, moved: false });
            return None;
        };
        if apart(&since.pose.base_from_flange, &pose.base_from_flange, STILL) {
            self.since = Some(Since { ordered: leg.ordered, pose: *pose, moved: true });
            return None;
        }
        let here = pose.asked.saturating_duration_since(since.pose.here);
        let there = match (since.pose.device, pose.device) {
            (Some(a), Some(b)) => b.saturating_sub(a),
            _ => here,
        };
        let (still, limit) = (here.min(there), if since.moved { most } else { most.max(START) });
        let (angle, mm) = pose.base_from_flange.difference(&leg.to);
        let arrived = mm <= ARRIVED.0 && angle.to_degrees() <= ARRIVED.1;
        (still > limit && !arrived).then(|| {
            format!(
                "the pose has not changed for {} ms on the way, limit {}: the arm stands, or its poses do",
                still.as_millis(),
                limit.as_millis()
            )
        })
    }
}
