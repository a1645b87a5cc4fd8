//! In: `motion` of meta.json, counts of frames or of a counts file. Out: what moved between the frames, and where it stood at
//! each of them; a frame whose count is not known stays without one.
//! Frame and unit: counts in the unit that `motion` states, from its zero; robot poses are base_from_flange, mm.

use super::{FrameRef, Recording};
use crate::fault::{Fault, Result};
use crate::geometry::{AxisKind, Base, CountUnit, Flange, Rigid};
use std::collections::BTreeSet;

/// What brings part and light past each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MotionKind {
    #[default]
    Robot,
    Linear,
    Turntable,
}

/// What is moved; the other one stands still.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Carries {
    #[default]
    Sensor,
    Part,
}

/// `motion` of a recording (docs/file-formats.md).
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    pub kind: MotionKind,
    pub carries: Carries,
    /// What a count is; of an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<CountUnit>,
    /// The count at which the axis frame stands; 0 unless stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero: Option<f64>,
    /// Counts from one trigger pulse to the next, where the axis triggers the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts_per_shot: Option<f64>,
    /// Name of a file of counts (CSV).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts_file: Option<String>,
}

/// Where what moves stood at a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stand {
    /// The robot's flange.
    Robot(Rigid<Base, Flange>),
    /// An axis, from the motion's zero.
    Count(f64),
}

/// For an axis whose counts nobody wrote down.
const WAYS: &str = "give every frame a \"count\", name a \"counts_file\", or state \"counts_per_shot\"";

impl Motion {
    /// The axis that moves; none where a robot does.
    pub fn axis(&self) -> Option<AxisKind> {
        match self.kind {
            MotionKind::Robot => None,
            MotionKind::Linear => Some(AxisKind::Linear),
            MotionKind::Turntable => Some(AxisKind::Turntable),
        }
    }

    /// Name of the frame that clouds of such recordings are in: docs/conventions.md.
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
            let what = format!("a count of {odd} {}, at most {MOST:.0} is believed", unit.name());
            return bad(what, "write counts as the encoder gives them, or set \"zero\" nearer");
        }
        match self.counts_per_shot {
            Some(step) if step == 0.0 => {
                bad("counts_per_shot is 0".into(), "state how far the axis goes from shot to shot")
            }
            _ => Ok(()),
        }
    }
}

/// 2^53: the integers that f64 holds.
const MOST: f64 = 9e15;

impl Recording {
    /// Where the axis stood at every frame, from the motion's zero; `None` where the count is not known: nothing is made up
    /// between two others. Refused: a robot's recording, a spoilt counts file.
    pub fn counts(&self) -> Result<Vec<Option<f64>>> {
        let motion = self.meta.motion();
        if motion.axis().is_none() {
            return Err(Fault::usage(format!("{}: was moved by a robot, it has no counts", self.folder.display()))
                .cause("meta.json states no 'motion', or a robot's")
                .next("state \"motion\" with its kind \"linear\" or \"turntable\" (docs/file-formats.md)"));
        }
        let frames = &self.meta.frames;
        let zero = motion.zero.unwrap_or(0.0);
        let counts: Vec<Option<f64>> = if let Some(name) = &motion.counts_file {
            let path = self.inside(name)?;
            let text = crate::files::read_text(&path)?;
            from_csv(&text, frames.len()).map_err(|e| e.at(path.display()))?
        } else if let Some(step) = motion.counts_per_shot {
            let number = |(i, f): (usize, &FrameRef)| f.trigger.unwrap_or(i as u64) as f64;
            frames.iter().enumerate().map(|f| Some(number(f) * step)).collect()
        } else {
            frames.iter().map(|f| f.count).collect()
        };
        Ok(counts.into_iter().map(|c| c.map(|c| c - zero)).collect())
    }
}

/// Rows `frame,count`; frames that are not named have no count.
fn from_csv(text: &str, frames: usize) -> Result<Vec<Option<f64>>> {
    let bad = |number: usize, what: String| {
        Err(Fault::input(format!("line {number}: {what}"))
            .cause("a truncated or edited file, or one of another recording")
            .next("write a header frame,count and a row for each frame of meta.json, counted from 0"))
    };
    let mut lines = (1..).zip(text.trim_start_matches('\u{feff}').lines()).filter(|(_, l)| {
        let l = l.trim();
        !l.is_empty() && !l.starts_with('#')
    });
    let header = lines.next().map(|(_, l)| l.replace(' ', "").to_lowercase()).unwrap_or_default();
    if header != "frame,count" {
        return bad(1, format!("the columns are '{header}', a counts file has 'frame,count'"));
    }
    let mut out = vec![None; frames];
    let mut seen = BTreeSet::new();
    for (number, line) in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let (Some(frame), Some(count), 2) = (
            cells.first().and_then(|c| c.parse::<usize>().ok()),
            cells.get(1).and_then(|c| c.parse::<f64>().ok()).filter(|c| c.abs() <= MOST),
            cells.len(),
        ) else {
            return bad(number, format!("'{line}' is not a frame's number and its count"));
        };
        if frame >= frames {
            return bad(number, format!("frame {frame}, meta.json has {frames}"));
        }
        if !seen.insert(frame) {
            return bad(number, format!("frame {frame} is there twice"));
        }
        out[frame] = Some(count);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::super::Meta;
    use super::*;

    const META: &str = r#"{"format":1,"set":"s","units":"mm","image":{"width":4,"height":4,"bits":8,"channels":1,
        "response":"linear","pixel_centre":"integer coordinates"},"motion":MOTION,"frames":[FRAMES]}"#;

    fn counts(motion: &str, frames: &str, file: &str) -> std::result::Result<Vec<Option<f64>>, String> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("meta.json"), META.replace("MOTION", motion).replace("FRAMES", frames)).unwrap();
        std::fs::write(dir.path().join("counts.csv"), file).unwrap();
        Recording::open(dir.path()).and_then(|r| r.counts()).map_err(|e| e.to_string())
    }

    #[test]
    fn counts_are_told_in_one_way_and_gaps_stay_gaps() {
        let linear = |more: &str| format!(r#"{{"kind":"linear","carries":"part","unit":"count"{more}}}"#);
        let plain = r#"{"laser":"a.png"},{"laser":"b.png"},{"laser":"c.png"}"#;
        let own = r#"{"laser":"a.png","count":5},{"laser":"b.png"},{"laser":"c.png","count":-7.5}"#;
        assert_eq!(counts(&linear(""), own, ""), Ok(vec![Some(5.0), None, Some(-7.5)]));
        assert_eq!(counts(&linear(r#","zero":5"#), own, ""), Ok(vec![Some(0.0), None, Some(-12.5)]));
        let step = linear(r#","counts_per_shot":20"#);
        assert_eq!(counts(&step, plain, ""), Ok(vec![Some(0.0), Some(20.0), Some(40.0)]));
        let triggers = r#"{"laser":"a.png","trigger":3},{"laser":"c.png","trigger":9}"#;
        assert_eq!(counts(&step, triggers, ""), Ok(vec![Some(60.0), Some(180.0)]));
        let file = linear(r#","counts_file":"counts.csv""#);
        assert_eq!(counts(&file, plain, "frame,count\n2,8\n0,1\n"), Ok(vec![Some(1.0), None, Some(8.0)]));
        for (motion, frames, csv, says) in [
            (linear(""), plain, "", "0 ways"),
            (step.clone(), own, "", "2 ways"),
            (step.clone(), r#"{"laser":"a.png","trigger":3},{"laser":"c.png"}"#, "", "some have none"),
            (linear(r#","counts_per_shot":0"#), plain, "", "counts_per_shot is 0"),
            (linear("").replace("\"count\"", "\"deg\""), own, "", "counts is \"deg\""),
            (r#"{"kind":"linear","carries":"part"}"#.into(), own, "", "not stated"),
            (r#"{"kind":"robot","carries":"part"}"#.into(), own, "", "a robot's"),
            (r#"{"kind":"robot","carries":"part"}"#.into(), plain, "", "was moved by a robot"),
            (file.clone(), plain, "count\n1\n", "a counts file has"),
            (file.clone(), plain, "frame,count\n3,1\n", "meta.json has 3"),
            (file.clone(), plain, "frame,count\n1,1\n1,2\n", "twice"),
            (file.clone(), plain, "frame,count\n1,nan\n", "is not a frame's number"),
            (linear(""), r#"{"laser":"a.png","count":1e300}"#, "", "at most"),
        ] {
            let said = counts(&motion, frames, csv).unwrap_err();
            assert!(said.contains(says), "{says}: {said}");
        }
    }

    #[test]
    fn counts_without_a_motion_are_refused() {
        let said =
            Meta::parse(&META.replace(r#""motion":MOTION,"#, "").replace("FRAMES", r#"{"laser":"a.png","count":5}"#));
        assert!(said.unwrap_err().what.contains("does not say of what"));
    }
}
