//! In: an arm that has stopped, a camera, a beam. Out: a picture of the beam in a recording, with its pose.
//! Frame and unit: base_from_flange, mm; ms.

use super::eye::Eye;
use super::record::Record;
use crate::arm::Arm;
use crate::fault::{Fault, Result};
use crate::recording::Beam;
use std::time::Duration;

/// Waiting time of the standing arm before a picture is taken.
const SETTLE: Duration = Duration::from_millis(5);
/// Waits until an arm that has arrived has come to rest.
pub fn settle() {
    std::thread::sleep(SETTLE);
}

/// Takes a picture of a beam and records it with its pose; refuses if the arm moved between a reading before and
/// one after.
pub fn shoot(eye: &mut Eye, arm: &mut dyn Arm, record: &mut Record, beam: Option<Beam>) -> Result<()> {
    /// Largest difference of two readings of an arm at rest, mm and rad.
    const STILL: [f64; 2] = [0.01, 1e-4];
    settle();
    let before = arm.pose()?;
    let picture = eye.picture(beam)?;
    let after = arm.pose()?;
    let (angle, mm) = before.base_from_flange.difference(&after.base_from_flange);
    if mm > STILL[0] || angle > STILL[1] {
        return Err(Fault::refused(format!(
            "the arm moved by {mm:.3} mm while the picture was taken, limit {}",
            STILL[0]
        ))
        .cause("the arm still swings, or somebody jogs it")
        .next("begin again"));
    }
    record.shot(&picture, &after)
}
