//! In: the table `[motion]` of station.toml. Out: the limits of every motion.
//! Frame and unit: base frame; mm, mm/s, degrees, degrees/s, s.

use crate::fault::{Fault, Result};
use crate::geometry::Vec3;

/// Upper limit of the speed of any carried point, mm/s, whatever is requested. ISO 10218-1:2011, 5.6.2: under
/// reduced speed control the speed of the tool centre point is at most this. It does not replace the reduced speed
/// control of that standard, which has to be the controller's own.
pub const MOST_SPEED_MM_S: f64 = 250.0;

/// A box, base frame, mm.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Space {
    /// Its lowest corner.
    pub from_mm: [f64; 3],
    /// Its highest corner.
    pub to_mm: [f64; 3],
}

impl Space {
    /// Distance of a point outside the box, mm; 0 inside, infinite if a coordinate is NaN, which `max` would
    /// ignore.
    pub fn outside(&self, p: &Vec3) -> f64 {
        if p.iter().any(|x| x.is_nan()) {
            return f64::INFINITY;
        }
        (0..3).map(|k| (self.from_mm[k] - p[k]).max(p[k] - self.to_mm[k]).max(0.0)).fold(0.0, f64::max)
    }

    /// Length of a straight segment inside the box, mm.
    pub fn inside_of(&self, a: &Vec3, b: &Vec3) -> f64 {
        let (way, mut enter, mut leave) = (b - a, 0f64, 1f64);
        for k in 0..3 {
            if way[k].abs() < 1e-12 {
                if a[k] < self.from_mm[k] || a[k] > self.to_mm[k] {
                    return 0.0;
                }
                continue;
            }
            let (x, y) = ((self.from_mm[k] - a[k]) / way[k], (self.to_mm[k] - a[k]) / way[k]);
            (enter, leave) = (enter.max(x.min(y)), leave.min(x.max(y)));
        }
        // A segment that only touches the box has no length inside, and neither has a point that does not move:
        // both count as 1e-6.
        if leave < enter { 0.0 } else { ((leave - enter) * way.norm()).max(1e-6) }
    }
}

/// The limits of every motion.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Allowed space of the flange's origin.
    pub workspace: Space,
    /// Spaces that neither the flange nor anything that it carries may enter.
    #[serde(default)]
    pub keep_out: Vec<Space>,
    /// Speed of the fastest of flange, tool's tip and sensor head, mm/s, 1 to 250.
    #[serde(default = "speed")]
    pub speed_mm_s: f64,
    /// Longest single motion, mm, 1 to 2000.
    #[serde(default = "step")]
    pub max_step_mm: f64,
    /// Largest turn of a single motion, degrees, 1 to 180.
    #[serde(default = "turn")]
    pub max_turn_deg: f64,
    /// Greatest turning rate of the flange, degrees/s, 1 to 180: it also bounds the speed of parts that nobody has
    /// described.
    #[serde(default = "turning")]
    pub max_turn_deg_s: f64,
    /// Largest angle between the flange's axis and the measured normal, if one was measured, degrees, 0.1 to 60.
    #[serde(default = "tilt")]
    pub max_tilt_deg: f64,
    /// Greatest age of a scan that a motion is based on, s, 1 to 86400.
    #[serde(default = "age")]
    pub max_scan_age_s: f64,
    /// How long a confirmation is valid after the pose was shown, s, 1 to 600.
    #[serde(default = "shown")]
    pub max_shown_s: f64,
    /// Longest time without a pose while the arm moves; a longer silence stops it; ms, 50 to 5000.
    #[serde(default = "silence")]
    pub max_silence_ms: f64,
    /// Longest time for which the pose may stay unchanged during a motion before the motion is stopped, ms, 200 to
    /// 5000.
    #[serde(default = "still")]
    pub max_still_ms: f64,
}

fn speed() -> f64 {
    50.0
}
fn step() -> f64 {
    400.0
}
fn turn() -> f64 {
    120.0
}
fn tilt() -> f64 {
    25.0
}
fn age() -> f64 {
    900.0
}
fn shown() -> f64 {
    120.0
}
fn silence() -> f64 {
    400.0
}
fn turning() -> f64 {
    30.0
}
fn still() -> f64 {
    300.0
}

impl Limits {
    /// The default limits within a space.
    pub fn within(workspace: Space) -> Limits {
        Limits {
            workspace,
            keep_out: vec![],
            speed_mm_s: speed(),
            max_step_mm: step(),
            max_turn_deg: turn(),
            max_turn_deg_s: turning(),
            max_tilt_deg: tilt(),
            max_scan_age_s: age(),
            max_shown_s: shown(),
            max_silence_ms: silence(),
            max_still_ms: still(),
        }
    }

    /// Refuses numbers outside the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("speed_mm_s", self.speed_mm_s, 1.0, MOST_SPEED_MM_S),
            ("max_step_mm", self.max_step_mm, 1.0, 2000.0),
            ("max_turn_deg", self.max_turn_deg, 1.0, 180.0),
            ("max_turn_deg_s", self.max_turn_deg_s, 1.0, 180.0),
            ("max_tilt_deg", self.max_tilt_deg, 0.1, 60.0),
            ("max_scan_age_s", self.max_scan_age_s, 1.0, 86_400.0),
            ("max_shown_s", self.max_shown_s, 1.0, 600.0),
            ("max_silence_ms", self.max_silence_ms, 50.0, 5000.0),
            ("max_still_ms", self.max_still_ms, 200.0, 5000.0),
        ];
        if let Some((name, v, low, high)) = ranges.iter().find(|(_, v, low, high)| !(*low..=*high).contains(v)) {
            return Err(Fault::input(format!("motion.{name} is {v}, allowed {low}..={high}"))
                .cause("a slip, or another unit than the key names")
                .next("correct station.toml"));
        }
        for (name, space) in
            [("workspace", &self.workspace)].into_iter().chain(self.keep_out.iter().map(|k| ("keep_out", k)))
        {
            let wrong = (0..3).find(|&k| {
                !(space.from_mm[k] < space.to_mm[k] && space.from_mm[k].abs().max(space.to_mm[k].abs()) < 1e5)
            });
            if let Some(k) = wrong {
                return Err(Fault::input(format!(
                    "motion.{name} runs from {} to {} along {}, from < to is needed",
                    space.from_mm[k],
                    space.to_mm[k],
                    ["x", "y", "z"][k]
                ))
                .cause("corners were exchanged, or a number is missing")
                .next("give from_mm the lowest corner, to_mm the highest, in millimetres of the robot's base"));
            }
        }
        Ok(())
    }
}
