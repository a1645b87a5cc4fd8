//! In: a recording of an axis: counts of its frames, of a counts file, or of trigger pulses. Out: the axis' position
//! at each frame; a frame with an unknown count gets none.
//! Frame and unit: counts in the unit that `motion` states, from its zero.

use super::Recording;
use super::frame::FrameRef;
use super::motion::MOST;
use crate::fault::{Fault, Result};
use crate::files::{TableRow, table};
use std::collections::BTreeSet;
use std::path::Path;

impl Recording {
    /// The axis' position at every frame, from the motion's zero; `None` if the count is unknown: it is never
    /// interpolated. Refuses a robot's recording and a spoilt counts file.
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
            load_counts(&path, frames.len())?
        } else if let Some(step) = motion.counts_per_shot {
            let number = |(i, f): (usize, &FrameRef)| f.trigger.unwrap_or(i as u64) as f64;
            frames.iter().enumerate().map(|f| Some(number(f) * step)).collect()
        } else {
            frames.iter().map(|f| f.count).collect()
        };
        Ok(counts.into_iter().map(|c| c.map(|c| c - zero)).collect())
    }
}

/// The counts of a file with rows `frame,count`, one for each of `frames`; a frame without a row has none.
///
/// # Errors
/// Another file, a frame twice or beyond the last.
pub fn load_counts(path: &Path, frames: usize) -> Result<Vec<Option<f64>>> {
    from_csv(&crate::files::read_text(path)?, frames).map_err(|e| e.at(path.display()))
}

/// Reads rows `frame,count`; frames without a row have no count.
fn from_csv(text: &str, frames: usize) -> Result<Vec<Option<f64>>> {
    let bad = |number: u64, what: String| {
        Err(Fault::input(format!("line {number}: {what}"))
            .cause("a truncated or edited file, or one of another recording")
            .next("write a header frame,count and a row for each frame or profile, counted from 0"))
    };
    let mut rows = table(text, ',').into_iter();
    let header = rows.next().map(|r| r.cells.join(",").to_lowercase()).unwrap_or_default();
    if header != "frame,count" {
        return bad(1, format!("the columns are '{header}', a counts file has 'frame,count'"));
    }
    let mut out = vec![None; frames];
    let mut seen = BTreeSet::new();
    for TableRow { line: number, text: line, cells } in rows {
        let (Some(frame), Some(count), 2) = (
            cells.first().and_then(|c| c.parse::<usize>().ok()),
            cells.get(1).and_then(|c| c.parse::<f64>().ok()).filter(|c| c.abs() <= MOST),
            cells.len(),
        ) else {
            return bad(number, format!("'{line}' is not a frame's number and its count"));
        };
        if frame >= frames {
            return bad(number, format!("frame {frame}, the last one is {}", frames.saturating_sub(1)));
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
            (file.clone(), plain, "frame,count\n3,1\n", "the last one is 2"),
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
