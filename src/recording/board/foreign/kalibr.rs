//! In: Kalibr's target file. Out: the board.
//! Frame and unit: metres in the file; Kalibr's origin is the lower left corner and its z points out of the board,
//! ours is the upper left one and z points into it.

use super::super::spec::{BoardSpec, MarkerLayout};
use super::values::{count, mm, number};
use crate::fault::{Fault, Result};
use serde_json::{Map, Value};

/// The dictionary of the tags that Kalibr draws and finds.
const TAGS: &str = "DICT_APRILTAG_36h11";

pub fn read(file: &Map<String, Value>) -> Result<BoardSpec> {
    match file["target_type"].as_str().unwrap_or_default() {
        "aprilgrid" => {
            let tag = number(file, "tagSize")?;
            // A share of the tag's side, not a length.
            let gap = number(file, "tagSpacing")?;
            if gap > 1.0 {
                return Err(Fault::input(format!("'tagSpacing' is {gap}, above 0 and up to 1 is allowed"))
                    .cause("it is the gap divided by the tag's side, and no length")
                    .next("divide the gap between two tags by tagSize"));
            }
            Ok(BoardSpec::MarkerGrid {
                markers: [count(file, "tagCols")?, count(file, "tagRows")?],
                marker_mm: mm(tag),
                gap_mm: mm(tag * gap),
                dictionary: TAGS.into(),
                first_id: 0,
                border_mm: 0.0,
                layout: MarkerLayout::Kalibr,
                ring_cells: None,
            })
        }
        "checkerboard" => {
            let (rows, columns) = (number(file, "rowSpacingMeters")?, number(file, "colSpacingMeters")?);
            if (rows / columns - 1.0).abs() > 1e-9 {
                return Err(Fault::input(format!("fields of {columns} x {rows} m are no squares"))
                    .cause("a chessboard with oblong fields")
                    .next("use a board with square fields"));
            }
            Ok(BoardSpec::Chessboard {
                inner_corners: [count(file, "targetCols")?, count(file, "targetRows")?],
                square_mm: mm(rows),
                border_mm: 0.0,
                first_square: "black".into(),
            })
        }
        "circlegrid" => {
            // The asymmetric grid counts its rows and columns in another way than OpenCV and this program do.
            if file.get("asymmetricGrid").is_some_and(|a| !matches!(a.as_str(), Some("False" | "false"))) {
                return Err(Fault::input("Kalibr's asymmetric circle grid is not read")
                    .cause("its rows and columns are counted in another way")
                    .next("describe it with sheetlight board circles --asymmetric"));
            }
            Ok(BoardSpec::Circles {
                dots: [count(file, "targetCols")?, count(file, "targetRows")?],
                pitch_mm: mm(number(file, "spacingMeters")?),
                diameter_mm: None,
                asymmetric: false,
                origin: None,
                border_mm: 0.0,
            })
        }
        other => Err(Fault::input(format!("target_type '{other}' is not read"))
            .cause("Kalibr's kinds are aprilgrid, checkerboard and circlegrid")
            .next("correct target_type, or describe the board with sheetlight board")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::yaml;
    use super::*;

    #[test]
    fn an_aprilgrid_is_read_in_millimetres() {
        let text = "target_type: 'aprilgrid' #gridtype\ntagCols: 6\ntagRows: 5\ntagSize: 0.088 #size [m]\n\
                    tagSpacing: 0.3 #ratio\ncodeOffset: 0\n";
        let wanted = BoardSpec::MarkerGrid {
            markers: [6, 5],
            marker_mm: 88.0,
            gap_mm: 26.4,
            dictionary: TAGS.into(),
            first_id: 0,
            border_mm: 0.0,
            layout: MarkerLayout::Kalibr,
            ring_cells: None,
        };
        assert_eq!(yaml(text).unwrap(), wanted);
    }

    #[test]
    fn the_other_kinds_are_read_or_refused_in_words() {
        let squares = "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\n";
        let board = yaml(&format!("{squares}colSpacingMeters: 0.06\n")).unwrap();
        assert!(matches!(board, BoardSpec::Chessboard { inner_corners: [6, 7], square_mm: 60.0, .. }), "{board:?}");
        let dots = "target_type: circlegrid\ntargetCols: 6\ntargetRows: 7\nspacingMeters: 0.02\nasymmetricGrid: ";
        let board = yaml(&format!("{dots}False\n")).unwrap();
        assert!(matches!(board, BoardSpec::Circles { dots: [6, 7], pitch_mm: 20.0, .. }), "{board:?}");
        for (bad, says) in [
            (format!("{squares}colSpacingMeters: 0.05\n"), "no squares"),
            (format!("{dots}True\n"), "asymmetric circle grid is not read"),
            ("target_type: assymetric_aprilgrid\n".into(), "'assymetric_aprilgrid' is not read"),
            ("target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\n".into(), "'tagSpacing' is missing"),
            ("target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.08\ntagSpacing: 26.4\n".into(), "up to 1"),
            ("target_type: aprilgrid\ntagCols: 6.5\ntagSize: 0.08\ntagSpacing: 0.3\n".into(), "whole number"),
            ("target_type: aprilgrid\ntagSize: 0\n".into(), "'tagSize' is 0"),
            ("camera_model: pinhole\n".into(), "neither 'target_type' nor 'type'"),
        ] {
            let e = yaml(&bad).unwrap_err();
            assert!(e.what.contains(says) && !e.cause.is_empty() && !e.next.is_empty(), "{bad}: {e}");
        }
    }
}
