//! In: what a recording states about itself. Out: the procedures that it suits.
//! Frame and unit: none.

use super::calibrate::{OfBoards, Target};
use sheetlight::recording::{Beam, Meta};
use strum::VariantArray;

/// The procedures that a recording suits, by their names in orders; a calibration by its target.
pub fn suits(meta: &Meta) -> Vec<&'static str> {
    let axis = meta.motion().axis().is_some();
    if meta.board.is_some() || !meta.boards.is_empty() {
        let boards = OfBoards { beam: meta.beam, axis };
        let targets = Target::VARIANTS.iter().filter(|target| target.suits(&boards)).map(|target| (*target).into());
        return targets.chain(["joint"]).collect();
    }
    match meta.beam {
        Some(Beam::Pointer) if axis => vec![],
        Some(Beam::Pointer) => vec!["touch"],
        Some(Beam::Line) | None => vec!["scan"],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_suits_what_it_shows() {
        let of = |rest: &str| {
            let image = r#""width":64,"height":48,"bits":8,"channels":1,"response":"linear""#;
            let pixels = format!(r#""image":{{{image},"pixel_centre":"integer coordinates"}}"#);
            let text = format!(r#"{{"format":1,"set":"s","units":"mm","frames":[],{pixels}{rest}}}"#);
            suits(&serde_json::from_str(&text).unwrap())
        };
        let drawn = r#""inner_corners":[9,6],"square_mm":25,"border_mm":10,"first_square":"black""#;
        let board = &format!(r#","board":{{"type":"chessboard",{drawn}}}"#);
        let table = r#","motion":{"kind":"turntable","carries":"part","unit":"deg"}"#;
        assert_eq!(of(board), ["camera", "hand_eye", "laser_plane", "pointer", "joint"]);
        assert_eq!(of(&format!(r#"{board},"beam":"line""#)), ["camera", "laser_plane", "joint"]);
        assert_eq!(of(&format!(r#"{board},"beam":"pointer"{table}"#)), ["camera", "pointer", "axis", "joint"]);
        assert_eq!(of(&format!(r#","beam":"line"{table}"#)), ["scan"]);
        assert_eq!(of(""), ["scan"]);
        assert_eq!(of(r#","beam":"pointer""#), ["touch"]);
        assert!(of(&format!(r#","beam":"pointer"{table}"#)).is_empty());
    }
}
