//! In: boards drawn by `print` and seen by a perfect pinhole camera. Out: tests that each kind is found at its true
//! position, and otherwise refused with the right reason.
//! Frame and unit: pixels, mm.

use super::turns::turns;
use crate::calibrate::boards::print::{Sheet, sheet};
use crate::calibrate::boards::{BoardView, FindOptions, find};
use crate::camera::Intrinsics;
use crate::geometry::{Board, Camera, Rigid, Vec2, Vec3};
use crate::raster::Image;
use crate::recording::BoardSpec;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;

fn camera() -> Intrinsics {
    Intrinsics {
        fx: 600.0,
        fy: 600.0,
        cx: 319.5,
        cy: 239.5,
        skew: 0.0,
        distortion: Default::default(),
        width: WIDTH,
        height: HEIGHT,
    }
}

pub(in crate::calibrate) fn facing(board: &BoardSpec, rotation: Vec3, distance: f64) -> Rigid<Camera, Board> {
    let features = board.features();
    let centre = features.iter().sum::<Vec3>() / features.len() as f64;
    let r = crate::geometry::exp(&rotation);
    Rigid::new(r, Vec3::new(3.0, -2.0, distance) - r * centre)
}

/// Brightness of the print at a point of the sheet, stored as cells of `CELL` mm.
struct Print {
    cells: Vec<bool>,
    columns: usize,
    rows: usize,
    origin: [f64; 2],
}

const CELL: f64 = 0.1;

impl Print {
    fn new(board: &BoardSpec, sheet: &Sheet) -> Print {
        let [x0, y0, _, _] = board.outline();
        let (columns, rows) = ((sheet.width / CELL).ceil() as usize, (sheet.height / CELL).ceil() as usize);
        let mut cells = vec![false; columns * rows];
        let at = |v: f64, n: usize| ((v / CELL).round().max(0.0) as usize).min(n);
        for [x, y, w, h] in &sheet.rectangles {
            for j in at(*y, rows)..at(y + h, rows) {
                cells[j * columns + at(*x, columns)..j * columns + at(x + w, columns)].fill(true);
            }
        }
        for [cx, cy, r] in &sheet.discs {
            for j in at(cy - r - CELL, rows)..at(cy + r + CELL, rows) {
                for i in at(cx - r - CELL, columns)..at(cx + r + CELL, columns) {
                    let (x, y) = ((i as f64 + 0.5) * CELL, (j as f64 + 0.5) * CELL);
                    cells[j * columns + i] |= (x - cx).hypot(y - cy) < *r;
                }
            }
        }
        Print { cells, columns, rows, origin: [x0, y0] }
    }
    fn level(&self, p: &Vec3) -> f64 {
        let (x, y) = (((p.x - self.origin[0]) / CELL).floor(), ((p.y - self.origin[1]) / CELL).floor());
        if !(x >= 0.0 && y >= 0.0 && x < self.columns as f64 && y < self.rows as f64) {
            return 12.0;
        }
        if self.cells[y as usize * self.columns + x as usize] { 20.0 } else { 190.0 }
    }
}

fn picture(board: &BoardSpec, pose: &Rigid<Camera, Board>) -> Image {
    picture_by(&camera(), board, pose)
}

/// Renders the board with 36 rays per pixel.
pub(in crate::calibrate) fn picture_by(k: &Intrinsics, board: &BoardSpec, pose: &Rigid<Camera, Board>) -> Image {
    let print = Print::new(board, &sheet(board).unwrap());
    let back = pose.inverse();
    let eye = back.translation;
    let mut pixels = Vec::new();
    for v in 0..k.height {
        for u in 0..k.width {
            let mut sum = 0.0;
            for s in 0..36 {
                // A rank-1 lattice: 36 different columns and rows, so that axis-parallel edges are not quantised.
                let (dx, dy) = ((f64::from(s) + 0.5) / 36.0, (f64::from(s * 11 % 36) + 0.5) / 36.0);
                let px = Vec2::new(f64::from(u) + dx - 0.5, f64::from(v) + dy - 0.5);
                let n = k.normalised(&px);
                let d = back.rotation * Vec3::new(n.x, n.y, 1.0);
                sum += print.level(&(eye - d * (eye.z / d.z)));
            }
            pixels.push((sum / 36.0).round() as u8);
        }
    }
    Image::from_u8(k.width, k.height, pixels)
}

/// Largest distance of the features from their true pixels, with the best of the board's rotations.
fn worst(board: &BoardSpec, pose: &Rigid<Camera, Board>, view: &BoardView) -> f64 {
    let features = board.features();
    let error = |view: &BoardView| {
        let far = view
            .points
            .iter()
            .map(|p| (camera().pixel_from_point(&pose.point(&features[p.feature_id])).unwrap() - p.pixel).norm());
        far.fold(0.0, f64::max)
    };
    turns(board).iter().map(|t| error(&view.turned(t))).fold(f64::INFINITY, f64::min)
}

fn chessboard(nx: u32, ny: u32) -> BoardSpec {
    BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: 12.0, border_mm: 8.0, first_square: "black".into() }
}

fn charuco() -> BoardSpec {
    BoardSpec::Charuco {
        squares: [9, 6],
        square_mm: 14.0,
        marker_mm: 9.8,
        dictionary: "DICT_5X5_250".into(),
        first_id: 0,
        first_square: None,
        border_mm: 8.0,
    }
}

/// A ChArUco board with a stated colour of the first square (`None`: not stated) and another first id.
fn begins(squares: [u32; 2], colour: Option<&str>, first_id: u32) -> BoardSpec {
    BoardSpec::Charuco {
        squares,
        square_mm: 14.0,
        marker_mm: 9.8,
        dictionary: "DICT_5X5_250".into(),
        first_id,
        first_square: colour.map(String::from),
        border_mm: 8.0,
    }
}

fn circles(nx: u32, ny: u32, asymmetric: bool) -> BoardSpec {
    BoardSpec::Circles {
        dots: [nx, ny],
        pitch_mm: 10.0,
        diameter_mm: Some(8.0),
        asymmetric,
        origin: None,
        border_mm: 10.0,
    }
}

#[test]
fn every_kind_is_found_where_it_is_from_every_side() {
    let boards = [(chessboard(9, 6), 0.03), (chessboard(5, 8), 0.03), (charuco(), 0.03), (circles(4, 9, true), 0.03)];
    for (board, limit) in boards {
        assert_eq!(turns(&board).len(), 1);
        for rotation in [Vec3::new(0.4, -0.2, 0.1), Vec3::new(-0.3, 0.3, 1.6), Vec3::new(0.2, 0.4, 3.0)] {
            let pose = facing(&board, rotation, 230.0);
            let view = find(&picture(&board, &pose), &board, &FindOptions::default()).unwrap();
            let (seen, all) = (view.points.len(), board.features().len());
            assert!(!view.ambiguous && seen * 10 >= all * 9, "{board:?} {rotation:?}: {seen} of {all}");
            let off = worst(&board, &pose, &view);
            assert!(off < limit, "{board:?} {rotation:?}: {off} px");
        }
    }
}

/// Boards as OpenCV drew them before 4.6, with a first id, and as it draws them now. The descriptions do not state
/// the first square.
#[test]
fn the_first_square_is_found_out_from_the_ids() {
    for (squares, printed, first_id) in
        [([8, 6], "white", 0), ([7, 6], "white", 0), ([8, 5], "white", 7), ([8, 6], "black", 0), ([7, 6], "black", 30)]
    {
        let board = begins(squares, Some(printed), first_id);
        let pose = facing(&board, Vec3::new(0.3, -0.2, 0.7), 230.0);
        let image = picture(&board, &pose);
        for told in [Some(printed), None] {
            let view = find(&image, &begins(squares, told, first_id), &FindOptions::default()).unwrap();
            let off = worst(&board, &pose, &view);
            assert!(
                view.begins_white == (printed == "white") && off < 0.03,
                "{squares:?} {printed} {told:?}: {off} px"
            );
            assert!(view.points.len() * 10 >= board.features().len() * 9);
        }
        // Odd columns and even rows: with the other colour the same print reads shifted by a column.
        let other = begins(squares, Some(if printed == "white" { "black" } else { "white" }), first_id);
        let read = find(&image, &other, &FindOptions::default());
        assert_eq!(read.is_ok(), squares == [7, 6], "{squares:?} {printed}: found as {other:?}");
    }
    // Its last column of corners is out of view: nothing distinguishes the two orders.
    let board = begins([7, 6], Some("white"), 0);
    let mut pose = facing(&board, Vec3::zeros(), 120.0);
    pose.translation.x += 30.0;
    let part = picture(&board, &pose);
    assert!(find(&part, &board, &FindOptions::default()).is_ok());
    let fault = find(&part, &begins([7, 6], None, 0), &FindOptions::default()).unwrap_err();
    assert!(fault.what.contains("7x6") && fault.next.contains("first_square"), "{fault}");
    let odd = begins([7, 5], Some("white"), 0);
    let image = picture(&odd, &facing(&odd, Vec3::zeros(), 230.0));
    assert!(find(&image, &odd, &FindOptions::default()).unwrap_err().what.contains("7x5"));
}

/// Markers whose cells are an integer number of the print's cells.
fn markers(count: [u32; 2], dictionary: &str, first_id: u32) -> BoardSpec {
    let bits = calib_targets_aruco::resolve_dictionary(dictionary).unwrap().marker_size();
    let marker_mm = 2.0 * (bits + 2) as f64;
    BoardSpec::MarkerGrid {
        markers: count,
        marker_mm,
        gap_mm: 5.0,
        dictionary: dictionary.into(),
        first_id,
        border_mm: 6.0,
        layout: Default::default(),
        ring_cells: None,
    }
}

#[test]
fn markers_of_every_dictionary_are_read_where_they_are_from_every_side() {
    let mut worst_of_all = 0.0f64;
    for (k, dictionary) in
        ["DICT_4X4_50", "DICT_5X5_100", "DICT_6X6_250", "DICT_7X7_1000", "DICT_APRILTAG_36h11"].iter().enumerate()
    {
        for (count, distance) in [([4, 3], 260.0), ([1, 1], 90.0)] {
            let board = markers(count, dictionary, 7 + k as u32);
            assert_eq!(turns(&board).len(), 1);
            let rotation = [Vec3::new(0.5, -0.3, 0.2), Vec3::new(-0.4, 0.2, 1.7), Vec3::new(0.1, 0.6, -2.9)][k % 3];
            let pose = facing(&board, rotation, distance);
            let image = picture(&board, &pose);
            let view = find(&image, &board, &FindOptions::default()).unwrap_or_else(|e| panic!("{board:?}: {e}"));
            let read: Vec<usize> = view.points.iter().map(|p| p.feature_id).collect();
            assert_eq!(view.points.len(), board.features().len(), "{board:?}: {read:?}");
            let off = worst(&board, &pose, &view);
            worst_of_all = worst_of_all.max(off);
            assert!(off < 0.1, "{board:?}: {off} px");
            // Other ids of the same dictionary are not this board, and neither are the same ids of another
            // dictionary.
            let other = find(&image, &markers(count, dictionary, 30), &FindOptions::default()).unwrap_err();
            assert!(other.cause.contains("other ids"), "{other}");
            let levels = image.to_f32();
            let mirrored = levels.chunks(WIDTH as usize).flat_map(|row| row.iter().rev().map(|v| *v as u8)).collect();
            assert!(find(&Image::from_u8(WIDTH, HEIGHT, mirrored), &board, &FindOptions::default()).is_err());
        }
    }
    println!("corners of markers off by {worst_of_all:.3} px at most");
}

/// Boards whose description has columns and rows swapped, another number of them, another first id or other sizes: the
/// markers that are read tell it.
#[test]
fn another_order_of_markers_is_told() {
    let with = |mut board: BoardSpec, change: &dyn Fn(&mut BoardSpec)| {
        change(&mut board);
        board
    };
    let squares = |to: [u32; 2]| {
        with(charuco(), &|b| {
            if let BoardSpec::Charuco { squares, .. } = b {
                *squares = to;
            }
        })
    };
    let small = with(charuco(), &|b| {
        if let BoardSpec::Charuco { marker_mm, .. } = b {
            *marker_mm = 7.0;
        }
    });
    let grid = markers([6, 5], "DICT_APRILTAG_36h11", 0);
    let wide = with(grid.clone(), &|b| {
        if let BoardSpec::MarkerGrid { gap_mm, .. } = b {
            *gap_mm = 11.0;
        }
    });
    let printed_charuco = picture(&charuco(), &facing(&charuco(), Vec3::new(0.3, -0.2, 0.2), 230.0));
    let printed_grid = picture(&grid, &facing(&grid, Vec3::new(0.3, -0.2, 0.2), 330.0));
    for (image, stated, wanted) in [
        (&printed_charuco, squares([6, 9]), "state \"squares\": [9, 6]"),
        (&printed_charuco, squares([8, 6]), "a board with 9 columns, the described one has 8"),
        (&printed_charuco, squares([10, 6]), "a board with 9 columns, the described one has 10"),
        (&printed_charuco, small, "wrong marker or gap size given"),
        (&printed_grid, markers([5, 6], "DICT_APRILTAG_36h11", 0), "state \"markers\": [6, 5]"),
        (&printed_grid, markers([6, 5], "DICT_APRILTAG_36h11", 3), "rows begin with id 0, 6, 12"),
        (&printed_grid, wide, "gap_mm is about 5."),
    ] {
        let said = match find(image, &stated, &FindOptions::default()) {
            Ok(view) => format!("found with {} points", view.points.len()),
            Err(fault) => fault.to_string(),
        };
        assert!(said.contains(wanted), "{stated:?}: {said}");
        assert!(!said.contains("no markers decoded"), "{said}");
    }
}

/// Every id is read in a clean view: each code changes the shape of the patch that is searched for.
#[test]
fn no_id_of_any_dictionary_is_unreadable() {
    let dictionaries = ["DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000", "DICT_APRILTAG_36h11"];
    let views = [
        (Vec3::new(0.5, -0.3, 0.2), 330.0),
        (Vec3::new(-0.4, 0.2, 1.7), 380.0),
        (Vec3::new(0.1, 0.6, -2.9), 430.0),
        (Vec3::new(-0.2, -0.3, 0.8), 400.0),
    ];
    let mut unread = Vec::new();
    let mut read = 0;
    for (k, dictionary) in dictionaries.iter().enumerate() {
        for (v, (rotation, distance)) in views.iter().enumerate() {
            let board = markers([6, 5], dictionary, 30 * ((k + v) % 7) as u32);
            let image = picture(&board, &facing(&board, *rotation, *distance));
            let view = find(&image, &board, &FindOptions::default()).unwrap_or_else(|e| panic!("{board:?}: {e}"));
            let seen = |id: &usize| view.points.iter().any(|p| p.feature_id == 4 * id);
            unread.extend((0..30).filter(|id| !seen(id)).map(|id| format!("{dictionary} view {v}: {id}th")));
            read += view.points.len() / 4;
        }
    }
    println!("{read} markers read");
    assert!(unread.is_empty(), "{} of {} not read: {unread:?}", unread.len(), unread.len() + read);
}

#[test]
fn markers_that_are_covered_are_left_out() {
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    let board = markers([5, 4], "DICT_APRILTAG_36h11", 0);
    let pose = facing(&board, Vec3::new(0.35, -0.3, 0.15), 290.0);
    let drawn = picture(&board, &pose).to_f32();
    let features = board.features();
    let noise = Normal::new(0.0f32, 3.0).unwrap();
    let mut worst_of_all = 0.0f64;
    for seed in 0..4 {
        let rng = &mut rand_pcg::Pcg64::seed_from_u64(seed);
        let mut levels: Vec<u8> =
            drawn.iter().map(|v| (v + noise.sample(rng)).round().clamp(0.0, 255.0) as u8).collect();
        // A grey card over the middle; it touches six of the twenty markers.
        for y in 210..260 {
            levels[y * WIDTH as usize + 290..y * WIDTH as usize + 340].fill(120);
        }
        let view = find(&Image::from_u8(WIDTH, HEIGHT, levels), &board, &FindOptions::default()).unwrap();
        assert!((52..=64).contains(&view.points.len()), "{}", view.points.len());
        for p in &view.points {
            let truth = camera().pixel_from_point(&pose.point(&features[p.feature_id])).unwrap();
            worst_of_all = worst_of_all.max((truth - p.pixel).norm());
        }
    }
    println!("corners of noisy markers off by {worst_of_all:.3} px at most");
    assert!(worst_of_all < 1.0, "{worst_of_all}");
}

#[test]
fn dots_of_unstated_diameter_are_measured() {
    let with = |diameter_mm: Option<f64>| BoardSpec::Circles {
        dots: [4, 3],
        pitch_mm: 30.0,
        diameter_mm,
        asymmetric: false,
        origin: None,
        border_mm: 9.0,
    };
    for (diameter, rotation) in [(22.0, Vec3::new(0.0, 0.6, 0.1)), (12.0, Vec3::new(-0.5, 0.2, 1.0))] {
        let pose = facing(&with(Some(diameter)), rotation, 190.0);
        let image = picture(&with(Some(diameter)), &pose);
        let view = find(&image, &with(None), &FindOptions::default()).unwrap();
        let measured = view.dot_diameter.unwrap();
        let off = worst(&with(None), &pose, &view);
        println!("{diameter} mm: measured {measured:.3}, centres off by {off:.4} px");
        assert!((measured / diameter - 1.0).abs() < 0.01 && off < 0.03, "{measured} mm, {off} px");
    }
}

#[test]
fn boards_that_look_alike_when_turned_say_so() {
    for board in [chessboard(8, 6), chessboard(7, 7), circles(7, 5, false)] {
        let pose = facing(&board, Vec3::new(0.35, -0.2, 2.9), 230.0);
        let view = find(&picture(&board, &pose), &board, &FindOptions::default()).unwrap();
        assert!(view.ambiguous);
        assert!(worst(&board, &pose, &view) < 0.03);
    }
}

#[test]
fn a_circles_centre_is_not_the_centre_of_its_ellipse() {
    // Large dots close to a tilted camera: without correction, the centres would be off by 0.1 px and more.
    let board = BoardSpec::Circles {
        dots: [4, 3],
        pitch_mm: 30.0,
        diameter_mm: Some(22.0),
        asymmetric: false,
        origin: None,
        border_mm: 9.0,
    };
    let pose = facing(&board, Vec3::new(0.0, 0.6, 0.1), 190.0);
    let view = find(&picture(&board, &pose), &board, &FindOptions::default()).unwrap();
    let off = worst(&board, &pose, &view);
    assert!(off < 0.03, "{off} px");
}

#[test]
fn what_is_not_found_is_explained() {
    let board = chessboard(9, 6);
    let why = |image: &Image, board: &BoardSpec| find(image, board, &FindOptions::default()).unwrap_err().to_string();
    let whole = picture(&board, &facing(&board, Vec3::new(0.3, 0.1, 0.2), 230.0));
    assert!(why(&whole, &chessboard(8, 6)).contains("wrong board size"), "{}", why(&whole, &chessboard(8, 6)));
    let near = picture(&board, &facing(&board, Vec3::new(0.3, 0.1, 0.2), 105.0));
    assert!(why(&near, &board).contains("cut off"), "{}", why(&near, &board));
    let dark = Image::from_u8(WIDTH, HEIGHT, vec![3; (WIDTH * HEIGHT) as usize]);
    assert!(why(&dark, &board).contains("grey levels span"), "{}", why(&dark, &board));
    let empty = Image::from_u8(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(|i| (i % WIDTH / 4) as u8).collect());
    assert!(why(&empty, &board).contains("nor any other lattice"), "{}", why(&empty, &board));
    let white =
        BoardSpec::Chessboard { inner_corners: [9, 7], square_mm: 12.0, border_mm: 8.0, first_square: "white".into() };
    let odd = picture(&chessboard(9, 7), &facing(&chessboard(9, 7), Vec3::new(0.3, 0.1, 0.2), 250.0));
    assert!(why(&odd, &white).contains("first_square"), "{}", why(&odd, &white));
    let unknown = BoardSpec::Charuco {
        squares: [9, 6],
        square_mm: 14.0,
        marker_mm: 10.0,
        dictionary: "DICT_9X9".into(),
        first_id: 0,
        first_square: None,
        border_mm: 0.0,
    };
    assert!(why(&whole, &unknown).contains("DICT_9X9"));
    assert!(why(&whole, &charuco()).contains("ChArUco board were found"));
    assert!(why(&whole, &circles(7, 5, false)).contains("no grid of 7x5 dots"));
}

/// Blurred by three box filters of the given half width: nearly a Gaussian whose sigma is that many px.
fn out_of_focus(image: &Image, half: i64) -> Image {
    let (w, h) = (i64::from(WIDTH), i64::from(HEIGHT));
    let mut levels = image.to_f32();
    for (dx, dy) in [(1, 0), (0, 1)].repeat(3) {
        let old = levels.clone();
        for y in 0..h {
            for x in 0..w {
                let at = |k: i64| old[((y + k * dy).clamp(0, h - 1) * w + (x + k * dx).clamp(0, w - 1)) as usize];
                levels[(y * w + x) as usize] = (-half..=half).map(at).sum::<f32>() / (2 * half + 1) as f32;
            }
        }
    }
    Image::from_u8(WIDTH, HEIGHT, levels.iter().map(|v| v.round() as u8).collect())
}

#[test]
fn a_board_out_of_focus_is_still_found_where_it_is() {
    let board = chessboard(9, 6);
    let pose = facing(&board, Vec3::new(0.3, -0.2, 0.15), 200.0);
    let sharp = picture(&board, &pose);
    for half in [2, 4] {
        let view = find(&out_of_focus(&sharp, half), &board, &FindOptions::default()).unwrap();
        let off = worst(&board, &pose, &view);
        assert!(off < 0.05, "blur {half}: {off} px");
    }
}
