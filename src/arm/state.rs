//! In: what a controller says of itself. Out: the same in one form for all makes.
//! Frame and unit: poses base_from_flange, mm; times of this machine's monotonic clock.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use std::time::{Duration, Instant};

/// A pose and when it was true.
#[derive(Clone, Copy, Debug)]
pub struct TimedPose {
    /// Where the flange stood, mm.
    pub base_from_flange: Rigid<Base, Flange>,
    /// Configuration of arm, elbow and wrist as the controller numbers it, where it does.
    pub figure: Option<i32>,
    /// When the pose was asked for: it is not older than that.
    pub asked: Instant,
    /// When it was here: it is not younger than that.
    pub here: Instant,
    /// The controller's own clock when it read its joints, where it says so; counts from an unknown start.
    pub device: Option<Duration>,
}

impl TimedPose {
    /// The best guess of the moment on this machine's clock, good to half of the round trip on either side.
    pub fn moment(&self) -> Instant {
        self.asked + self.round_trip() / 2
    }
    /// From the question to the answer.
    pub fn round_trip(&self) -> Duration {
        self.here.saturating_duration_since(self.asked)
    }
}

/// Longest time that a controller's clock is believed to have counted, s: thirty thousand years.
const LONGEST_S: f64 = 1e12;

/// The controller's stamp of a pose. Errors: no number, or one that no clock shows: the link is lost.
pub(super) fn stamp(seconds: f64) -> Result<Duration> {
    let believed = Duration::try_from_secs_f64(seconds).ok().filter(|_| seconds <= LONGEST_S);
    believed.ok_or_else(|| {
        Fault::device(format!("a pose of the time {seconds:e} s, 0 to {LONGEST_S:e} are accepted"))
            .cause("the stream of poses is damaged, or the controller's answer means something else")
            .next("look at the robot, then connect again")
    })
}

/// Who may move the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// A person with the pendant.
    Manual,
    /// A person checks a program at reduced speed.
    Teach,
    /// Programs.
    Automatic,
    /// The link does not say.
    Unknown,
}

/// An error that stands on the controller.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ControllerError {
    /// Its number.
    pub code: u32,
    /// The controller's own words, in its language; control characters taken out.
    pub text: String,
}

/// What decides whether the arm may be moved.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct State {
    /// The arm's type as the controller names it.
    pub model: String,
    /// Who may move it.
    pub mode: Mode,
    /// The motors have power; `None`: not said.
    pub motor: Option<bool>,
    /// It moves now, or a program runs; `None`: not said.
    pub busy: Option<bool>,
    /// The emergency stop is pressed; `None`: not said.
    pub emergency_stop: Option<bool>,
    /// Errors that stand.
    pub errors: Vec<ControllerError>,
    /// Number of the tool whose pose is reported; 0 is the flange; `None`: not said.
    pub tool: Option<i32>,
    /// Number of the work frame in which it is reported; 0 is the base; `None`: not said.
    pub work: Option<i32>,
}

/// Whether a pose can be reached, as the controller sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reach {
    /// It can.
    Free,
    /// It cannot; in words.
    Refused(String),
    /// The link cannot ask.
    Unasked,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_that_no_clock_shows_is_refused() {
        assert_eq!(stamp(12.5).unwrap(), Duration::from_millis(12_500));
        for wrong in [f64::INFINITY, f64::NAN, -1.0, 1e17, 1e30] {
            assert!(stamp(wrong).unwrap_err().what.contains("are accepted"), "{wrong}");
        }
    }
}
