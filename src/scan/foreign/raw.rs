//! What a foreign file holds: numbers, to which no unit is assigned yet.

use crate::raster::{Kind, Says, unit_mm};

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Raw {
    /// A picture of heights: levels by column and row, row 0 at the top.
    Picture {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Row by row, as written; NaN where the file hides a pixel.
        levels: Vec<f64>,
        /// Their number type; whole numbers cannot mark a missing value by themselves, as NaN does.
        kind: Kind,
        /// What the file states about them; not applied yet.
        says: Says,
    },
    /// Points in the order of the file; a missing one has a coordinate that is not finite.
    Points {
        /// Points per line, if the file is organised in lines of equal length.
        line: Option<usize>,
        /// Coordinates.
        points: Vec<[f64; 3]>,
        /// An intensity for each point, if the file holds intensities.
        intensity: Option<Vec<f32>>,
        /// mm in the unit that a comment of the file states, and that comment.
        unit: Option<(f64, String)>,
    },
}

/// The unit of length in a comment: `units: m`, `unit = mm`, or the last word of Sheetlight's own.
pub(super) fn unit_in(comment: &str) -> Option<(f64, String)> {
    let comment = comment.trim();
    let said = |mm: f64| (mm, format!("'{comment}'"));
    if comment.starts_with("sheetlight cloud") {
        return unit_mm(comment.rsplit(',').next()?).map(said);
    }
    let small = comment.to_lowercase();
    let (before, rest) = small.split_once("unit")?;
    let rest = rest.strip_prefix('s').unwrap_or(rest);
    let alone = !before.ends_with(char::is_alphanumeric) && !rest.starts_with(char::is_alphanumeric);
    let words = rest.split(|c: char| c.is_whitespace() || ":=,;()[]\"'".contains(c));
    let words: Vec<&str> = words.filter(|w| !w.is_empty()).take(4).collect();
    let factor = words.iter().find_map(|w| w.parse::<f64>().ok()).unwrap_or(1.0);
    // "in" is mostly the preposition.
    let unit = words.iter().filter(|w| **w != "in").chain(words.iter().filter(|_| words.len() == 1));
    let mm = unit.into_iter().find_map(|w| unit_mm(w)).filter(|_| alone)? * factor;
    (mm.is_finite() && mm > 0.0).then(|| said(mm))
}

/// Most points or cells of a file.
pub(super) const MOST_POINTS: usize = 1 << 26;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_found_in_comments() {
        for (comment, wanted) in [
            (" units: m", Some(1000.0)),
            ("Unit = mm", Some(1.0)),
            ("unit inch", Some(25.4)),
            ("units are in metres", Some(1000.0)),
            ("units: in", Some(25.4)),
            ("[units] 0.001 m", Some(1.0)),
            ("sheetlight cloud, map frame, mm", Some(1.0)),
            ("community edition, in m", None),
            ("united m", None),
            ("unit normals", None),
            ("made by m", None),
            ("unit: 0 m", None),
        ] {
            assert_eq!(unit_in(comment).map(|u| u.0), wanted, "{comment}");
        }
    }
}
