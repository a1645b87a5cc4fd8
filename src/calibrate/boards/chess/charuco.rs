//! In: a picture and a ChArUco description (OpenCV's layout and dictionaries). Out: the inner corners
//! that are in view with their ids, or why there are none.
//! Frame and unit: pixels; ids row by row from the inner corner nearest to the board's origin.

use super::grid::{FrontEnd, Grid, Prepared};
use super::growth::grown;
use crate::calibrate::boards::refine::{Grey, Window};
use crate::calibrate::boards::{BoardPoint, BoardView, FindOptions};
use crate::fault::{Fault, Result};
use crate::geometry::Vec2;
use crate::raster::Image;
use calib_targets_charuco::{CharucoBoardSpec, CharucoDetector, CharucoParams, MarkerLayout, resolve_dictionary};

/// Corners at least, below which a view is refused: a pose wants 6 with some to spare.
const FEWEST: usize = 8;

/// The printed layout, as `BoardSpec::Charuco` states it.
pub struct Layout<'a> {
    pub squares: [u32; 2],
    pub square_mm: f64,
    pub marker_mm: f64,
    pub dictionary: &'a str,
}

/// Finds a ChArUco board that is at least partly in view.
pub fn find(image: &Image, layout: &Layout<'_>, options: &FindOptions) -> Result<BoardView> {
    let detector = detector(layout)?;
    let (columns, rows) = (layout.squares[0] as usize - 1, layout.squares[1] as usize - 1);
    let grey = Grey::new(image);
    let first = (grey.width.max(grey.height) / options.detector_px).max(1);
    let shrinks: &[usize] = if first > 1 { &[first, 1] } else { &[1] };
    let mut best: Option<BoardView> = None;
    let (mut span, mut reason) = (0.0, String::new());
    for &shrink in shrinks {
        let prepared = Prepared::new(image, &grey, shrink);
        span = prepared.span;
        // Radon candidates carry no strength that the marker detector could judge: two front ends.
        for front_end in [FrontEnd::Plain, FrontEnd::Enlarged] {
            let candidates = front_end.candidates(&prepared.view());
            let found = match detector.detect_with_corners(&prepared.view(), &candidates) {
                Ok(found) => found,
                Err(e) => {
                    reason = e.to_string();
                    continue;
                }
            };
            let mut grid = Grid { columns, rows, corners: vec![None; columns * rows] };
            for c in &found.corners {
                // Positions on the board were given in squares: corner (1, 1) is the first inner one.
                let (i, j) = (c.target_position.x.round() as usize, c.target_position.y.round() as usize);
                if (1..=columns).contains(&i) && (1..=rows).contains(&j) {
                    let p = Vec2::new(f64::from(c.position.x), f64::from(c.position.y));
                    grid.corners[(j - 1) * columns + i - 1] = Some(prepared.to_full(&p));
                }
            }
            let view = refine(&mut grid, layout, &grey, options);
            if best.as_ref().is_none_or(|b| b.points.len() < view.points.len()) {
                best = Some(view);
            }
            // The enlarged picture is for boards that the plain one hardly shows.
            if best.as_ref().is_some_and(|b| b.points.len() >= 3 * FEWEST) {
                break;
            }
        }
        if best.as_ref().is_some_and(|b| b.points.len() >= FEWEST) {
            break;
        }
    }
    best.filter(|b| b.points.len() >= FEWEST).ok_or_else(|| why_not(layout, span, &reason))
}

fn detector(layout: &Layout<'_>) -> Result<CharucoDetector> {
    let dictionary = resolve_dictionary(layout.dictionary).ok_or_else(|| {
        Fault::input(format!("'{}' is no known marker dictionary", layout.dictionary))
            .cause("a misspelt name in the board's description")
            .next("use OpenCV's name, e.g. DICT_5X5_250")
    })?;
    let relative = (layout.marker_mm / layout.square_mm) as f32;
    let spec = CharucoBoardSpec::new(layout.squares[1], layout.squares[0], 1.0, relative, dictionary)
        .with_marker_layout(MarkerLayout::OpenCvCharuco);
    CharucoDetector::new(CharucoParams::for_board(spec)).map_err(|e| {
        Fault::input(format!("the board's description is impossible: {e}"))
            .cause("squares, marker_mm, square_mm or dictionary do not go together")
            .next("correct the board's description")
    })
}

/// Refines what was found and lets the lattice grow over the board.
fn refine(grid: &mut Grid, layout: &Layout<'_>, grey: &Grey, options: &FindOptions) -> BoardView {
    // The white margin round a marker, less a quarter for blur.
    let margin = 0.75 * 0.5 * (1.0 - layout.marker_mm / layout.square_mm);
    let window = Window { reach: options.reach, longest_px: options.longest_px, margin };
    let points = grown(grid, grey, &window, options.band_px)
        .iter()
        .enumerate()
        .filter_map(|(feature_id, c)| c.map(|c| BoardPoint { feature_id, pixel: c.pixel, sigma_px: c.sigma_px }))
        .collect();
    BoardView { points, ambiguous: false, dot_diameter: None }
}

fn why_not(layout: &Layout<'_>, span: f64, reason: &str) -> Fault {
    let [c, r] = layout.squares;
    let wanted = format!("fewer than {FEWEST} corners of the {c}x{r} ChArUco board were found");
    if span < 0.06 {
        return Fault::refused(format!(
            "{wanted}: grey levels span {:.1} % of full scale, 6 % are needed",
            span * 100.0
        ))
        .cause("too dark, too bright, or the lens is covered")
        .next("adjust the exposure so that white squares reach half of full scale");
    }
    Fault::refused(if reason.is_empty() { wanted } else { format!("{wanted} ({reason})") })
        .cause("the board is out of view or out of focus, its markers are smaller than 15 px, or the description names another dictionary or size")
        .next("look at the picture and compare the printed board with its description")
}
