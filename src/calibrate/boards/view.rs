//! In: nothing. Out: the features of a board in a picture, and the settings of the search for it.
//! Frame and unit: pixels (centres at integers); feature ids index `BoardSpec::features()`.

use crate::fault::{Fault, Result};
use crate::geometry::Vec2;

/// One feature of a board found in a picture.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct BoardPoint {
    /// Index into [`crate::recording::BoardSpec::features`].
    pub feature_id: usize,
    /// Position in the picture, px.
    pub pixel: Vec2,
    /// Standard deviation per axis, px.
    pub sigma_px: f64,
}

/// The features of a board found in one picture.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct BoardView {
    /// The features that were found.
    pub points: Vec<BoardPoint>,
    /// The board looks the same after a half (or quarter) turn. The picture does not show which of [`super::turns`]
    /// applies; the entire set must resolve it.
    pub ambiguous: bool,
    /// Diameter of a circle grid's dots measured in this picture, mm, if the description does not state it.
    pub dot_diameter: Option<f64>,
    /// Whether the square at the origin of a ChArUco board is white: as described, or by the markers' ids if the
    /// description does not state it.
    pub begins_white: bool,
}

/// Settings of [`super::find`].
#[derive(Clone, Debug, PartialEq)]
pub struct FindOptions {
    /// Length of a corner's fit as a share of a square's side; 0.2..=0.48.
    pub reach: f64,
    /// Upper limit of this length, px; 4..=60.
    pub longest_px: f64,
    /// Pixels farther than this from an edge are excluded from a corner's fit, px; 2..=30.
    pub band_px: f64,
    /// Pictures with a longer side are first searched after a reduction to about this size, px; 320..=8192.
    pub detector_px: usize,
    /// Largest share of a chessboard's corners that the detector may miss; they are then predicted and verified in
    /// the picture; 0..=0.3.
    pub gaps: f64,
}

impl Default for FindOptions {
    fn default() -> Self {
        FindOptions { reach: 0.42, longest_px: 15.0, band_px: 6.0, detector_px: 1000, gaps: 0.1 }
    }
}

impl FindOptions {
    /// Refuses values outside the ranges stated at the fields.
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
