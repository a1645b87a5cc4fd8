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
    let mut named = vec![];
    for (height, n) in repeated(heights.clone()) {
        named.push(height);
        notes.push(format!(
            "{n} of {all} {what} have exactly the height {0}: if that means 'not measured', give --missing {0}; they \
             count as measured",
            Plain(height)
        ));
    }
    if let Some((height, n, [low, high])) = lone(heights).filter(|l| !named.contains(&l.0)) {
        notes.push(format!(
            "{n} of {all} {what} have the height {0}, far from all others ({1} to {2}): if that means 'not measured', \
             give --missing {0}; they count as measured",
            Plain(height),
            Plain(low),
            Plain(high)
        ));
    }
}

/// How many times as far away as the others reach a height must lie to be suspect: a single one, several equal ones.
const APART: [f64; 2] = [3.0, 0.5];
/// From this number of equal heights on they are taken for a surface, not for a value that marks missing pixels.
const SURFACE: usize = 8;

/// The lowest or the highest height, if it is far from all others: its number, and the range of the others.
fn lone(heights: impl Iterator<Item = f64> + Clone) -> Option<(f64, usize, [f64; 2])> {
    let range = |skip: [f64; 2]| {
        let rest = heights.clone().filter(|v| v.is_finite() && !skip.contains(v));
        rest.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let ends = range([f64::NAN; 2]);
    let [low, high] = range(ends);
    let count = |end: f64| heights.clone().filter(|v| *v == end).count();
    let far = |end: f64, gap: f64| {
        let n = count(end);
        let apart = if n == 1 { APART[0] } else { APART[1] };
        (high > low && n <= SURFACE && gap > apart * (high - low)).then_some((end, n, [low, high]))
    };
    far(ends[0], low - ends[0]).or_else(|| far(ends[1], ends[1] - high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_height_far_from_all_others_is_named() {
        let with = |ends: &[f64]| {
            let all: Vec<f64> =
                (0..1200).map(|i| 5.0 + f64::from(i * 7919 % 1201) * 1e-3).chain(ends.iter().copied()).collect();
            lone(all.iter().copied()).map(|l| (l.0, l.1))
        };
        assert_eq!(with(&[-9999.0]), Some((-9999.0, 1)));
        assert_eq!(with(&[0.0; 6]), Some((0.0, 6)));
        assert_eq!(with(&[999.999, 999.999]), Some((999.999, 2)));
        assert_eq!(with(&[-9999.0, 7.0]), Some((-9999.0, 1)));
        // A burr, a step, a surface of its own.
        for measured in [&[7.0][..], &[], &[3.0; 9], &[6.3, 6.3]] {
            assert_eq!(with(measured), None, "{measured:?}");
        }
        assert_eq!(lone([1.0, 1.0, 9.0].into_iter()), None);
    }
}
