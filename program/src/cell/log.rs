//! In: what happens in the simulated cell. Out: a list of events in order, for tests and people.
//! Frame and unit: s of the cell; base_from_flange as 16 numbers, mm.

use sheetlight::geometry::{Base, Flange, Rigid};

/// An event.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "what")]
pub enum Event {
    /// A motion was begun.
    Move {
        /// The connection that requested it.
        connection: u64,
        /// The goal.
        to: Rigid<Base, Flange>,
        /// True: along a straight line; false: by joints.
        straight: bool,
        /// Duration, s.
        lasts_s: f64,
    },
    /// The motion that was under way has ended.
    Arrived,
    /// A person moved the arm with the pendant.
    Jogged {
        /// The new pose.
        to: Rigid<Base, Flange>,
    },
    /// A client or an emergency stop halted the arm.
    Halt {
        /// Number of the connection; null if the cell did it.
        connection: Option<u64>,
        /// Whether a motion was under way.
        moving: bool,
    },
    /// A motion was refused.
    Refused {
        /// Its error code.
        code: u32,
    },
    /// An output was switched.
    Output {
        /// Its number.
        number: u16,
        /// The new state.
        on: bool,
    },
    /// The gripper released its component.
    Released(Insertion),
    /// Component or gripper collided with something.
    Collision {
        /// Position in the base frame, mm.
        at: [f64; 3],
        /// Depth, mm.
        depth_mm: f64,
        /// True: a pin beside its hole; false: component or gripper.
        pin: bool,
    },
}

/// Error of a released component against the ground truth.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Insertion {
    /// Distance between the component's seat and the socket's, in the socket's plane, mm.
    pub lateral_mm: f64,
    /// Rotation about the socket's normal, degrees.
    pub turn_deg: f64,
    /// Angle between the component's underside and the socket's plane, degrees.
    pub tilt_deg: f64,
    /// Height of the underside above the socket's top, mm.
    pub height_mm: f64,
    /// Largest distance of a pin from its hole's axis, mm.
    pub worst_pin_mm: f64,
    /// All pins are in their holes and the component is down.
    pub inserted: bool,
}

/// An event and its time.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Entry {
    /// Time, s of the cell.
    pub t_s: f64,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}
