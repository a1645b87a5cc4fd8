//! In: the path of a board's description, our own or another program's. Out: the board, checked.
//! Frame and unit: board frame, mm.

use super::foreign;
use super::spec::BoardSpec;
use crate::fault::{Fault, Result};
use std::path::Path;

impl BoardSpec {
    /// Reads a board's description file: as `sheetlight board` writes it (.json), Kalibr's or ROS-Industrial's
    /// (.yaml), or HALCON's (.descr, .cpd).
    pub fn load(path: &Path) -> Result<BoardSpec> {
        let text = crate::files::read_text(path)?;
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let board = match ending.as_str() {
            "yaml" | "yml" => foreign::yaml(&text).map_err(|e| e.at(path.display()))?,
            "descr" | "cpd" => foreign::halcon(&text).map_err(|e| e.at(path.display()))?,
            _ => serde_json::from_str(&text).map_err(|e| {
                Fault::input(format!("{}: is not a board description: {e}", path.display()))
                    .cause(crate::files::slip_in(&text, e.line(), "a misspelt key or a missing size"))
                    .next("compare it with docs/file-formats.md, or write one with sheetlight board")
            })?,
        };
        board.check().map_err(|e| e.at(path.display()))?;
        Ok(board)
    }
}
