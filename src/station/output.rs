//! In: an arm that was taken, one of its outputs. Out: that output tried: lasers are on for a moment, the lamp
//! changes for a moment, the gripper opens or closes as requested. Nothing moves.
//! Frame and unit: numbers of the controller's outputs; s.

use crate::arm::{Arm, Outputs, Switchboard};
use crate::fault::Result;
use crate::recording::Beam;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long a lamp or laser that is tried stays on: long enough to see it, short enough to look away.
pub const LIT: Duration = Duration::from_millis(1500);
/// How often the stop flag is checked meanwhile.
const GLANCE: Duration = Duration::from_millis(20);

/// An action on an output that can be tried.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Output {
    /// The line laser.
    Line,
    /// The laser pointer.
    Pointer,
    /// The room's lamp.
    Room,
    /// The gripper opens and drops its component.
    Open,
    /// The gripper closes.
    Close,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Output>("output", word)
}

/// Tries an output; returns the number of the output that was switched. `stop` ends the wait while a light is on.
///
/// # Errors
/// The controller refuses or does not answer. Lasers are switched off in any case.
pub fn try_output(arm: &mut dyn Arm, outputs: &Outputs, what: Output, stop: &AtomicBool) -> Result<u16> {
    let mut all = Switchboard::of(arm, *outputs)?;
    match what {
        Output::Line => all.lit(Beam::Line, || look(stop)).map(|()| outputs.line),
        Output::Pointer => all.lit(Beam::Pointer, || look(stop)).map(|()| outputs.pointer),
        Output::Room => {
            let before = arm.signal(outputs.room)?;
            let lit = all.lamp(!before).and_then(|()| look(stop));
            all.lamp(before).and(lit).map(|()| outputs.room)
        }
        Output::Open => all.grip(false).map(|()| outputs.gripper),
        Output::Close => all.grip(true).map(|()| outputs.gripper),
    }
}

/// Waits while the operator looks at the light.
fn look(stop: &AtomicBool) -> Result<()> {
    let begun = Instant::now();
    while begun.elapsed() < LIT && !stop.load(Ordering::Relaxed) {
        std::thread::sleep(GLANCE);
    }
    Ok(())
}
