//! Finds the visible inner corners of a ChArUco board (OpenCV's dictionaries) with their ids, in pixels. Ids count
//! row by row from the inner corner closest to the board's origin.

use super::first_square::Turned;
use super::grid::{FrontEnd, Grid, Prepared};
use super::growth::grown;
use crate::calibrate::boards::described::contradicts;
use crate::calibrate::boards::marker_grid::readable;
use crate::calibrate::boards::refine::{Grey, Window};
use crate::calibrate::boards::{BoardPoint, BoardView, FindOptions};
use crate::fault::{Fault, Result};
use crate::geometry::Vec2;
use crate::raster::Image;
use crate::recording::{BoardSpec, Markers};
use calib_targets_charuco::{CharucoBoardSpec, CharucoDetector, CharucoParams, MarkerLayout};

/// Smallest number of corners in an accepted view: a pose needs 6, and some redundancy.
const FEWEST: usize = 8;

/// The printed layout, as `BoardSpec::Charuco` states it.
struct Layout {
    squares: [u32; 2],
    /// Side of a marker as a share of a square's side.
    marker: f64,
}

/// The interpretation of the picture by one order of the markers.
struct Sight {
    view: BoardView,
    /// Number of markers that this order explains.
    markers: usize,
    /// Range of the picture's grey levels as a share of full scale.
    span: f64,
    /// Why nothing was found; empty if the board was found.
    reason: String,
}

/// Finds a ChArUco board that is at least partly in view.
pub fn find(image: &Image, board: &BoardSpec, options: &FindOptions) -> Result<BoardView> {
    let BoardSpec::Charuco { squares, square_mm, marker_mm, first_square, .. } = board else {
        return Err(Fault::usage("the board is not a ChArUco board").next("describe a ChArUco board"));
    };
    let layout = Layout { squares: *squares, marker: marker_mm / square_mm };
    let grey = Grey::new(image);
    let sight = |white: bool| match Turned::of(*squares, white) {
        Some(turned) => look(image, &grey, &board.beginning(white), &layout, &turned, options).map(Some),
        None => Ok(None),
    };
    let chosen = match first_square.as_deref() {
        Some(colour) => sight(colour == "white")?,
        None => choose(board, sight(false)?, || sight(true), &layout)?,
    };
    match chosen {
        Some(sight) if sight.view.points.len() >= FEWEST => Ok(sight.view),
        Some(sight) => Err(why_not(&layout, &sight, board, &grey, options)),
        None => Err(Fault::input(format!(
            "a ChArUco board of {}x{} squares that begins with a white one is not found",
            squares[0], squares[1]
        ))
        .cause("boards that begin with white are found with an even number of columns or rows")
        .next("use a board with an even number of rows, or one that begins with a black square")),
    }
}

/// Chooses the order of markers that explains the picture, for a board whose first square is not stated.
///
/// # Errors
/// Both orders explain it: the columns that would distinguish them are out of view.
fn choose(
    board: &BoardSpec,
    black: Option<Sight>,
    white: impl FnOnce() -> Result<Option<Sight>>,
    layout: &Layout,
) -> Result<Option<Sight>> {
    let [columns, rows] = layout.squares;
    let Some(black) = black else { return white() };
    if !board.first_square_may_stay_open() && black.markers * 2 > markers_between(&black.view, layout) {
        return Ok(Some(black));
    }
    let Some(white) = white()? else { return Ok(Some(black)) };
    // If a board is read shifted by a column, the corners of its outer column are missing: at least two.
    let more = |a: &Sight, b: &Sight| a.markers > b.markers || a.view.points.len() > b.view.points.len() + 1;
    match (more(&white, &black), more(&black, &white)) {
        (true, false) => Ok(Some(white)),
        (false, true) => Ok(Some(black)),
        _ if black.markers > 0 => Err(Fault::refused(format!(
            "the picture does not show which colour the {columns}x{rows} ChArUco board begins with: {} markers fit \
             both",
            black.markers
        ))
        .cause("the board's outer columns are out of view")
        .next(
            "state \"first_square\" in the board's description: \"white\" for boards of OpenCV before 4.6, else \
               \"black\"",
        )),
        _ => Ok(Some(black)),
    }
}

/// Number of markers that must be visible between these corners: half of the squares with all four corners found.
fn markers_between(view: &BoardView, layout: &Layout) -> usize {
    let columns = layout.squares[0] as usize - 1;
    let mut seen = vec![false; columns * (layout.squares[1] as usize - 1)];
    view.points.iter().for_each(|p| seen[p.feature_id] = true);
    let whole = (0..seen.len()).filter(|k| k % columns + 1 < columns && k + columns + 1 < seen.len());
    whole.filter(|k| [0, 1, columns, columns + 1].iter().all(|step| seen[k + step])).count() / 2
}

/// Searches for a board whose first square is known.
fn look(
    image: &Image,
    grey: &Grey,
    board: &BoardSpec,
    layout: &Layout,
    turned: &Turned,
    options: &FindOptions,
) -> Result<Sight> {
    let detector = detector(board, layout, turned)?;
    let (columns, rows) = (layout.squares[0] as usize - 1, layout.squares[1] as usize - 1);
    let first = (grey.width.max(grey.height) / options.detector_px).max(1);
    let shrinks: &[usize] = if first > 1 { &[first, 1] } else { &[1] };
    let begins_white = board.begins_white();
    let mut best = Sight { view: BoardView::default(), markers: 0, span: 0.0, reason: String::new() };
    for &shrink in shrinks {
        let prepared = Prepared::new(image, grey, shrink);
        best.span = prepared.span;
        // Radon candidates carry no strength for the marker detector to judge, so only two front ends are used.
        for front_end in [FrontEnd::Plain, FrontEnd::Enlarged] {
            let candidates = front_end.candidates(&prepared.view());
            let found = match detector.detect_with_corners(&prepared.view(), &candidates) {
                Ok(found) => found,
                Err(e) => {
                    best.reason = e.to_string();
                    continue;
                }
            };
            let mut grid = Grid { columns, rows, corners: vec![None; columns * rows] };
            for c in &found.corners {
                // The detector was given positions in squares: corner (1, 1) is the first inner one.
                let at = [c.target_position.x.round() as usize, c.target_position.y.round() as usize];
                let [nx, ny] = turned.squares().map(|n| n as usize);
                if (1..nx).contains(&at[0]) && (1..ny).contains(&at[1]) {
                    let [i, j] = turned.back(at);
                    let p = Vec2::new(f64::from(c.position.x), f64::from(c.position.y));
                    grid.corners[(j - 1) * columns + i - 1] = Some(prepared.to_full(&p));
                }
            }
            let view = refine(&mut grid, layout, grey, options);
            if best.view.points.len() < view.points.len() {
                (best.view, best.markers) = (BoardView { begins_white, ..view }, found.markers.len());
            }
            // The enlarged picture is only for boards that the plain one hardly shows.
            if best.view.points.len() >= 3 * FEWEST {
                break;
            }
        }
        if best.view.points.len() >= FEWEST {
            break;
        }
    }
    Ok(best)
}

fn detector(board: &BoardSpec, layout: &Layout, turned: &Turned) -> Result<CharucoDetector> {
    let [columns, rows] = turned.squares();
    let spec = CharucoBoardSpec::new(rows, columns, 1.0, layout.marker as f32, turned.dictionary(board)?)
        .with_marker_layout(MarkerLayout::OpenCvCharuco);
    CharucoDetector::new(CharucoParams::for_board(spec)).map_err(|e| {
        Fault::input(format!("the board's description is impossible: {e}"))
            .cause("squares, marker_mm, square_mm or dictionary do not go together")
            .next("correct the board's description")
    })
}

/// Refines the corners found and grows the lattice over the board.
fn refine(grid: &mut Grid, layout: &Layout, grey: &Grey, options: &FindOptions) -> BoardView {
    // The white margin around a marker, less a quarter for blur.
    let margin = 0.75 * 0.5 * (1.0 - layout.marker);
    let window = Window { reach: options.reach, longest_px: options.longest_px, margin };
    let points = grown(grid, grey, &window, options.band_px)
        .iter()
        .enumerate()
        .filter_map(|(feature_id, c)| c.map(|c| BoardPoint { feature_id, pixel: c.pixel, sigma_px: c.sigma_px }))
        .collect();
    BoardView { points, ..BoardView::default() }
}

fn why_not(layout: &Layout, sight: &Sight, board: &BoardSpec, grey: &Grey, options: &FindOptions) -> Fault {
    let [c, r] = layout.squares;
    let wanted = format!("fewer than {FEWEST} corners of the {c}x{r} ChArUco board were found");
    if sight.span < 0.06 {
        return Fault::refused(format!(
            "{wanted}: grey levels span {:.1} % of full scale, 6 % are needed",
            sight.span * 100.0
        ))
        .cause("too dark, too bright, or the lens is covered")
        .next("adjust the exposure so that white squares reach half of full scale");
    }
    // The detector reads only markers where this board has them, so the picture is searched for any marker.
    let markers = Markers::of(board).ok().flatten();
    let read = markers.as_ref().map(|m| readable(grey, board, m, options)).unwrap_or_default();
    if let Some(other) = markers.and_then(|m| contradicts(board, &m, &read)) {
        return Fault::refused(format!("{wanted}: {}", other.what)).cause(other.cause).next(other.next);
    }
    let reason = match read.len() {
        0 => sight.reason.clone(),
        _ => "markers of the dictionary were read".into(),
    };
    let cause = if read.is_empty() {
        "the board is out of view or out of focus, its markers are smaller than 15 px, or the description \
            names another dictionary or size"
    } else {
        "most of the board is out of view, out of focus or covered, or the description names another size"
    };
    Fault::refused(if reason.is_empty() { wanted } else { format!("{wanted} ({reason})") })
        .cause(cause)
        .next("look at the picture and compare the printed board with its description")
}
