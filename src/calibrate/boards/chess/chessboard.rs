//! In: a picture and the number of inner corners. Out: all of them with their ids, or the reason for a failure.
//! Frame and unit: pixels; ids row by row from the board's first inner corner.

use super::grid::{FrontEnd, Grid, Prepared, lattices};
use super::growth::grown;
use crate::calibrate::boards::other_size::WRONG_SIZE;
use crate::calibrate::boards::refine::{Corner, Grey, Window};
use crate::calibrate::boards::{BoardPoint, BoardView, FindOptions};
use crate::fault::{Fault, Result};
use crate::geometry::Vec2;
use crate::raster::Image;

/// Smallest number of corners from which a lattice is grown. The result is verified in the picture, corner by corner,
/// and must be the complete board.
const SEED: usize = 12;

/// Finds a chessboard that is completely in view.
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
            // The strength threshold applies to the ChESS response; the Radon response has no fixed scale.
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

/// The view, if the lattice has the requested extent and every corner can be refined. The second attempt drops
/// corners of the background and searches for missed corners where their neighbours predict them.
fn accept(
    grid: &Grid,
    columns: usize,
    rows: usize,
    black_first: bool,
    grey: &Grey,
    window: &Window,
    options: &FindOptions,
) -> Result<Option<BoardView>> {
    let whole = whole(grid, columns, rows, grey, window, options);
    let Some(mut found) = whole.or_else(|| mended(grid, columns, rows, grey, window, options)) else { return Ok(None) };
    // The contrast of corner (i, j) has the sign of its lower right square, and the colours alternate. A lattice
    // shifted by one somewhere would violate this.
    let bright = |k: usize, c: &Corner| (c.contrast > 0.0) != ((k % columns + k / columns) % 2 == 1);
    let mut all = found.corners.iter().enumerate().filter_map(|(k, c)| Some(bright(k, c.as_ref()?)));
    let Some(first_bright) = all.next() else { return Ok(None) };
    if !all.all(|b| b == first_bright) || !found.grid.fill_gaps(1.0) {
        return Ok(None);
    }
    // A corner may be hidden but not out of view: if the board continues beyond the picture, its extent is unknown.
    let inside = |p: &Vec2| p.x > 0.0 && p.y > 0.0 && p.x < grey.width as f64 - 1.0 && p.y < grey.height as f64 - 1.0;
    let hidden = found.grid.corners.iter().zip(&found.corners).filter(|(_, c)| c.is_none());
    if !hidden.filter_map(|(place, _)| place.as_ref()).all(inside) {
        return Ok(None);
    }
    orient(&found, first_bright, black_first).map(Some)
}

/// A lattice of the requested extent with its refined corners.
struct Found {
    grid: Grid,
    corners: Vec<Option<Corner>>,
}

fn whole(
    grid: &Grid,
    columns: usize,
    rows: usize,
    grey: &Grey,
    window: &Window,
    options: &FindOptions,
) -> Option<Found> {
    let mut turned = grid.clone();
    if (grid.columns, grid.rows) != (columns, rows) {
        turned = grid.quarter_turn();
    }
    if (turned.columns, turned.rows) != (columns, rows) || !turned.fill_gaps(options.gaps) {
        return None;
    }
    let corners = turned.refined(grey, window, options.band_px);
    corners.iter().all(Option::is_some).then_some(Found { grid: turned, corners })
}

/// Grows the lattice as far as the picture shows the board, at least one line beyond the requested extent, because a
/// larger board must be refused. A few corners may remain unseen (glare).
fn mended(
    grid: &Grid,
    columns: usize,
    rows: usize,
    grey: &Grey,
    window: &Window,
    options: &FindOptions,
) -> Option<Found> {
    if grid.count() < SEED {
        return None;
    }
    let mut large = grid.padded(columns.max(rows).saturating_sub(grid.columns.min(grid.rows)) + 1);
    let corners = grown(&mut large, grey, window, options.band_px);
    let [across, down] = large.extent();
    let cut = |k: usize| (down.start + k / across.len()) * large.columns + across.start + k % across.len();
    let count = across.len() * down.len();
    let mut found = Found {
        grid: Grid {
            columns: across.len(),
            rows: down.len(),
            corners: (0..count).map(|k| large.corners[cut(k)]).collect(),
        },
        corners: (0..count).map(|k| corners[cut(k)]).collect(),
    };
    if (found.grid.columns, found.grid.rows) != (columns, rows) {
        let places = Grid { corners: (0..count).map(|k| Some(Vec2::new(k as f64, 0.0))).collect(), ..found.grid };
        let order = places.quarter_turn();
        // After a quarter turn, the quadrant between the axes is the next one, which has the opposite colour.
        let turned = |c: Corner| Corner { contrast: -c.contrast, ..c };
        found.corners = order.corners.iter().flatten().map(|k| found.corners[k.x as usize].map(turned)).collect();
        found.grid = Grid {
            corners: found.corners.iter().map(|c| c.map(|c| c.pixel)).collect(),
            columns: order.columns,
            rows: order.rows,
        };
    }
    let fits = (found.grid.columns, found.grid.rows) == (columns, rows);
    let missing = found.corners.iter().filter(|c| c.is_none()).count() as f64;
    (fits && missing <= options.gaps * count as f64).then_some(found)
}

/// Chooses the rotation at which the square outside the first corner has the described colour.
fn orient(found: &Found, first_bright: bool, black_first: bool) -> Result<BoardView> {
    let (columns, rows) = (found.grid.columns, found.grid.rows);
    // The square outside the first corner and the diagonally opposite one inside have the same colour.
    let as_found = first_bright != black_first;
    let grid = Grid { columns, rows, corners: (0..columns * rows).map(|k| Some(Vec2::new(k as f64, 0.0))).collect() };
    let half = grid.quarter_turn().quarter_turn();
    let half_keeps_colour = (columns + rows) % 2 == 0;
    let square = columns == rows;
    // n inner corners mean n + 1 squares: for odd n, a quarter turn moves a black corner square onto a white one.
    let quarter_keeps_colour = square && columns.is_multiple_of(2);
    let chosen = match (as_found, half_keeps_colour, square) {
        (true, _, _) => grid,
        (false, false, _) => half,
        (false, true, true) if !quarter_keeps_colour => grid.quarter_turn(),
        _ => {
            return Err(Fault::input(format!(
                "a board of {columns}x{rows} inner corners was found, but the square outside its first corner is {}",
                if black_first { "white" } else { "black" }
            ))
            .cause("first_square in the board's description is the other colour, or the picture is mirrored")
            .next(format!(
                "set first_square to \"{}\", or switch the camera's mirroring off",
                if black_first { "white" } else { "black" }
            )));
        }
    };
    // If a rotation changes nothing, the corner closest to the picture's upper left comes first for now; the view is
    // marked as ambiguous.
    let ambiguous = half_keeps_colour;
    let chosen = if ambiguous { nearest_to_top_left(chosen, &found.grid, quarter_keeps_colour) } else { chosen };
    let points = chosen
        .corners
        .iter()
        .flatten()
        .enumerate()
        .filter_map(|(feature_id, old)| {
            let c = found.corners[old.x as usize]?;
            Some(BoardPoint { feature_id, pixel: c.pixel, sigma_px: c.sigma_px })
        })
        .collect();
    Ok(BoardView { points, ambiguous, ..BoardView::default() })
}

/// Of the equivalent orders, the one whose first corner is closest to the picture's upper left. `order` holds indices
/// into `places`, whose corners are all known.
fn nearest_to_top_left(order: Grid, places: &Grid, quarters: bool) -> Grid {
    let first = |g: &Grid| {
        let p = places.corners[g.corners[0].expect("full").x as usize].expect("full");
        p.x + p.y
    };
    let mut best = order.clone();
    let mut turned = order;
    for k in 1..4 {
        turned = turned.quarter_turn();
        if (k == 2 || quarters) && first(&turned) < first(&best) {
            best = turned.clone();
        }
    }
    best
}

/// The likely reason why the board was not found.
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
    // A complete lattice of another size is another board, unless the picture's edge cut off a larger board.
    let other = (c, r) != (wc, wr) && (!cut || (c >= wc && r >= wr));
    if grid.count() == c * r && other {
        return Fault::refused(seen).cause(WRONG_SIZE).next(format!(
            "if the board has {c}x{r} inner corners, state inner_corners [{c}, {r}] in its description; else uncover it"
        ));
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

#[cfg(test)]
mod tests {
    use super::super::trials::{facing, picture_by};
    use super::*;
    use crate::camera::{Distortion, Intrinsics};
    use crate::geometry::Vec3;
    use crate::recording::BoardSpec;

    /// Labels run in any direction; a corner under glare makes the lattice incomplete, so that it has to be mended.
    #[test]
    fn a_mended_lattice_has_its_origin_whichever_way_its_labels_run() {
        let (width, height) = (640, 480);
        let distortion = Distortion::default();
        let camera = Intrinsics { fx: 600.0, fy: 600.0, cx: 319.5, cy: 239.5, skew: 0.0, distortion, width, height };
        let board = BoardSpec::Chessboard {
            inner_corners: [11, 8],
            square_mm: 12.0,
            border_mm: 8.0,
            first_square: "black".into(),
        };
        let pose = facing(&board, Vec3::new(0.3, -0.2, 0.1), 270.0);
        let truth: Vec<Vec2> =
            board.features().iter().map(|f| camera.pixel_from_point(&pose.point(f)).unwrap()).collect();
        let mut levels: Vec<u8> = picture_by(&camera, &board, &pose).to_f32().iter().map(|v| *v as u8).collect();
        for (i, level) in levels.iter_mut().enumerate() {
            let p = Vec2::new((i as u32 % width).into(), (i as u32 / width).into());
            if (p - truth[37]).norm() < 9.0 {
                *level = 255;
            }
        }
        let image = Image::from_u8(width, height, levels);
        let (grey, options) = (Grey::new(&image), FindOptions::default());
        let window = Window { reach: options.reach, longest_px: options.longest_px, margin: 1.0 };
        let seen = |k: usize| (k != 37).then_some(truth[k]);
        let mut grid = Grid { columns: 11, rows: 8, corners: (0..88).map(seen).collect() };
        for quarters in 0..4 {
            let view = accept(&grid, 11, 8, true, &grey, &window, &options).unwrap().expect("a whole board");
            assert!((80..88).contains(&view.points.len()), "{} corners", view.points.len());
            let off = view.points.iter().map(|p| (p.pixel - truth[p.feature_id]).norm()).fold(0.0, f64::max);
            assert!(off < 0.1, "labels turned by {quarters} quarters: {off} px");
            grid = grid.quarter_turn();
        }
    }
}
