//! In: what a controller reports about itself. Out: the same in one form for all makes.
//! Frame and unit: poses base_from_flange, mm; times of this machine's monotonic clock.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use std::time::{Duration, Instant};

/// A pose and the time at which it was true.
#[derive(Clone, Copy, Debug)]
pub struct TimedPose {
    /// Pose of the flange, mm.
    pub base_from_flange: Rigid<Base, Flange>,
    /// Configuration of arm, elbow and wrist in the controller's own numbering; `None` if the controller reports
    /// none.
    pub figure: Option<i32>,
    /// When the pose was requested: it is not older than that.
    pub asked: Instant,
    /// When the answer arrived: the pose is not younger than that.
    pub here: Instant,
    /// The controller's own clock when it read its joints, if it reports it; counts from an unknown start.
    pub device: Option<Duration>,
}

impl TimedPose {
    /// The best estimate of the pose's time on this machine's clock, good to half of the round trip on either side.
    pub fn moment(&self) -> Instant {
        self.asked + self.round_trip() / 2
    }
    /// The time from the request to the answer.
    pub fn round_trip(&self) -> Duration {
        self.here.saturating_duration_since(self.asked)
    }
}

/// The largest time stamp of a controller that is accepted, s: thirty thousand years.
const LONGEST_S: f64 = 1e12;

/// The controller's time stamp of a pose. Errors: the stamp is not a number, or it is outside 0 to [`LONGEST_S`];
/// the fault counts as a lost link.
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
    /// The link does not report it.
    Unknown,
}

/// An error that is active on the controller.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ControllerError {
    /// Its number.
    pub code: u32,
    /// The controller's own words, in its language, without control characters.
    pub text: String,
}

/// The state that decides whether the arm may be moved.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct State {
    /// The arm's type as the controller names it.
    pub model: String,
    /// Who may move it.
    pub mode: Mode,
    /// The motors have power; `None`: not reported.
    pub motor: Option<bool>,
    /// It moves now, or a program runs; `None`: not reported.
    pub busy: Option<bool>,
    /// The emergency stop is pressed; `None`: not reported.
    pub emergency_stop: Option<bool>,
    /// Active errors.
    pub errors: Vec<ControllerError>,
    /// Number of the tool whose pose is reported; 0 is the flange; `None`: not reported.
    pub tool: Option<i32>,
    /// Number of the work frame in which the pose is reported; 0 is the base; `None`: not reported.
    pub work: Option<i32>,
}

/// Whether the controller can reach a pose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reach {
    /// The controller can reach it.
    Free,
    /// The controller cannot reach it; the reason in words.
    Refused(String),
    /// The link cannot ask the controller.
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
