//! In: an arm that was taken, one of its outputs. Out: that output tried: lasers light for a moment, the lamp changes for a moment, the
//! gripper goes where it is told. Nothing moves.
//! Frame and unit: numbers of the controller's outputs; s.

use crate::arm::{Arm, Outputs};
use crate::fault::Result;
use std::time::Duration;

/// A lamp or laser that is tried is lit so long: long enough to look, short enough to look away.
const LIT: Duration = Duration::from_millis(1500);

/// What hangs on an output.
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
    /// The gripper opens: what it holds falls.
    Open,
    /// The gripper closes.
    Close,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Output>("output", word)
}

/// Tries it; the number of the output that was switched.
///
/// # Errors
/// The controller refuses or does not answer. Lasers are told to go off in any case.
pub fn try_output(arm: &mut dyn Arm, outputs: &Outputs, what: Output) -> Result<u16> {
    let flash = |arm: &mut dyn Arm, number: u16, on: bool| {
        let lit = arm.put_output(number, on);
        std::thread::sleep(LIT);
        arm.put_output(number, !on).and(lit).map(|()| number)
    };
    match what {
        Output::Line => flash(arm, outputs.line, true),
        Output::Pointer => flash(arm, outputs.pointer, true),
        Output::Room => {
            let before = arm.signal(outputs.room)?;
            flash(arm, outputs.room, !before)
        }
        Output::Open => arm.put_output(outputs.gripper, false).map(|()| outputs.gripper),
        Output::Close => arm.put_output(outputs.gripper, true).map(|()| outputs.gripper),
    }
}
