//! In: a motion under way, poses over a connection of its own, the stop button. Out: a Halt over the second connection as soon
//! as one of them says so, and why.
//! Frame and unit: base frame; mm, mm/s; ms.

use super::super::{Halt, PoseSource, TimedPose};
use super::limits::Limits;
use super::stop::StopButton;
use crate::geometry::Vec3;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often is looked whether the arm has to stop.
const LOOK: Duration = Duration::from_millis(2);
/// How often a pose is read.
const READ: Duration = Duration::from_millis(4);
/// Speeds are taken over at least this time: controllers state theirs in whole milliseconds.
const SPAN_S: f64 = 0.04;
/// Measured speeds may be above the allowed one by this share and this much, mm/s: noise of readings, ramps.
const SPEED_SLACK: (f64, f64) = (1.25, 10.0);
/// A flange this far outside the workspace has left it, mm.
const OUTSIDE_MM: f64 = 1.0;

/// What a watch shares with the motion that it watches.
pub struct Watch<'a> {
    pub limits: &'a Limits,
    pub stop: &'a StopButton,
    pub halt: &'a dyn Halt,
    /// Greatest speed that was confirmed, mm/s.
    pub speed_mm_s: f64,
    /// The figure that has to stay, where the controller says it and the way is straight.
    pub figure: Option<i32>,
    over: AtomicBool,
    /// When a pose was read last.
    heard: Mutex<Instant>,
    why: Mutex<Option<String>>,
}

impl<'a> Watch<'a> {
    pub fn new(
        limits: &'a Limits,
        stop: &'a StopButton,
        halt: &'a dyn Halt,
        speed_mm_s: f64,
        figure: Option<i32>,
    ) -> Watch<'a> {
        let (over, heard, why) = (AtomicBool::new(false), Mutex::new(Instant::now()), Mutex::new(None));
        Watch { limits, stop, halt, speed_mm_s, figure, over, heard, why }
    }

    /// The motion has ended.
    pub fn end(&self) {
        self.over.store(true, Ordering::SeqCst);
    }

    /// Why it was halted.
    pub fn halted(&self) -> Option<String> {
        self.why.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Halts, once, and keeps the reason; what the Halt itself said is part of it.
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

    /// Looks at the stop button and at the silence of the link until the motion ends.
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

    /// Reads poses until the motion ends; leaving the workspace or going too fast halts it.
    pub fn follow(&self, poses: &mut dyn PoseSource) {
        let mut before = None::<(f64, Vec3)>;
        let begun = Instant::now();
        while !self.over.load(Ordering::SeqCst) && self.halted().is_none() {
            match poses.pose() {
                Ok(pose) => {
                    *self.heard.lock().unwrap_or_else(PoisonError::into_inner) = pose.here;
                    if let Some(why) = self.judge(&pose, &mut before, begun) {
                        self.halt(why);
                    }
                }
                Err(e) => self.halt(format!("the link was lost: {}", e.what)),
            }
            std::thread::sleep(READ);
        }
    }

    fn judge(&self, pose: &TimedPose, before: &mut Option<(f64, Vec3)>, begun: Instant) -> Option<String> {
        let at = pose.base_from_flange.translation;
        let outside = self.limits.workspace.outside(&at);
        if !(outside <= OUTSIDE_MM) {
            return Some(format!("the flange is {outside:.1} mm outside the workspace, limit {OUTSIDE_MM}"));
        }
        if let (Some(stays), Some(figure)) = (self.figure, pose.figure)
            && stays != figure
        {
            return Some(format!("the figure changed on the way, from {stays} to {figure}"));
        }
        let t = pose
            .device
            .map_or_else(|| pose.moment().saturating_duration_since(begun).as_secs_f64(), |d| d.as_secs_f64());
        let Some((since, from)) = *before else {
            *before = Some((t, at));
            return None;
        };
        if t - since < SPAN_S {
            return None;
        }
        *before = Some((t, at));
        let (speed, most) = ((at - from).norm() / (t - since), self.speed_mm_s * SPEED_SLACK.0 + SPEED_SLACK.1);
        (speed > most).then(|| format!("the flange moves at {speed:.0} mm/s, limit {most:.0}: the controller's full speed is another than the link was told (?full=)"))
    }
}
