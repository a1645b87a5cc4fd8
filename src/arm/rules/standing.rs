//! Detects an arm that was ordered to move but stands still, or whose reported poses do not change; mm, degrees,
//! ms.

use super::super::TimedPose;
use super::carried::Carried;
use super::tolerances::{ARRIVED, STILL};
use crate::geometry::{Base, Flange, Rigid};
use std::time::{Duration, Instant};

/// Longest time from the order to the first movement: the controller plans the path and releases the brakes. Where
/// the allowed standstill on the path is longer, that applies instead.
pub const START: Duration = Duration::from_millis(1000);

/// The leg that is being executed.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    /// Target pose.
    pub to: Rigid<Base, Flange>,
    /// Time of the order.
    pub ordered: Instant,
}

/// The pose at which the arm last moved.
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
    /// The reason if the arm ought to move and its pose does not change. A pose has changed where a carried point
    /// lies more than 0.01 mm, or the flange 0.005 degrees, from where it was. The slowest leg, 0.1 mm/s, moves
    /// three times that far in 300 ms. The time has to pass both on this machine's clock and on the controller's: a
    /// simulated clock may stand still. Within its goal's tolerance an arm may stand: it settles there.
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
            // The first pose of this leg was requested after the order: it is where the arm began, or near it.
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
                "the pose has not changed for {} ms during the motion, limit {}: the arm stopped, or the controller \
                 repeats an old pose",
                still.as_millis(),
                limit.as_millis()
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vec3, exp};

    /// Poses every 4 ms of a leg along x that follows `mm`; the lever is `lever` mm. Returns the time of the halt,
    /// s, and its reason.
    fn judged(mm: impl Fn(f64) -> f64, deg: impl Fn(f64) -> f64, lever: f64, goal: f64) -> Option<(f64, String)> {
        let carried = Carried::new(Some(Vec3::new(lever, 0.0, 0.0)), Ok(vec![]));
        let pose = |t: f64| {
            // Controllers report poses to a micrometre.
            let x = (mm(t) * 1e3).round() * 1e-3;
            let turn = Vec3::z() * deg(t).to_radians();
            Rigid::<Base, Flange>::new(exp(&turn), Vec3::new(x, 0.0, 400.0))
        };
        let leg = Leg { to: pose(goal), ordered: Instant::now() };
        let (mut standing, most) = (Standing::default(), Duration::from_millis(300));
        (0..2000).find_map(|k| {
            let t = 0.004 * f64::from(k);
            let asked = leg.ordered + Duration::from_secs_f64(t);
            let device = Some(Duration::from_secs_f64(7.0 + t));
            let pose = TimedPose { base_from_flange: pose(t), figure: None, asked, here: asked, device };
            standing.judge(&pose, Some(&leg), &carried, most).map(|why| (t, why))
        })
    }

    #[test]
    fn what_stands_on_its_way_is_seen_and_the_slowest_leg_is_not_halted() {
        let still = |_: f64| 0.0;
        assert_eq!(judged(|t| 0.1 * t, still, 0.0, 100.0), None, "0.1 mm/s");
        // A turn that moves a point 300 mm out at 0.1 mm/s, while the flange's origin rests.
        assert_eq!(judged(still, |t| 0.1 / 300.0_f64.to_radians() * t, 300.0, 100.0), None);
        assert_eq!(judged(|t| 20.0 * (t - 0.9).max(0.0), still, 0.0, 100.0), None, "it begins late");
        assert_eq!(judged(|t| 20.0 * t.min(1.0), still, 0.0, 1.0), None, "it waits at its goal");
        let stops = |t: f64| if t > 50.0 { 60.0 } else { 20.0 * t.min(1.0) };
        let (t, why) = judged(stops, still, 0.0, 60.0).expect("it stands on its way");
        assert!((1.29..1.32).contains(&t) && why.contains("limit 300"), "{t} {why}");
        assert_eq!(judged(still, still, 0.0, 100.0), None, "its goal is where it stands");
        let (t, why) = judged(|t| if t > 50.0 { 50.0 } else { 0.0 }, still, 0.0, 60.0).expect("it does not begin");
        assert!((1.0..1.02).contains(&t) && why.contains("limit 1000"), "{t} {why}");
    }
}
