//! In: a motion that someone asks for. Out: the same with the right to be made once.
//! Frame and unit: base_from_flange, mm; speeds mm/s and degrees/s.

use crate::geometry::{Base, Flange, Rigid};

/// Which way the flange takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// A straight line of the flange's origin, turning evenly.
    Straight,
    /// All joints arrive at the same time; the flange's way between is the arm's own.
    Joint,
}

/// A motion from where the arm stands.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Motion {
    /// Where to, mm.
    pub to: Rigid<Base, Flange>,
    /// On which way.
    pub way: Way,
    /// Greatest speed of any point that the flange carries, mm/s.
    pub speed_mm_s: f64,
}

/// How fast a motion is made, so that no point that the flange carries is too fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Greatest speed of the flange's origin on a straight way, of any carried point where the arm chooses the way;
    /// mm/s.
    pub flange_mm_s: f64,
    /// Greatest turning rate, degrees/s.
    pub turn_deg_s: f64,
    /// How far the farthest carried point lies from the flange's origin, mm.
    pub lever_mm: f64,
}

/// A motion that met every rule and was confirmed. Only the rules make one, and making the motion uses it up.
#[derive(Debug)]
pub struct Allowed {
    motion: Motion,
    pace: Pace,
}

impl Allowed {
    pub(in crate::arm) fn new(motion: Motion, pace: Pace) -> Allowed {
        Allowed { motion, pace }
    }
    /// What may be done.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }
    /// How fast.
    pub fn pace(&self) -> &Pace {
        &self.pace
    }
}
