//! In: a picture and the number of inner corners. Out: all of them with their ids, or why not.
//! Frame and unit: pixels; ids row by row from the board's first inner corner.

use super::grid::{FrontEnd, Grid, Prepared, lattices};
use super::refine::{Corner, Grey, Window};
use super::{BoardPoint, BoardView, FindOptions};
use crate::fault::{Fault, Result};
use crate::geometry::Vec2;
use crate::raster::Image;

/// Finds a chessboard that is wholly in view.
pub fn find(image: &Image, corners: [u32; 2], black_first: bool, options: &FindOptions) -> Result<BoardView> {
    let (columns, rows) = (corners[0] as usize, corners[1] as usize);
    let grey = Grey::new(image);
    let window = Window { reach: options.reach, longest_px: options.longest_px, margin: 1.0 };
    let largest = grey.width.max(grey.height);
    let first = (largest / options.detector_px).max(1);
    let shrinks: &[usize] = if first > 1 { &[first, 1] } else { &[1] };
    let (mut best, mut best_span): (Option<Grid>, f64) = (None, 0.0);
    for &shrink in shrinks {
        let prepared = Prepared::new(image, &grey, shrink);
        best_span = prepared.span;
        for front_end in FrontEnd::ALL {
            let candidates = front_end.candidates(&prepared.view());
            // The strength floor belongs to the ChESS response; the Radon one has no fixed scale.
            let floor = (front_end == FrontEnd::Radon).then_some(0.0);
            for mut grid in lattices(&candidates, floor) {
                grid.corners.iter_mut().flatten().for_each(|c| *c = prepared.to_full(c));
                if let Some(view) = accept(&grid, columns, rows, black_first, &grey, &window, options)? {
                    return Ok(view);
                }
                if best.as_ref().is_none_or(|b| b.count() < grid.count()) {
                    best = Some(grid);
                }
            }
        }
    }
    Err(why_not(best.as_ref(), columns, rows, best_span, &grey))
}

/// The view, where the lattice has the extent asked for and every corner stands the refinement.
fn accept(
    grid: &Grid,
    columns: usize,
    rows: usize,
    black_first: bool,
    grey: &Grey,
    window: &Window,
    options: &FindOptions,
) -> Result<Option<BoardView>> {
    let mut turned = grid.clone();
    if (grid.columns, grid.rows) != (columns, rows) {
        turned = grid.quarter_turn();
    }
    if (turned.columns, turned.rows) != (columns, rows) || !turned.fill_gaps(options.gaps) {
        return Ok(None);
    }
    let corners = turned.refined(grey, window, options.band_px);
    let Some(corners) = corners.into_iter().collect::<Option<Vec<Corner>>>() else { return Ok(None) };
    // Contrast of corner (i, j) has the sign of its lower right square, which is alternately coloured;
    // a lattice that slipped by one somewhere would show it here.
    let bright = |c: &Corner, k: usize| (c.contrast > 0.0) != ((k % columns + k / columns) % 2 == 1);
    let first_bright = bright(&corners[0], 0);
    if !corners.iter().enumerate().all(|(k, c)| bright(c, k) == first_bright) {
        return Ok(None);
    }
    orient(&corners, columns, rows, first_bright, black_first).map(Some)
}

/// Chooses the turn at which the square outside the first corner has its colour.
fn orient(corners: &[Corner], columns: usize, rows: usize, first_bright: bool, black_first: bool) -> Result<BoardView> {
    // The square outside the first corner and the one inside it (diagonally) have the same colour.
    let as_found = first_bright != black_first;
    let grid = Grid { columns, rows, corners: (0..columns * rows).map(|k| Some(Vec2::new(k as f64, 0.0))).collect() };
    let half = grid.quarter_turn().quarter_turn();
    let half_keeps_colour = (columns + rows) % 2 == 0;
    let square = columns == rows;
    // A quarter turn of an even square lattice moves a black first square onto a white one.
    let quarter_keeps_colour = square && columns % 2 == 1;
    let chosen = match (as_found, half_keeps_colour, square) {
        (true, _, _) => grid,
        (false, false, _) => half,
        (false, true, true) if !quarter_keeps_colour => grid.quarter_turn(),
        _ => {
            return Err(Fault::input(format!(
                "a board of {columns}x{rows} inner corners was found, but the square outside its first corner is {}",
                if black_first { "white" } else { "black" }
            ))
            .cause("first_square in the board's description is the other colour")
            .next(format!("set first_square to \"{}\"", if black_first { "white" } else { "black" })));
        }
    };
    // Where a turn changes nothing, the picture's upper left decides for now; the view says so.
    let ambiguous = half_keeps_colour;
    let chosen = if ambiguous { nearest_to_top_left(chosen, corners, quarter_keeps_colour) } else { chosen };
    let points = chosen
        .corners
        .iter()
        .flatten()
        .enumerate()
        .map(|(feature_id, old)| {
            let c = &corners[old.x as usize];
            BoardPoint { feature_id, pixel: c.pixel, sigma_px: c.sigma_px }
        })
        .collect();
    Ok(BoardView { points, ambiguous })
}

fn nearest_to_top_left(grid: Grid, corners: &[Corner], quarters: bool) -> Grid {
    let first = |g: &Grid| {
        let p = corners[g.corners[0].expect("full").x as usize].pixel;
        p.x + p.y
    };
    let mut best = grid.clone();
    let mut turned = grid;
    for k in 1..4 {
        turned = turned.quarter_turn();
        if (k == 2 || quarters) && first(&turned) < first(&best) {
            best = turned.clone();
        }
    }
    best
}

/// The likely reason for not finding the board.
fn why_not(best: Option<&Grid>, columns: usize, rows: usize, span: f64, grey: &Grey) -> Fault {
    let wanted = format!("no chessboard of {columns}x{rows} inner corners was found");
    if span < 0.06 {
        return Fault::refused(format!(
            "{wanted}: grey levels span {:.1} % of full scale, 6 % are needed",
            span * 100.0
        ))
        .cause("too dark, too bright, or the lens is covered")
        .next("adjust the exposure so that white squares reach half of full scale");
    }
    let Some(grid) = best.filter(|g| g.count() >= 9) else {
        return Fault::refused(format!("{wanted}, nor any other lattice of at least 9 corners"))
            .cause("the board is out of view, out of focus, too small (squares below 8 px) or badly lit")
            .next("look at the picture: the whole board must be in view and sharp");
    };
    let (c, r) = (grid.columns.max(grid.rows), grid.columns.min(grid.rows));
    let (wc, wr) = (columns.max(rows), columns.min(rows));
    let seen = format!("{wanted}; the largest lattice has {c}x{r} corners ({} seen)", grid.count());
    let pitch = grid.pitch();
    let cut = grid.corners.iter().flatten().any(|p| {
        let border = 1.3 * pitch;
        p.x < border || p.y < border || p.x > grey.width as f64 - border || p.y > grey.height as f64 - border
    });
    // A complete lattice that is larger than the one asked for is no board that was cut off.
    if grid.count() == c * r && c * r >= wc * wr && (!cut || (c >= wc && r >= wr && (c, r) != (wc, wr))) {
        return Fault::refused(seen)
            .cause("wrong board size given")
            .next(format!("if the board has {c}x{r} inner corners, say so in its description"));
    }
    if cut {
        return Fault::refused(format!("{seen} and touches the picture's edge"))
            .cause("the board is cut off")
            .next("keep the whole chessboard in view, or use a ChArUco board, which may be partly seen");
    }
    Fault::refused(format!("{seen}, squares of {pitch:.0} px"))
        .cause("part of the board is covered, glares or is blurred, or a wrong board size was given")
        .next("check the board's description, the light and the focus")
}
