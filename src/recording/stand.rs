//! In: nothing. Out: a position of what moves: a robot's flange or an axis.
//! Frame and unit: base_from_flange, mm; counts in the unit of the recording's motion, from its zero.

use crate::geometry::{Base, Flange, Rigid};

/// Position of what moves, at a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stand {
    /// Pose of the robot's flange.
    Robot(Rigid<Base, Flange>),
    /// Count of an axis, from the motion's zero.
    Count(f64),
}
