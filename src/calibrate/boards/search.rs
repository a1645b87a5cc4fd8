//! In: a picture and the description of a board. Out: the board's features with their ids, sub-pixel positions and
//! sigmas, or a sentence that states why it was not found.
//! Frame and unit: pixels (centres at integers); feature ids index `BoardSpec::features()`.

use super::chess::{charuco, chessboard};
use super::dots::circles;
use super::marker_grid;
use super::view::{BoardView, FindOptions};
use crate::fault::Result;
use crate::raster::{Image, Light};
use crate::recording::BoardSpec;

/// Finds `board` in `image`. If it is not found, the fault states the reason.
pub fn find(image: &Image, board: &BoardSpec, options: &FindOptions) -> Result<BoardView> {
    options.check()?;
    let found = match board {
        BoardSpec::Chessboard { inner_corners, first_square, .. } => {
            chessboard::find(image, *inner_corners, first_square != "white", options)
        }
        BoardSpec::Charuco { .. } => charuco::find(image, board, options),
        BoardSpec::MarkerGrid { .. } => marker_grid::find(image, board, options),
        BoardSpec::Circles { .. } => circles::find(image, board, options),
    };
    found.map_err(|fault| {
        let light = Light::of(image);
        if light.why().is_some() { light.explain("the picture", fault) } else { fault }
    })
}
