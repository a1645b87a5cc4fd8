//! In: the part of ROS-Industrial's configuration that names its target. Out: the board.
//! Frame and unit: metres in the file. ROS-Industrial's origin is the larger dot at the lower left, its x runs right,
//! y up and z out of the board. Ours is the same dot, but z points into the board: our x is its y, our y its x.

use super::super::mark::OriginMark;
use super::super::spec::BoardSpec;
use super::values::{count, mm, number};
use crate::fault::{Fault, Result};
use serde_json::{Map, Value};

pub fn read(finder: &Map<String, Value>, kind: &str) -> Result<BoardSpec> {
    match kind.trim_end_matches("Finder") {
        "ModifiedCircleGridTarget" => Ok(BoardSpec::Circles {
            dots: [count(finder, "rows")?, count(finder, "cols")?],
            pitch_mm: mm(number(finder, "spacing")?),
            diameter_mm: finder.get("circle_diameter").map(|_| number(finder, "circle_diameter")).transpose()?.map(mm),
            asymmetric: false,
            origin: Some(OriginMark::LargerDot { diameter_mm: None }),
            border_mm: 0.0,
        }),
        _ => Err(Fault::input(format!("the target '{kind}' is not read"))
            .cause("of ROS-Industrial's targets only the ModifiedCircleGridTarget is read")
            .next("describe a ChArUco or ArUco board with sheetlight board charuco or markers")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::yaml;
    use super::*;

    #[test]
    fn the_modified_circle_grid_begins_at_its_larger_dot() {
        let finder = "type: ModifiedCircleGridTargetFinder\nrows: 8\ncols: 10\nspacing: 0.0254 # metres\n";
        let nested: String = finder.lines().map(|l| format!("  {l}\n")).collect();
        let wanted = BoardSpec::Circles {
            dots: [8, 10],
            pitch_mm: 25.4,
            diameter_mm: None,
            asymmetric: false,
            origin: Some(OriginMark::LargerDot { diameter_mm: None }),
            border_mm: 0.0,
        };
        let of_params = "  circle_detector_params:\n    minThreshold: 20\n";
        for text in [finder.to_owned(), format!("homography_threshold: 1.0\ntarget_finder:\n{nested}{of_params}")] {
            assert_eq!(yaml(&text).unwrap(), wanted, "{text}");
        }
        let e = yaml("type: CharucoGridTargetFinder\nrows: 5\n").unwrap_err();
        assert!(e.what.contains("CharucoGridTargetFinder") && e.next.contains("board charuco"), "{e}");
    }
}
