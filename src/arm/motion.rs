//! In: a requested motion. Out: the same motion with permission to execute it once.
//! Frame and unit: base_from_flange, mm; speeds mm/s and degrees/s.

use crate::geometry::{Base, Flange, Rigid};

/// The path of the flange.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// The flange's origin follows a straight line while the flange turns at a constant rate.
    Straight,
    /// All joints arrive at the same time; the arm itself determines the path of the flange between.
    Joint,
}

/// A motion from the arm's current pose.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Motion {
    /// Target pose, mm.
    pub to: Rigid<Base, Flange>,
    /// The path to it.
    pub way: Way,
    /// Greatest speed of any point that the flange carries, mm/s.
    pub speed_mm_s: f64,
}

/// How fast a motion is executed, so that no point that the flange carries is too fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Greatest speed, mm/s: of the flange's origin on a straight path, of any carried point where the arm chooses
    /// the path.
    pub flange_mm_s: f64,
    /// Greatest turning rate, degrees/s.
    pub turn_deg_s: f64,
    /// Distance of the farthest carried point from the flange's origin, mm.
    pub lever_mm: f64,
}

/// A motion that met every rule and was confirmed. Only the rules create one, and executing the motion consumes it.
#[derive(Debug)]
pub struct Allowed {
    motion: Motion,
    pace: Pace,
}

impl Allowed {
    pub(in crate::arm) fn new(motion: Motion, pace: Pace) -> Allowed {
        Allowed { motion, pace }
    }
    /// The allowed motion.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }
    /// Its pace.
    pub fn pace(&self) -> &Pace {
        &self.pace
    }
}
