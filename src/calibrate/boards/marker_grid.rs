//! In: a picture and the description of ArUco or AprilTag markers, one or a grid of them. Out: the corners of the
//! visible markers with their ids, or the reason why no marker was found.
//! Frame and unit: pixels; four ids per marker, clockwise from its upper left corner, markers row by row.

use super::described::{Marker, contradicts};
use super::mask::{DARK, mask};
use super::quads::{QuadCorner, quads, refined};
use super::refine::{Grey, Window, corner};
use super::{BoardPoint, BoardView, FindOptions};
use crate::calibrate::homography::{apply, homography};
use crate::fault::{Fault, Result};
use crate::geometry::{Mat3, Vec2};
use crate::raster::Image;
use crate::recording::{BoardSpec, Markers};
use calib_targets_aruco::Matcher;

/// Smallest share of the cells in a marker's black ring that must be read as black.
const RING: f64 = 0.9;

/// Shares of the surroundings' mean for the search of markers whose corners touch black squares. Where blur joins
/// them, only the lower shares part them; where light is poor, only the higher ones find them.
const TOUCHING: [f64; 3] = [DARK, 0.6, 0.45];
/// A fit of both squares at a corner is taken up to this distance from the crossing of the marker's edges, px.
const BESIDE_PX: f64 = 0.5;

/// A decoded marker: its index in the board's order, and its corners, starting with its own upper left.
struct Seen {
    place: usize,
    corners: [QuadCorner; 4],
}

/// A marker of the board's dictionary, whether or not the board has it.
struct Read {
    id: usize,
    corners: [QuadCorner; 4],
}

impl Read {
    fn marker(&self) -> Marker {
        Marker { id: self.id, corners: self.corners.map(|c| c.pixel) }
    }
}

struct Looked {
    seen: Vec<Read>,
    /// Number of dark quadrilaterals.
    patches: usize,
}

/// The markers of the dictionary in a picture; one may be there twice.
pub fn readable(grey: &Grey, board: &BoardSpec, markers: &Markers, options: &FindOptions) -> Vec<Marker> {
    read_all(grey, board, markers, options).seen.iter().map(Read::marker).collect()
}

/// The markers of the dictionary; several shares and sizes may read one twice.
fn read_all(grey: &Grey, board: &BoardSpec, markers: &Markers, options: &FindOptions) -> Looked {
    let matcher = Matcher::new(markers.dictionary(), markers.dictionary().max_correction_bits().min(2));
    let has = |id: usize| markers.places().any(|(_, _, k)| k == id);
    let first = (grey.width.max(grey.height) / options.detector_px).max(1);
    let mut looked = Looked { seen: Vec::new(), patches: 0 };
    for shrink in if first > 1 { vec![first, 1] } else { vec![1] } {
        let small = grey.shrunk(shrink);
        let shares = if board.corner_squares_mm().is_some() { &TOUCHING[..] } else { &TOUCHING[..1] };
        let masks = shares.iter().map(|share| mask(&small, true, *share));
        let found: Vec<[Vec2; 4]> = masks.flat_map(|m| quads(&m, small.width, small.height)).collect();
        looked.patches += found.len();
        let full = |p: &Vec2| p.map(|c| (c + 0.5) * shrink as f64 - 0.5);
        for quad in found {
            let quad = quad.each_ref().map(full);
            looked.seen.extend(read(grey, &quad, markers, &matcher));
        }
        if looked.seen.iter().any(|r| has(r.id)) {
            break;
        }
    }
    looked
}

/// Finds the markers of a board; any number of them may be in view.
pub fn find(image: &Image, board: &BoardSpec, options: &FindOptions) -> Result<BoardView> {
    let markers = Markers::of(board)?
        .ok_or_else(|| Fault::usage("the board has no markers").next("describe it as type marker_grid"))?;
    let grey = Grey::new(image);
    let Looked { seen: all, patches } = read_all(&grey, board, &markers, options);
    let as_read: Vec<Marker> = all.iter().map(Read::marker).collect();
    if let Some(fault) = contradicts(board, &markers, &as_read) {
        return Err(fault);
    }
    let placed = |r: Read| {
        let place = markers.places().position(|(_, _, id)| id == r.id)?;
        Some(Seen { place, corners: r.corners })
    };
    let mut seen: Vec<Seen> = all.into_iter().filter_map(placed).collect();
    let features = board.features();
    keep_agreeing(&mut seen, &features.iter().map(|f| f.xy()).collect::<Vec<_>>());
    if let Some(side) = board.corner_squares_mm() {
        let clear = (side / board.length_mm()).min(markers.ring() as f64 / markers.cells() as f64);
        seen.iter_mut().for_each(|s| touch(&grey, &mut s.corners, clear));
    }
    if seen.is_empty() {
        return Err(why_not(&markers, patches));
    }
    let mut points: Vec<BoardPoint> = seen
        .iter()
        .flat_map(|s| {
            s.corners.iter().enumerate().map(|(k, c)| BoardPoint {
                feature_id: 4 * s.place + k,
                pixel: c.pixel,
                sigma_px: c.sigma_px,
            })
        })
        .collect();
    points.sort_by_key(|p| p.feature_id);
    Ok(BoardView { points, ..BoardView::default() })
}

/// Decodes the marker in a quadrilateral; `None` if it is not one of the dictionary's.
fn read(grey: &Grey, quad: &[Vec2; 4], markers: &Markers, matcher: &Matcher) -> Option<Read> {
    let cells = markers.cells();
    let n = cells as f64;
    let ring = markers.ring();
    // The white margin is at least as wide as the black ring; the start is accurate to a pixel.
    let corners = refined(grey, quad, 0.55 * ring as f64 / n)?;
    let square = [[0.0, 0.0], [n, 0.0], [n, n], [0.0, n]].map(Vec2::from);
    let h = homography(&square, &corners.map(|c| c.pixel))?;
    let levels = cell_levels(grey, &h, cells)?;
    let low = levels.iter().copied().fold(f64::INFINITY, f64::min);
    let high = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let black = |k: usize| levels[k] < 0.5 * (low + high);
    let inside = |at: usize| (ring..cells - ring).contains(&at);
    let ring = |k: usize| !inside(k % cells) || !inside(k / cells);
    let of_ring = (0..levels.len()).filter(|k| ring(*k));
    let dark = of_ring.clone().filter(|k| black(*k)).count() as f64;
    if dark < RING * of_ring.count() as f64 {
        return None;
    }
    let bits = (0..levels.len()).filter(|k| !ring(*k));
    let code = bits.enumerate().fold(0u64, |code, (bit, k)| code | u64::from(black(k)) << bit);
    let found = matcher.match_code(code)?;
    // The marker appears rotated clockwise by `rotation` quarter turns; its upper left corner is shifted by as many
    // indices.
    let turn = found.rotation as usize + markers.turn();
    Some(Read { id: found.id as usize, corners: std::array::from_fn(|k| corners[(k + turn) % 4]) })
}

/// Replaces a marker's corners by fits of the crossing edges, where a black square touches the corner. Printing and
/// exposure that make black wider move the marker's edges, but not the crossing. `clear`: length of the edges without
/// other structures, as a share of the marker's side.
fn touch(grey: &Grey, corners: &mut [QuadCorner; 4], clear: f64) {
    let from = corners.map(|c| c.pixel);
    for k in 0..4 {
        let (u, v) = ((from[(k + 1) % 4] - from[k]) * 2.0 * clear, (from[(k + 3) % 4] - from[k]) * 2.0 * clear);
        let window = Window { reach: 0.42, longest_px: 15.0, margin: 1.0 };
        let Some(c) = corner(grey, &from[k], &u, &v, &window) else { continue };
        // The quadrant between the edges is the marker's own, so it is dark.
        if c.contrast < 0.0 && (c.pixel - from[k]).norm() < BESIDE_PX {
            corners[k] = QuadCorner { pixel: c.pixel, sigma_px: c.sigma_px };
        }
    }
}

/// Mean intensity in the middle of each cell.
fn cell_levels(grey: &Grey, h: &Mat3, cells: usize) -> Option<Vec<f64>> {
    let spots = [-0.2, 0.0, 0.2];
    (0..cells * cells)
        .map(|k| {
            let (x, y) = ((k % cells) as f64 + 0.5, (k / cells) as f64 + 0.5);
            let at = spots.iter().flat_map(|dy| spots.iter().map(move |dx| Vec2::new(x + dx, y + dy)));
            let light = at.map(|p| grey.at(&apply(h, &p))).collect::<Option<Vec<f64>>>()?;
            Some(light.iter().sum::<f64>() / light.len() as f64)
        })
        .collect()
}

/// Removes duplicates of markers, keeping the more accurate one, and markers that contradict their neighbours.
fn keep_agreeing(seen: &mut Vec<Seen>, features: &[Vec2]) {
    seen.sort_by(|a, b| {
        let sigma = |s: &Seen| s.corners.iter().map(|c| c.sigma_px).sum::<f64>();
        a.place.cmp(&b.place).then(sigma(a).total_cmp(&sigma(b)))
    });
    seen.dedup_by_key(|s| s.place);
    if seen.len() < 2 {
        return;
    }
    let off = |i: usize| -> f64 {
        let s = &seen[i];
        off_px(seen, features, i)[3] / (s.corners[0].pixel - s.corners[2].pixel).norm()
    };
    let good: Vec<bool> = (0..seen.len()).map(|i| off(i) < 0.4).collect();
    // A wrong neighbour also makes good markers disagree, so one marker's disagreement is not enough. If at most half
    // of the markers agree, all are rejected. Some markers are their own mirror image (DICT_4X4_50: 8, 9, 17) and are
    // decoded in a mirrored picture, each in a wrong orientation.
    if good.iter().filter(|g| **g).count() * 2 <= seen.len() {
        seen.clear();
        return;
    }
    let mut good = good.iter();
    seen.retain(|_| *good.next().expect("one each"));
    drop_covered(seen, features);
}

/// Distances of a marker's corners from the positions predicted by the three nearest markers on the board, px,
/// ascending. Over such a short distance a lens bends less.
fn off_px(seen: &[Seen], features: &[Vec2], i: usize) -> [f64; 4] {
    let middle = |s: &Seen| features[4 * s.place] + features[4 * s.place + 2];
    let mut others: Vec<usize> = (0..seen.len()).filter(|k| *k != i).collect();
    let far = |k: &usize| (middle(&seen[*k]) - middle(&seen[i])).norm();
    others.sort_by(|a, b| far(a).total_cmp(&far(b)));
    others.truncate(3);
    let (mut from, mut to) = (Vec::new(), Vec::new());
    for s in others.iter().map(|k| &seen[*k]) {
        from.extend((0..4).map(|k| features[4 * s.place + k]));
        to.extend(s.corners.iter().map(|c| c.pixel));
    }
    let Some(h) = homography(&from, &to) else { return [0.0; 4] };
    let s = &seen[i];
    let mut off: [f64; 4] =
        std::array::from_fn(|k| (apply(&h, &features[4 * s.place + k]) - s.corners[k].pixel).norm());
    off.sort_by(f64::total_cmp);
    off
}

/// Removes, worst first, covered markers: those with a corner that stands out both against the neighbours' prediction
/// and against the marker's other corners. A lens, or a wrong neighbour, would shift all four corners.
fn drop_covered(seen: &mut Vec<Seen>, features: &[Vec2]) {
    while seen.len() > 4 {
        let off: Vec<[f64; 4]> = (0..seen.len()).map(|i| off_px(seen, features, i)).collect();
        let mut worst: Vec<f64> = off.iter().map(|o| o[3]).collect();
        worst.sort_by(f64::total_cmp);
        let usual = worst[worst.len() / 2].max(LEAST_OFF_PX);
        let covered = |i: &usize| off[*i][3] > STANDS_OUT * usual && off[*i][3] > AGAINST_OWN * off[*i][1];
        match (0..off.len()).filter(covered).max_by(|a, b| off[*a][3].total_cmp(&off[*b][3])) {
            Some(i) => seen.remove(i),
            None => return,
        };
    }
}

/// A corner stands out beyond this multiple of the median marker's distance from its neighbours' prediction, which
/// counts as at least `LEAST_OFF_PX` px. It must also exceed `AGAINST_OWN` times the marker's own second smallest
/// distance: two of the four corners may be covered.
const STANDS_OUT: f64 = 4.0;
const LEAST_OFF_PX: f64 = 0.25;
const AGAINST_OWN: f64 = 6.0;

fn why_not(markers: &Markers, patches: usize) -> Fault {
    let count = markers.places().count();
    Fault::refused(format!(
        "none of the board's {count} markers was found; {patches} dark quadrilaterals are in the picture"
    ))
    .cause(if patches == 0 {
        "out of view, out of focus, smaller than 10 px, or without a white margin of a cell round each marker"
    } else {
        "another dictionary or other ids than described, too small or out of focus to be read, or a mirrored picture"
    })
    .next("look at the picture and compare the printed markers with their description")
}
