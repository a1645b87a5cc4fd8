//! In: nothing. Out: what a board looks like in a picture, and the settings of the search for it.
//! Frame and unit: pixels (centres at integers); feature ids index `BoardSpec::features()`.

use crate::fault::{Fault, Result};
use crate::geometry::Vec2;

/// One feature of a board as seen.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct BoardPoint {
    /// Index into [`crate::recording::BoardSpec::features`].
    pub feature_id: usize,
    /// Where it was seen, px.
    pub pixel: Vec2,
    /// Standard deviation per axis, px.
    pub sigma_px: f64,
}

/// A board as seen in one picture.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct BoardView {
    /// The features that were found.
    pub points: Vec<BoardPoint>,
    /// The board looks the same after a half (or quarter) turn: which of [`super::turns`] holds is unknown
    /// here and must come from the whole set.
    pub ambiguous: bool,
    /// Diameter of a circle grid's dots as this picture shows it, mm, where the description leaves it open.
    pub dot_diameter: Option<f64>,
    /// A ChArUco board's square at the origin is white: as described, or as its markers' ids say where the description
    /// leaves it open.
    pub begins_white: bool,
}

/// Settings of [`super::find`].
#[derive(Clone, Debug, PartialEq)]
pub struct FindOptions {
    /// Share of a square's side that a corner's fit reaches; 0.2..=0.48.
    pub reach: f64,
    /// The same in px at most; 4..=60.
    pub longest_px: f64,
    /// Pixels farther than this from an edge are left out of a corner's fit; 2..=30 px.
    pub band_px: f64,
    /// Pictures with a longer side are first searched at a size near this; 320..=8192 px.
    pub detector_px: usize,
    /// Share of a chessboard's corners that may be missed by the detector and are then predicted and
    /// verified on the picture; 0..=0.3.
    pub gaps: f64,
}

impl Default for FindOptions {
    fn default() -> Self {
        FindOptions { reach: 0.42, longest_px: 15.0, band_px: 6.0, detector_px: 1000, gaps: 0.1 }
    }
}

impl FindOptions {
    /// Refuses values out of the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("reach", self.reach, 0.2, 0.48),
            ("longest_px", self.longest_px, 4.0, 60.0),
            ("band_px", self.band_px, 2.0, 30.0),
            ("detector_px", self.detector_px as f64, 320.0, 8192.0),
            ("gaps", self.gaps, 0.0, 0.3),
        ];
        for (name, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err(Fault::usage(format!("{name} is {value}, {low} to {high} are allowed"))
                    .next("choose a value in that range"));
            }
        }
        Ok(())
    }
}
