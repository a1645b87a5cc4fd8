//! In: the markers read in a picture, and the description of their board. Out: why the description is another
//! board's, if the markers' places in the picture say so.
//! Frame and unit: pixels; places on the board in pitches (squares of a ChArUco board, marker and gap of a grid).

use super::other_size::WRONG_SIZE;
use crate::calibrate::homography::{apply, homography};
use crate::fault::Fault;
use crate::geometry::Vec2;
use crate::recording::{BoardSpec, Markers};

/// Fewest markers that may contradict a description: a homography of six centres leaves four equations over.
const FEWEST: usize = 6;
/// Markers lie as described if their centres are this close to their places, rms, in pitches. A lens bends by less,
/// and a wrong row or column moves by one.
const FITS: f64 = 0.1;
/// Another description is named only if the stated one is this many times worse: a strongly bending lens makes both
/// bad.
const WORSE: f64 = 4.0;
/// Among descriptions that fit about equally well (by this factor) the one closest to the stated one counts.
const ALIKE: f64 = 1.3;
/// Largest number of columns that is tried.
const MOST_COLUMNS: usize = 40;
/// A marker's side contradicts the description from this share of the stated side on, and from this many pixels on:
/// print and exposure move edges.
const SIDE: f64 = 0.1;
const SIDE_PX: f64 = 2.0;

/// A marker read in a picture, whether or not its board has it.
#[derive(Clone, Copy, Debug)]
pub struct Marker {
    pub id: usize,
    /// Clockwise.
    pub corners: [Vec2; 4],
}

impl Marker {
    fn centre(&self) -> Vec2 {
        self.corners.iter().sum::<Vec2>() / 4.0
    }
}

/// How ids follow each other over a board.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Order {
    columns: usize,
    first_id: usize,
    /// For a ChArUco board: whether it begins with a white square. `None`: every place has a marker.
    white: Option<bool>,
}

impl Order {
    fn of(board: &BoardSpec) -> Option<(Order, usize)> {
        let ([columns, rows], first_id, white) = match board {
            BoardSpec::Charuco { squares, first_id, .. } => (squares, first_id, Some(board.begins_white())),
            BoardSpec::MarkerGrid { markers, first_id, .. } => (markers, first_id, None),
            _ => return None,
        };
        Some((Order { columns: *columns as usize, first_id: *first_id as usize, white }, *rows as usize))
    }

    /// Place of a marker: column and row.
    fn place(&self, id: usize) -> Vec2 {
        let (k, n) = (id as i64 - self.first_id as i64, self.columns as i64);
        let (row, at) = (k.div_euclid(n), k.rem_euclid(n));
        let [i, j] = match self.white {
            None => [at, row],
            // Two rows of squares hold as many markers as there are columns.
            Some(white) => {
                let upper = if white { (n + 1) / 2 } else { n / 2 };
                let odd = |is: bool| i64::from(is);
                if at < upper { [2 * at + odd(!white), 2 * row] } else { [2 * (at - upper) + odd(white), 2 * row + 1] }
            }
        };
        Vec2::new(i as f64, j as f64)
    }

    /// The markers on the board by their pixels, and their rms distance from their places, both in pitches.
    fn laid(&self, seen: &[Marker]) -> Option<(nalgebra::Matrix3<f64>, f64)> {
        let places: Vec<Vec2> = seen.iter().map(|m| self.place(m.id)).collect();
        // With fewer than two places beside a row or a column, a homography fits to anything.
        let beside = |axis: usize| {
            let others = |p: &Vec2| places.iter().filter(|q| q[axis] != p[axis]).count();
            places.iter().map(others).min().unwrap_or(0)
        };
        if beside(0).min(beside(1)) < 2 {
            return None;
        }
        let pixels: Vec<Vec2> = seen.iter().map(Marker::centre).collect();
        let h = homography(&pixels, &places)?;
        let off = pixels.iter().zip(&places).map(|(c, p)| (apply(&h, c) - p).norm_squared()).sum::<f64>();
        let rms = (off / seen.len() as f64).sqrt();
        rms.is_finite().then_some((h, rms))
    }

    fn off(&self, seen: &[Marker]) -> f64 {
        self.laid(seen).map_or(f64::INFINITY, |(_, off)| off)
    }

    /// Other orders, the closest to this one first.
    fn others(self, rows: usize) -> Vec<Order> {
        let near = [self.columns, rows].into_iter().filter(|n| *n > 1);
        let columns: Vec<usize> = near.chain(2..=MOST_COLUMNS).collect();
        let with = |white: Option<bool>, columns: usize| Order { columns, white, ..self };
        let mut all: Vec<Order> = columns.iter().map(|&n| with(self.white, n)).collect();
        match self.white {
            Some(white) => all.extend(columns.iter().map(|&n| with(Some(!white), n))),
            None => all.extend(
                columns
                    .iter()
                    .flat_map(|&columns| (0..columns).map(move |first_id| Order { columns, first_id, ..self })),
            ),
        }
        all
    }
}

/// Why the markers that were read belong to another board than the described one; `None` if they do not say so.
pub fn contradicts(board: &BoardSpec, markers: &Markers, seen: &[Marker]) -> Option<Fault> {
    let (stated, rows) = Order::of(board)?;
    // A picture that is searched in several ways shows a marker more than once.
    let mut seen = seen.to_vec();
    seen.sort_by_key(|m| m.id);
    seen.dedup_by_key(|m| m.id);
    let seen = &seen[..];
    let on_board: Vec<Marker> =
        seen.iter().filter(|m| markers.places().any(|(_, _, id)| id == m.id)).copied().collect();
    let first_open = matches!(board, BoardSpec::Charuco { first_square: None, .. });
    let mut ways = vec![stated];
    ways.extend(first_open.then(|| Order { white: stated.white.map(|white| !white), ..stated }));
    if seen.len() < FEWEST {
        return None;
    }
    let off = if on_board.len() < FEWEST { f64::INFINITY } else { fits_best(&ways, &on_board).1 };
    if off < FITS {
        let way = fits_best(&ways, &on_board).0;
        return side(board, &way, &on_board);
    }
    let others = stated.others(rows);
    let (_, least) = fits_best(&others, seen);
    if least > FITS || off < WORSE * least {
        return None;
    }
    let meant = others.iter().find(|o| o.off(seen) <= ALIKE * least)?;
    // The described order with other ids, whole rows away, does not show which ids the board has.
    let same = (meant.columns, meant.white, meant.first_id % meant.columns)
        == (stated.columns, stated.white, stated.first_id % stated.columns);
    if same {
        return None;
    }
    Some(order_fault(board, [stated.columns, rows], &stated, meant, seen))
}

fn fits_best(ways: &[Order], seen: &[Marker]) -> (Order, f64) {
    let off = ways.iter().map(|way| (*way, way.off(seen)));
    off.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((ways[0], f64::INFINITY))
}

fn order_fault(board: &BoardSpec, [c, r]: [usize; 2], stated: &Order, meant: &Order, seen: &[Marker]) -> Fault {
    let (dictionary, field) = match board {
        BoardSpec::Charuco { dictionary, .. } => (dictionary.as_str(), "squares"),
        BoardSpec::MarkerGrid { dictionary, .. } => (dictionary.as_str(), "markers"),
        _ => ("", ""),
    };
    let (low, high) = seen.iter().fold((usize::MAX, 0), |(low, high), m| (low.min(m.id), high.max(m.id)));
    let n = meant.columns;
    let read = format!("{} markers of {dictionary} were read, ids {low} to {high}", seen.len());
    if n != c {
        let next = if n == r {
            format!("columns and rows are swapped: state \"{field}\": [{r}, {c}]")
        } else {
            format!("count the printed board's columns and rows, and state \"{field}\": [{n}, ROWS]")
        };
        return Fault::refused(format!("{read}: they lie as on a board with {n} columns, the described one has {c}"))
            .cause(WRONG_SIZE)
            .next(next);
    }
    if meant.white != stated.white {
        let colour = if meant.white == Some(true) { "white" } else { "black" };
        return Fault::refused(format!("{read}: they lie as on a board that begins with a {colour} square"))
            .cause("the description names the other colour")
            .next(format!("state \"first_square\": \"{colour}\""));
    }
    let first = meant.first_id % n;
    Fault::refused(format!(
        "{read}: rows begin with id {first}, {}, {} and so on; with the described first_id {} they would begin with {}",
        first + n,
        first + 2 * n,
        stated.first_id,
        stated.first_id % n
    ))
    .cause("other ids than described: the printed board begins with another first_id")
    .next(format!("state the id of the printed board's first marker: {first}, or {first} and a multiple of {n}"))
}

/// Why the markers are of another size than described, as a share of their pitch.
fn side(board: &BoardSpec, order: &Order, seen: &[Marker]) -> Option<Fault> {
    let (pitch, side) = match board {
        BoardSpec::Charuco { square_mm, marker_mm, .. } => (*square_mm, *marker_mm),
        BoardSpec::MarkerGrid { marker_mm, gap_mm, .. } => (marker_mm + gap_mm, *marker_mm),
        _ => return None,
    };
    let (share, pitch_px) = measured_side(order, seen)?;
    let (stated, off) = (side / pitch, (share - side / pitch).abs());
    if off < SIDE * stated || off * pitch_px < SIDE_PX {
        return None;
    }
    let (what, next) = match board {
        BoardSpec::Charuco { .. } => (
            format!("the markers are {share:.2} of a square wide, {stated:.2} ({side} of {pitch} mm) are described"),
            format!("measure both; if square_mm is right, marker_mm is about {:.1}", share * pitch),
        ),
        _ => (
            format!(
                "the gaps are {:.2} of a marker wide, {:.2} ({:.2} of {side} mm) are described",
                1.0 / share - 1.0,
                1.0 / stated - 1.0,
                pitch - side
            ),
            format!("measure both; if marker_mm is right, gap_mm is about {:.1}", side / share - side),
        ),
    };
    Some(Fault::refused(what).cause("wrong marker or gap size given").next(next))
}

/// Median side of the markers as a share of the pitch, and the pitch in pixels. Side and pitch are compared from
/// marker to marker: there a lens bends both alike.
fn measured_side(order: &Order, seen: &[Marker]) -> Option<(f64, f64)> {
    let (h, _) = order.laid(seen)?;
    let sides = |m: &Marker, at: &dyn Fn(&Vec2) -> Vec2| {
        (0..4).map(|k| (at(&m.corners[k]) - at(&m.corners[(k + 1) % 4])).norm()).sum::<f64>() / 4.0
    };
    let (mut shares, mut pitches) = (Vec::new(), Vec::new());
    for (i, a) in seen.iter().enumerate() {
        for b in &seen[i + 1..] {
            let apart = (order.place(a.id) - order.place(b.id)).norm();
            // The next marker in the row, or diagonally.
            if !(0.5..1.5).contains(&apart) {
                continue;
            }
            let on_board = |p: &Vec2| apply(&h, p);
            let pitch = (on_board(&a.centre()) - on_board(&b.centre())).norm() / apart;
            shares.push(0.5 * (sides(a, &on_board) + sides(b, &on_board)) / pitch);
            pitches.push((a.centre() - b.centre()).norm() / apart);
        }
    }
    Some((median(shares)?, median(pitches)?))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::MarkerLayout;

    fn charuco(squares: [u32; 2], marker_mm: f64) -> BoardSpec {
        let (dictionary, first_square) = ("DICT_5X5_250".into(), None);
        let (square_mm, border_mm, first_id) = (14.0, 0.0, 0);
        BoardSpec::Charuco { squares, square_mm, marker_mm, dictionary, first_id, first_square, border_mm }
    }

    fn grid(markers: [u32; 2], first_id: u32, gap_mm: f64) -> BoardSpec {
        let (dictionary, layout, ring_cells) = ("DICT_APRILTAG_36h11".into(), MarkerLayout::Kalibr, None);
        let (marker_mm, border_mm) = (16.0, 0.0);
        BoardSpec::MarkerGrid { markers, marker_mm, gap_mm, dictionary, first_id, border_mm, layout, ring_cells }
    }

    /// The board's markers in an oblique view, bent by a lens by up to `bend` of the distance from the middle.
    fn seen(board: &BoardSpec, bend: f64) -> Vec<Marker> {
        let markers = Markers::of(board).unwrap().unwrap();
        let side = markers.cell_mm() * markers.cells() as f64;
        let pixel = |x: f64, y: f64| {
            let d =
                Vec2::new(4.0 * x + 0.4 * y, 3.7 * y - 0.3 * x) / (1.0 + 1e-3 * x + 5e-4 * y) - Vec2::new(200.0, 160.0);
            d * (1.0 - bend * d.norm_squared() / 300f64.powi(2)) + Vec2::new(320.0, 240.0)
        };
        let one = |(i, j, id)| {
            let [x, y] = markers.corner(i, j);
            let at = [[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
            Marker { id, corners: at.map(|[x, y]| pixel(x, y)) }
        };
        markers.places().map(one).collect()
    }

    fn says(stated: &BoardSpec, printed: &BoardSpec) -> Option<String> {
        let markers = Markers::of(stated).unwrap().unwrap();
        contradicts(stated, &markers, &seen(printed, 0.05)).map(|f| format!("{}; {}; {}", f.what, f.cause, f.next))
    }

    #[test]
    fn another_order_of_the_markers_is_named() {
        let right = charuco([9, 7], 9.8);
        for (stated, wanted) in [
            (charuco([7, 9], 9.8), "state \"squares\": [9, 7]"),
            (charuco([8, 7], 9.8), "9 columns, the described one has 8; wrong board size given"),
            (charuco([10, 7], 9.8), "\"squares\": [9, ROWS]"),
            (charuco([9, 7], 8.0), "marker_mm is about 9.8"),
        ] {
            let said = says(&stated, &right).unwrap_or_default();
            assert!(said.contains(wanted), "{said}");
        }
        let right = grid([6, 5], 0, 4.8);
        for (stated, wanted) in [
            (grid([5, 6], 0, 4.8), "state \"markers\": [6, 5]"),
            (grid([6, 5], 3, 4.8), "rows begin with id 0, 6, 12 and so on; with the described first_id 3"),
            (grid([6, 5], 0, 8.0), "gap_mm is about 4.8"),
        ] {
            let said = says(&stated, &right).unwrap_or_default();
            assert!(said.contains(wanted), "{said}");
        }
    }

    #[test]
    fn right_descriptions_are_not_accused() {
        for bend in [-0.3, 0.0, 0.1, 0.3] {
            for board in [charuco([9, 7], 9.8), charuco([8, 6], 9.8), grid([6, 5], 0, 4.8), grid([5, 6], 7, 4.8)] {
                let (markers, all) = (Markers::of(&board).unwrap().unwrap(), seen(&board, bend));
                for some in [&all[..], &all[all.len() / 2..], &all[..8]] {
                    let said = contradicts(&board, &markers, some);
                    assert!(said.is_none(), "{board:?}, bend {bend}: {said:?}");
                }
            }
        }
        // A board that begins with white, with the description leaving that open.
        let mut white = charuco([9, 6], 9.8);
        if let BoardSpec::Charuco { first_square, .. } = &mut white {
            *first_square = Some("white".into());
        }
        assert_eq!(says(&charuco([9, 6], 9.8), &white), None);
        // More rows than described are no contradiction of the order.
        assert_eq!(says(&charuco([9, 6], 9.8), &charuco([9, 7], 9.8)), None);
    }
}
