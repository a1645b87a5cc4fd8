//! In: what happens to the simulated controller. Out: a list of it in order, which tests and people read.
//! Frame and unit: s of the cell; base_from_flange as 16 numbers, mm.

use crate::geometry::{Base, Flange, Rigid};

/// Something that happened.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "what")]
pub enum Event {
    /// A motion was begun.
    Move {
        /// Which connection asked for it.
        connection: u64,
        /// Where to.
        to: Rigid<Base, Flange>,
        /// Along a straight line, else by joints.
        straight: bool,
        /// How long it takes, s.
        lasts_s: f64,
    },
    /// The motion that was under way has ended.
    Arrived,
    /// A person moved the arm with the pendant.
    Jogged {
        /// Where to.
        to: Rigid<Base, Flange>,
    },
    /// Somebody halted it, or an emergency stop did.
    Halt {
        /// Which connection; none where the cell did it.
        connection: Option<u64>,
        /// A motion was under way.
        moving: bool,
    },
    /// A motion was refused.
    Refused {
        /// With which code.
        code: u32,
    },
    /// An output was switched.
    Output {
        /// Its number.
        number: u16,
        /// To what.
        on: bool,
    },
    /// The gripper let its component go.
    Released(Insertion),
    /// Component or gripper went into something.
    Collision {
        /// Where in the base frame, mm.
        at: [f64; 3],
        /// How deep, mm.
        depth_mm: f64,
        /// A pin beside its hole, else component or gripper.
        pin: bool,
    },
}

/// How a component was let go, against the truth.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Insertion {
    /// Between the component's seat and the socket's, in the socket's plane, mm.
    pub lateral_mm: f64,
    /// About the socket's normal, degrees.
    pub turn_deg: f64,
    /// Between the component's underside and the socket's, degrees.
    pub tilt_deg: f64,
    /// Of the underside above the socket's top, mm.
    pub height_mm: f64,
    /// Largest distance of a pin from its hole's axis, mm.
    pub worst_pin_mm: f64,
    /// All pins are in their holes and the component is down.
    pub inserted: bool,
}

/// An event and when it was.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Entry {
    /// s of the cell.
    pub t_s: f64,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}
