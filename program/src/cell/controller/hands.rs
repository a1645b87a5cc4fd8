//! In: what a person does at the controller, or a test in a person's stead. Out: the state of the panel.
//! Frame and unit: mm.

use super::panel::text;
use super::{Controller, EMERGENCY};
use sheetlight::bcap::Outcome;
use sheetlight::geometry::Vec3;

/// Number of a client outside this program.
const ANOTHER: u64 = u64::MAX;

/// What a person does at the controller, or a test in a person's stead.
impl Controller {
    /// Presses the emergency stop: the arm brakes, the motor loses power, the error is pending.
    pub fn emergency_stop(&self) {
        self.halt(None, EMERGENCY);
        let mut panel = self.panel();
        panel.emergency = true;
        panel.motor = false;
        let text = text(EMERGENCY.0, panel.japanese);
        panel.errors.insert(0, (EMERGENCY.0, text));
    }
    /// Releases the emergency stop; the error stays until it is cleared.
    pub fn release_emergency_stop(&self) {
        self.panel().emergency = false;
    }
    /// Raises an error.
    pub fn fail(&self, code: u32) {
        self.halt(None, Outcome(code));
        let mut panel = self.panel();
        let text = text(code, panel.japanese);
        panel.errors.insert(0, (code, text));
    }
    /// Clears the errors at the pendant.
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
    /// Selects Japanese error texts.
    pub fn set_japanese(&self, on: bool) {
        self.panel().japanese = on;
    }
    /// Stops reporting that this is a simulated controller, like a real controller behind a tunnel.
    pub fn as_real(&self) {
        self.panel().as_real = true;
    }
    /// Sets the function that makes time stamps of poses; by default the cell's time in ms.
    pub fn stamp_with(&self, stamp: fn(f64) -> f64) {
        self.panel().stamp = stamp;
    }
    /// From now on reports the pose of this moment, whatever the arm does.
    pub fn freeze(&self) {
        let now = self.cell.clock().now();
        self.panel().frozen = Some(now);
    }
    /// Sets tool and work frame, as a program on the pendant does.
    pub fn set_frames(&self, tool: i32, work: i32) {
        let mut panel = self.panel();
        (panel.tool, panel.work) = (tool, work);
    }
    /// Sets a box that the flange may not enter, mm.
    pub fn set_fence(&self, fence: Option<[Vec3; 2]>) {
        self.panel().fence = fence;
    }
    /// The next motion reaches its goal with another figure, as with a controller that chooses the figure itself.
    pub fn turn_figure(&self, to: i32) {
        self.panel().next_figure = Some(to);
    }
    /// Changes the figure now, as after a person moved the arm away and back.
    pub fn turned_figure(&self) {
        let mut panel = self.panel();
        panel.figure = panel.next_figure.take().or(panel.figure);
    }
    /// Another client takes the arm.
    pub fn take_by_another(&self) {
        self.panel().taken = Some(ANOTHER);
    }
    /// That client releases the arm.
    pub fn given_by_another(&self) {
        let mut panel = self.panel();
        panel.taken = panel.taken.filter(|by| *by != ANOTHER);
    }

    /// A client disconnected: its handles and the arm are released.
    pub(super) fn leave(&self, connection: u64) {
        let mut panel = self.panel();
        panel.objects.retain(|_, (owner, _)| *owner != connection);
        if panel.taken == Some(connection) {
            panel.taken = None;
        }
    }
}
