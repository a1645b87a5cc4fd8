//! In: `motion` of meta.json. Out: what moved between the frames, and what states its position, checked.
//! Frame and unit: counts in the unit that `motion` states, from its zero; robot poses are base_from_flange, mm.

use super::frame::FrameRef;
use crate::fault::{Fault, Result};
use crate::geometry::{AxisKind, CountUnit};

/// What moves part and light relative to each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MotionKind {
    /// The robot; poses state its position.
    #[default]
    Robot,
    /// A linear axis; counts state its position.
    Linear,
    /// A turntable; counts state its position.
    Turntable,
}

/// What is moved; the other one is fixed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Carries {
    /// Camera and laser; the part is fixed.
    #[default]
    Sensor,
    /// The part; camera and laser are fixed.
    Part,
}

/// `motion` of a recording (docs/file-formats.md).
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// What moves.
    pub kind: MotionKind,
    /// What it moves.
    pub carries: Carries,
    /// Unit of a count; for an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<CountUnit>,
    /// The count at which the axis frame is defined; 0 unless stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero: Option<f64>,
    /// Counts from one trigger pulse to the next, if the axis triggers the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts_per_shot: Option<f64>,
    /// Name of a file of counts (CSV).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts_file: Option<String>,
}

/// Advice for an axis whose counts were not recorded.
const WAYS: &str = "give every frame a \"count\", name a \"counts_file\", or state \"counts_per_shot\"";

impl Motion {
    /// The axis that moves; none if a robot moves.
    pub fn axis(&self) -> Option<AxisKind> {
        match self.kind {
            MotionKind::Robot => None,
            MotionKind::Linear => Some(AxisKind::Linear),
            MotionKind::Turntable => Some(AxisKind::Turntable),
        }
    }

    /// Name of the frame of clouds from such recordings: docs/conventions.md.
    pub fn frame(&self) -> &'static str {
        match (self.kind, self.carries) {
            (MotionKind::Robot, Carries::Sensor) => "base",
            (MotionKind::Robot, Carries::Part) => "flange",
            _ => "axis",
        }
    }

    pub(super) fn check(&self, frames: &[FrameRef]) -> Result<()> {
        let bad = |what: String, next: &str| {
            Err(Fault::input(what).cause("'motion' of meta.json says two things, or leaves one out").next(next))
        };
        let (counted, triggered) =
            (frames.iter().any(|f| f.count.is_some()), frames.iter().any(|f| f.trigger.is_some()));
        let ways = [counted, self.counts_file.is_some(), self.counts_per_shot.is_some()];
        let Some(axis) = self.axis() else {
            let of_axis = self.unit.is_some() || self.zero.is_some() || triggered || ways.contains(&true);
            return if of_axis {
                bad(
                    "motion is a robot's, and unit, zero or counts are stated".into(),
                    "leave them out, or name the axis",
                )
            } else {
                Ok(())
            };
        };
        let units = match axis {
            AxisKind::Linear => [CountUnit::Count, CountUnit::Mm],
            AxisKind::Turntable => [CountUnit::Count, CountUnit::Deg],
        };
        let Some(unit) = self.unit.filter(|u| units.contains(u)) else {
            let [a, b] = units.map(CountUnit::name);
            let is = self.unit.map_or("not stated".into(), |u| format!("\"{}\"", u.name()));
            return bad(
                format!("the unit of the {}'s counts is {is}", axis.words()),
                &format!("state \"unit\": \"{a}\" (an encoder's steps) or \"{b}\" (as the axis itself says)"),
            );
        };
        if ways.iter().filter(|w| **w).count() != 1 {
            let what = format!("{} ways to tell the counts are used, 1 is needed", ways.iter().filter(|w| **w).count());
            return bad(what, WAYS);
        }
        if triggered && self.counts_per_shot.is_none() {
            return bad("frames have a 'trigger', and counts_per_shot is not stated".into(), WAYS);
        }
        if triggered && frames.iter().any(|f| f.trigger.is_none() && f.laser.is_some()) {
            return bad("some frames have a 'trigger' and some have none".into(), "number all frames, or none");
        }
        let numbers = [self.zero, self.counts_per_shot].into_iter().chain(frames.iter().map(|f| f.count)).flatten();
        if let Some(odd) = numbers.into_iter().find(|c| !(c.abs() <= MOST)) {
            let what = format!("a count of {odd} {}, at most {MOST:.0} is accepted", unit.name());
            return bad(what, "write counts as the encoder gives them, or set \"zero\" nearer");
        }
        if self.counts_per_shot == Some(0.0) {
            return bad("counts_per_shot is 0".into(), "state how far the axis goes from shot to shot");
        }
        Ok(())
    }
}

/// 2^53: up to this f64 represents every integer.
pub(super) const MOST: f64 = 9e15;
