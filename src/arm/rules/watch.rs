//! In: a motion under way, poses over a separate connection, the stop button. Out: a Halt over a further connection
//! as soon as poses or button require it, and the reason.
//! Frame and unit: base frame; mm, mm/s; ms.

use super::super::{Halt, PoseSource, TimedPose};
use super::carried::Carried;
use super::clocks::Clocks;
use super::limits::Limits;
use super::standing::{Leg, Standing};
use super::stop::StopButton;
use crate::geometry::{Base, Flange, Rigid};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often stop button and silence are checked.
pub const LOOK: Duration = Duration::from_millis(2);
/// Pause between two readings of the pose.
const READ: Duration = Duration::from_millis(4);
/// Speeds are averaged over at least this time, s: controllers report their time in whole milliseconds.
pub const SPAN_S: f64 = 0.04;
/// Measured speeds may exceed the confirmed one by this factor and this amount, mm/s. The reasons are noise of
/// readings (0.01 mm in [`SPAN_S`] is 0.25 mm/s), ramps, and stamps that are late by a cycle of 8 ms.
pub const SPEED_SLACK: (f64, f64) = (1.25, 10.0);
/// The same for turning rates, degrees/s.
pub const TURN_SLACK: (f64, f64) = (1.25, 2.0);
/// A flange this far outside the workspace has left it, mm: a controller that keeps a straight path deviates by
/// less.
pub const OUTSIDE_MM: f64 = 1.0;

/// What was confirmed and has to hold during the motion.
#[derive(Clone, Copy, Debug)]
pub struct Confirmed {
    /// Greatest speed of any carried point, mm/s.
    pub speed_mm_s: f64,
    /// Greatest turning rate, degrees/s.
    pub turn_deg_s: f64,
    /// The figure that has to remain, if the controller reports it and the path is straight.
    pub figure: Option<i32>,
    /// The controller is simulated: its clock may run faster or slower than this machine's.
    pub simulated: bool,
}

/// The state that a watch shares with its motion.
pub struct Watch<'a> {
    pub limits: &'a Limits,
    pub carried: &'a Carried,
    pub stop: &'a StopButton,
    halt: &'a dyn Halt,
    confirmed: Confirmed,
    over: AtomicBool,
    /// The leg that is being executed.
    leg: Mutex<Option<Leg>>,
    /// Time of the last pose that was read.
    heard: Mutex<Instant>,
    why: Mutex<Option<String>>,
}

/// State carried from earlier poses.
#[derive(Default)]
struct Seen {
    before: Option<(f64, Rigid<Base, Flange>)>,
    clocks: Clocks,
    standing: Standing,
}

impl<'a> Watch<'a> {
    pub fn new(
        limits: &'a Limits,
        carried: &'a Carried,
        stop: &'a StopButton,
        halt: &'a dyn Halt,
        confirmed: Confirmed,
    ) -> Watch<'a> {
        let (over, leg) = (AtomicBool::new(false), Mutex::new(None));
        let (heard, why) = (Mutex::new(Instant::now()), Mutex::new(None));
        Watch { limits, carried, stop, halt, confirmed, over, leg, heard, why }
    }

    /// A leg is ordered now.
    pub fn begin(&self, to: Rigid<Base, Flange>) {
        *self.leg.lock().unwrap_or_else(PoisonError::into_inner) = Some(Leg { to, ordered: Instant::now() });
    }

    /// The leg has ended: the arm may stand until the next one.
    pub fn arrived(&self) {
        *self.leg.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// The motion has ended.
    pub fn end(&self) {
        self.over.store(true, Ordering::SeqCst);
    }

    /// The reason of the halt; `None` if there was none.
    pub fn halted(&self) -> Option<String> {
        self.why.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Halts, once, and stores the reason; an error of the Halt itself is added to it.
    pub fn halt(&self, why: String) {
        let mut held = self.why.lock().unwrap_or_else(PoisonError::into_inner);
        if held.is_none() {
            let told = self.halt.halt();
            *held = Some(match told {
                Ok(()) => why,
                Err(e) => format!("{why}; and the robot could not be told to stop: {}", e.what),
            });
        }
    }

    /// Checks the stop button and the silence of the link until the motion ends.
    pub fn guard(&self) {
        let silence = Duration::from_secs_f64(self.limits.max_silence_ms * 1e-3);
        while !self.over.load(Ordering::SeqCst) && self.halted().is_none() {
            let quiet = self.heard.lock().unwrap_or_else(PoisonError::into_inner).elapsed();
            if let Some(why) = self.stop.why() {
                self.halt(why);
            } else if quiet > silence {
                self.halt(format!(
                    "no pose for {} ms, limit {}: the link is lost",
                    quiet.as_millis(),
                    silence.as_millis()
                ));
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Reads poses until the motion ends; a pose that breaks a rule halts it.
    pub fn follow(&self, poses: &mut dyn PoseSource) {
        let (mut seen, begun) = (Seen::default(), Instant::now());
        while !self.over.load(Ordering::SeqCst) && self.halted().is_none() {
            match poses.pose() {
                Ok(pose) => {
                    *self.heard.lock().unwrap_or_else(PoisonError::into_inner) = pose.here;
                    if let Some(why) = self.judge(&pose, &mut seen, begun) {
                        self.halt(why);
                    }
                }
                Err(e) => self.halt(format!("the link was lost: {}", e.what)),
            }
            std::thread::sleep(READ);
        }
    }

    fn judge(&self, pose: &TimedPose, seen: &mut Seen, begun: Instant) -> Option<String> {
        let outside = self.limits.workspace.outside(&pose.base_from_flange.translation);
        if !(outside <= OUTSIDE_MM) {
            return Some(format!("the flange is {outside:.1} mm outside the workspace, limit {OUTSIDE_MM}"));
        }
        if let (Some(stays), Some(figure)) = (self.confirmed.figure, pose.figure)
            && stays != figure
        {
            return Some(format!("the arm configuration changed during the motion, from {stays} to {figure}"));
        }
        let leg = *self.leg.lock().unwrap_or_else(PoisonError::into_inner);
        let still = Duration::from_secs_f64(self.limits.max_still_ms * 1e-3);
        let standing = seen.standing.judge(pose, leg.as_ref(), self.carried, still);
        let clocks = (!self.confirmed.simulated).then(|| seen.clocks.judge(pose)).flatten();
        clocks.or(standing).or_else(|| self.too_fast(pose, &mut seen.before, begun))
    }

    /// Checks speeds by the controller's clock if it reports one, else by [`TimedPose::moment`].
    fn too_fast(
        &self,
        pose: &TimedPose,
        before: &mut Option<(f64, Rigid<Base, Flange>)>,
        begun: Instant,
    ) -> Option<String> {
        let at = pose.base_from_flange;
        let moment = || pose.moment().saturating_duration_since(begun);
        let t = pose.device.unwrap_or_else(moment).as_secs_f64();
        let Some((since, from)) = *before else {
            *before = Some((t, at));
            return None;
        };
        let passed = t - since;
        if passed < SPAN_S {
            return None;
        }
        *before = Some((t, at));
        let (name, mm) = self.carried.moved(&from, &at);
        let (speed, most) = (mm / passed, self.confirmed.speed_mm_s * SPEED_SLACK.0 + SPEED_SLACK.1);
        if !(speed <= most) {
            return Some(format!(
                "{name} moves at {speed:.0} mm/s, limit {most:.0}: the controller's full speed differs from the one \
                 stated for the link (?full=, ?turn=)"
            ));
        }
        let turning = from.difference(&at).0.to_degrees() / passed;
        let most = self.confirmed.turn_deg_s * TURN_SLACK.0 + TURN_SLACK.1;
        (!(turning <= most)).then(|| {
            format!(
                "the flange turns at {turning:.1} degrees/s, limit {most:.1}: the controller's full turning rate \
                 differs from the one stated for the link (?turn=)"
            )
        })
    }
}
