//! In: nothing. Out: where something stood: a robot's flange, or an axis.
//! Frame and unit: base_from_flange, mm; counts in the unit of the recording's motion, from its zero.

use crate::geometry::{Base, Flange, Rigid};

/// Where what moves stood at a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stand {
    /// The robot's flange.
    Robot(Rigid<Base, Flange>),
    /// An axis, from the motion's zero.
    Count(f64),
}
