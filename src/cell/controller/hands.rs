//! In: what a person does at the controller, and what tests do instead. Out: the panel as it stands then.
//! Frame and unit: mm.

use super::panel::text;
use super::{Controller, EMERGENCY};
use crate::bcap::Outcome;
use crate::geometry::Vec3;

/// A client that is none of ours.
const ANOTHER: u64 = u64::MAX;

/// What a person does at the controller, and what tests do instead.
impl Controller {
    /// Presses the emergency stop: the arm brakes, the motor loses its power, the error stands.
    pub fn emergency_stop(&self) {
        self.halt(None, EMERGENCY);
        let mut panel = self.panel();
        panel.emergency = true;
        panel.motor = false;
        let text = text(EMERGENCY.0, panel.japanese);
        panel.errors.insert(0, (EMERGENCY.0, text));
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
    /// Says no more that it is a simulated one, as a real controller at the end of a tunnel does not.
    pub fn as_real(&self) {
        self.panel().as_real = true;
    }
    /// Stamps poses with something else than its time in ms.
    pub fn stamp_with(&self, stamp: fn(f64) -> f64) {
        self.panel().stamp = stamp;
    }
    /// Tells the pose of now from now on, whatever the arm does.
    pub fn freeze(&self) {
        let now = self.cell.clock().now();
        self.panel().frozen = Some(now);
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
    /// The next motion takes the arm to its goal with another figure, as a controller does that chooses it by itself.
    pub fn turn_figure(&self, to: i32) {
        self.panel().next_figure = Some(to);
    }
    /// It has it already: somebody moved the arm there and back.
    pub fn turned_figure(&self) {
        let mut panel = self.panel();
        panel.figure = panel.next_figure.take().or(panel.figure);
    }
    /// Another client takes the arm.
    pub fn take_by_another(&self) {
        self.panel().taken = Some(ANOTHER);
    }
    /// That client gives it back.
    pub fn given_by_another(&self) {
        let mut panel = self.panel();
        panel.taken = panel.taken.filter(|by| *by != ANOTHER);
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
