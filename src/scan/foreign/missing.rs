//! Which numbers mean "not measured": those that the user states, those that the file states, and suspicious ones
//! that nobody stated.

use super::stated::Stated;
use crate::fault::{Fault, Result};
use crate::raster::{Kind, Says};
use crate::solve::repeated;

/// Displays a number as people write it: -99.9999, not the exact value of its 32-bit float.
struct Plain(f64);

impl std::fmt::Display for Plain {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let short = self.0 as f32;
        if f64::from(short) == self.0 { write!(f, "{short}") } else { write!(f, "{}", self.0) }
    }
}

/// The levels of a picture that mean "not measured".
pub(super) fn of_picture(
    stated: &Stated,
    says: &Says,
    kind: Kind,
    levels: &[f64],
    notes: &mut Vec<String>,
) -> Result<Vec<f64>> {
    let count = |level: f64| levels.iter().filter(|v| kind.same(**v, level)).count();
    let file = says.missing.map(|level| (level, count(level)));
    let missing = match (stated.missing, file) {
        (None, None) if kind.whole() && !levels.iter().any(|v| v.is_nan()) => {
            return Err(Fault::usage("it is not stated which level means that nothing was measured")
                .cause("whole numbers have no sign for it: often 0, of signed maps -32768")
                .next("give --missing LEVEL, or --missing none"));
        }
        (None, None) => vec![],
        (Some(None), None) => vec![],
        (Some(None), Some((level, n))) => {
            notes.push(format!(
                "the file names the level {} as missing (GDAL_NODATA), --missing none overrules it: {n} pixels with it \
                 are heights",
                Plain(level)
            ));
            vec![]
        }
        (Some(Some(level)), None) => vec![level],
        (None | Some(Some(_)), Some((level, n))) => {
            notes.push(format!(
                "{n} pixels with the level {}, which the file names as missing (GDAL_NODATA), count as not measured",
                Plain(level)
            ));
            stated.missing.flatten().into_iter().chain([level]).collect()
        }
    };
    if let Some(Some(level)) = stated.missing
        && count(level) == 0
    {
        notes.push(format!(
            "no pixel has the level {level:?} that --missing names: every other pixel counts as measured"
        ));
    }
    Ok(missing)
}

/// A test of whether a point of a cloud was measured: its coordinates are finite and its z is not the stated level.
pub(super) fn of_cloud<'a>(
    stated: &Stated,
    points: &'a [[f64; 3]],
    notes: &mut Vec<String>,
) -> impl Fn(&[f64; 3]) -> bool + use<'a> {
    let missing = stated.missing.flatten();
    let there = move |p: &[f64; 3]| {
        p.iter().all(|v| v.is_finite()) && !missing.is_some_and(|level| Kind::Text.same(p[2], level))
    };
    if let Some(level) = missing {
        let n = points.iter().filter(|p| Kind::Text.same(p[2], level)).count();
        notes.push(if n > 0 {
            format!("{n} points with z {} count as not measured (--missing)", Plain(level))
        } else {
            format!("no point has the z {} that --missing names", Plain(level))
        });
    }
    there
}

/// Notes numbers that look like a mark for "not measured" although nobody stated it.
pub(super) fn suspects(
    stated: &Stated,
    heights: impl Iterator<Item = f64> + Clone,
    what: &str,
    notes: &mut Vec<String>,
) {
    if stated.missing == Some(None) {
        return;
    }
    let all = heights.clone().count();
    for (height, n) in repeated(heights) {
        notes.push(format!(
            "{n} of {all} {what} have exactly the height {0}: if that means 'not measured', give --missing {0}; they \
             count as measured",
            Plain(height)
        ));
    }
}
