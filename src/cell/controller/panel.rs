//! In: nothing. Out: what stands on the controller's panel: mode, motor, errors, speeds, variables, who has the arm.
//! Frame and unit: speeds in per cent.

use super::{Controller, Object, Outcome};
use crate::bcap::Variant;
use crate::geometry::Vec3;
use std::collections::BTreeMap;

/// What @MODE says when programs may move the arm.
pub const AUTOMATIC: i32 = 3;

/// Everything on the panel.
pub struct Panel {
    pub mode: i32,
    pub motor: bool,
    pub emergency: bool,
    /// Code and text, the newest first.
    pub errors: Vec<(u32, String)>,
    /// The connection that has the arm.
    pub taken: Option<u64>,
    pub tool: i32,
    pub work: i32,
    /// External speed, acceleration, deceleration.
    pub external: [f64; 3],
    /// Internal speed.
    pub internal: f64,
    pub variables: BTreeMap<String, Variant>,
    /// Corners of a box that nothing may enter, mm.
    pub fence: Option<[Vec3; 2]>,
    /// The motion that is under way, and how it was stopped.
    pub motion: Option<(u64, Option<Outcome>)>,
    pub motions: u64,
    /// How motions ended, until they are asked for.
    pub ended: BTreeMap<u64, Outcome>,
    pub objects: BTreeMap<i32, (u64, Object)>,
    /// Error texts in Japanese.
    pub japanese: bool,
}

impl Default for Panel {
    fn default() -> Panel {
        Panel {
            mode: AUTOMATIC,
            motor: false,
            emergency: false,
            errors: Vec::new(),
            taken: None,
            tool: 0,
            work: 0,
            external: [100.0; 3],
            internal: 100.0,
            variables: BTreeMap::new(),
            fence: None,
            motion: None,
            motions: 0,
            ended: BTreeMap::new(),
            objects: BTreeMap::new(),
            japanese: false,
        }
    }
}

/// The controller's text for a code.
pub fn text(code: u32, japanese: bool) -> String {
    if japanese {
        return "未定義エラーです。".into();
    }
    match code {
        0x8007_0057 => "Invalid argument.".into(),
        0x8150_1003 => "Motor power is off.".into(),
        0x8150_1025 => "An error is pending.".into(),
        0x8320_F001 => "The arm is taken by another client.".into(),
        0x8320_F002 => "The arm is not taken.".into(),
        0x8320_F003 => "Out of motion space.".into(),
        0x8320_F005 => "Emergency stop.".into(),
        0x8320_F006 => "Not in automatic mode.".into(),
        0x8320_F007 => "Virtual fence.".into(),
        0x8320_4071..=0x8320_4078 => format!("J{} is out of its range.", code & 0xf),
        _ => "Undefined error.".into(),
    }
}

/// What a person does at the controller, and what tests do instead.
impl Controller {
    /// Presses the emergency stop: the arm brakes, the motor loses its power, the error stands.
    pub fn emergency_stop(&self) {
        self.halt(None, super::EMERGENCY);
        let mut panel = self.panel();
        panel.emergency = true;
        panel.motor = false;
        let text = text(super::EMERGENCY.0, panel.japanese);
        panel.errors.insert(0, (super::EMERGENCY.0, text));
    }
    /// Lets it go again; the error stands until it is cleared.
    pub fn release_emergency_stop(&self) {
        self.panel().emergency = false;
    }
    /// An error comes up.
    pub fn fail(&self, code: u32) {
        self.halt(None, Outcome(code));
        let mut panel = self.panel();
        let text = text(code, panel.japanese);
        panel.errors.insert(0, (code, text));
    }
    /// Clears the errors on the pendant.
    pub fn clear_errors(&self) {
        self.panel().errors.clear();
    }
    /// Turns the mode switch: 1 manual, 2 teach check, 3 automatic.
    pub fn set_mode(&self, mode: i32) {
        self.panel().mode = mode;
    }
    /// Switches the motor by hand.
    pub fn set_motor(&self, on: bool) {
        self.panel().motor = on;
    }
    /// Error texts in Japanese.
    pub fn set_japanese(&self, on: bool) {
        self.panel().japanese = on;
    }
    /// Sets tool and work frame as a program on the pendant does.
    pub fn set_frames(&self, tool: i32, work: i32) {
        let mut panel = self.panel();
        (panel.tool, panel.work) = (tool, work);
    }
    /// A box that the flange may not enter, mm.
    pub fn set_fence(&self, fence: Option<[Vec3; 2]>) {
        self.panel().fence = fence;
    }
    /// Another client takes the arm.
    pub fn take_by_another(&self) {
        self.panel().taken = Some(u64::MAX);
    }

    /// A client has gone: its handles and the arm are free.
    pub(super) fn leave(&self, connection: u64) {
        let mut panel = self.panel();
        panel.objects.retain(|_, (owner, _)| *owner != connection);
        if panel.taken == Some(connection) {
            panel.taken = None;
        }
    }
}
