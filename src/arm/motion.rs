//! In: a motion that someone asks for. Out: the same with the right to be made once.
//! Frame and unit: base_from_flange, mm; speed of the flange, mm/s.

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
    /// Greatest speed of the flange's origin, mm/s.
    pub speed_mm_s: f64,
}

/// A motion that met every rule and was confirmed. Only the rules make one, and making the motion uses it up.
#[derive(Debug)]
pub struct Allowed {
    motion: Motion,
}

impl Allowed {
    pub(in crate::arm) fn new(motion: Motion) -> Allowed {
        Allowed { motion }
    }
    /// What may be done.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }
}
