//! In: the dots of a circle grid with an origin mark, as a lattice and in the picture. Out: which dot is which, or
//! the reason why the mark does not show it.
//! Frame and unit: pixels; lattice steps; features as in `BoardSpec::features()`.

use super::super::BoardPoint;
use super::super::refine::Grey;
use super::lattice::{Blob, Lattice, Node, quarter_turned};
use crate::calibrate::homography::{apply, homography};
use crate::fault::{Fault, Result};
use crate::geometry::Vec2;

/// The larger dot's diameter over that of its neighbours in the picture, at least. `recording` refuses boards whose
/// stated diameters differ by less than 1.2.
const LARGER: f64 = 1.15;
/// Smallest share of the dots that a partly hidden grid must show.
const SHOWN: f64 = 0.5;
/// A place counts as black below this share of the way from the dots' level to the white between them.
const BLACK: f64 = 0.5;

/// The dots of a grid whose first dot is larger: feature to blob. Dots may be hidden, but not the first one. `None`
/// if the lattice has no single larger dot.
pub fn by_larger_dot(lattice: &Lattice, blobs: &[Blob], [nx, ny]: [i32; 2]) -> Option<Result<Vec<(usize, usize)>>> {
    let origin = larger(lattice, blobs)?;
    let from = |quarter: usize| {
        lattice.iter().map(move |(n, b)| (quarter_turned((n.0 - origin.0, n.1 - origin.1), quarter), *b))
    };
    // The corner where the larger dot lies has the whole lattice on one side of both axes. A lattice keeps the
    // picture's sense of rotation, so that x and y do not change places.
    let quarter = (0..4).find(|q| from(*q).all(|((x, y), _)| x >= 0 && y >= 0))?;
    let (far_x, far_y) = from(quarter).fold((0, 0), |far, ((x, y), _)| (far.0.max(x), far.1.max(y)));
    let fits = |nx: i32, ny: i32| far_x < nx && far_y < ny;
    if !fits(nx, ny) {
        return Some(Err(if fits(ny, nx) { mirrored([nx, ny]) } else { other_size([nx, ny], [far_x + 1, far_y + 1]) }));
    }
    let (seen, all) = (lattice.len(), (nx * ny) as usize);
    if (seen as f64) < SHOWN * all as f64 || far_x == 0 || far_y == 0 {
        return None;
    }
    if nx != ny && fits(ny, nx) {
        return Some(Err(Fault::refused(format!(
            "{seen} of {all} dots were found, {} columns and {} rows of them: both ways round are possible",
            far_x + 1,
            far_y + 1
        ))
        .cause("so much of the grid is hidden that columns cannot be told from rows")
        .next("keep the whole longer side of the grid in view")));
    }
    let mut dots: Vec<(usize, usize)> = from(quarter).map(|((x, y), b)| ((y * nx + x) as usize, b)).collect();
    dots.sort_unstable();
    Some(Ok(dots))
}

/// The node of the one dot that is larger than its neighbours.
fn larger(lattice: &Lattice, blobs: &[Blob]) -> Option<Node> {
    let diameter = |b: usize| blobs[b].shape.determinant().max(1e-12).powf(-0.25);
    let mut over: Vec<(f64, Node)> = lattice
        .iter()
        .filter_map(|(n, b)| {
            let beside = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (n.0 + i, n.1 + j))).filter(|m| m != n);
            let mut near: Vec<f64> = beside.filter_map(|m| lattice.get(&m)).map(|b| diameter(*b)).collect();
            near.sort_by(f64::total_cmp);
            // Of the neighbours of a corner's neighbour one is the larger dot itself: the median leaves it out.
            near.get(near.len() / 2).map(|usual| (diameter(*b) / usual, *n))
        })
        .collect();
    over.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let (first, next) = (over.first()?, over.get(1)?);
    (first.0 >= LARGER && next.0 < 1.0 + 0.5 * (first.0 - 1.0)).then_some(first.1)
}

/// Removes dots that something covers in part, worst first: those that lie off the place that their neighbours on the
/// board predict. A lens moves neighbours alike.
pub fn drop_covered(points: &mut Vec<BoardPoint>, features: &[Vec2]) {
    // A removed dot changes the prediction of its neighbours only.
    let mut off: Vec<f64> = (0..points.len()).map(|i| off_px(points, features, i)).collect();
    while points.len() > 2 * NEAR {
        let mut sorted = off.clone();
        sorted.sort_by(f64::total_cmp);
        let limit = STANDS_OUT * sorted[sorted.len() / 2].max(LEAST_OFF_PX);
        let Some(worst) = (0..off.len()).filter(|i| off[*i] > limit).max_by(|a, b| off[*a].total_cmp(&off[*b])) else {
            return;
        };
        let gone = features[points[worst].feature_id];
        points.remove(worst);
        off.remove(worst);
        let mut near: Vec<usize> = (0..points.len()).collect();
        near.sort_by(|a, b| {
            let far = |i: &usize| (features[points[*i].feature_id] - gone).norm();
            far(a).total_cmp(&far(b))
        });
        near.into_iter().take(4 * NEAR).for_each(|i| off[i] = off_px(points, features, i));
    }
}

/// Number of neighbours that predict a dot's place.
const NEAR: usize = 6;
/// A dot stands out beyond this multiple of the median distance, which counts as at least `LEAST_OFF_PX` px.
const STANDS_OUT: f64 = 4.0;
const LEAST_OFF_PX: f64 = 0.05;

/// Distance of a dot from the place that its nearest neighbours predict, px.
fn off_px(points: &[BoardPoint], features: &[Vec2], i: usize) -> f64 {
    let at = |p: &BoardPoint| features[p.feature_id];
    let far = |p: &BoardPoint| (at(p) - at(&points[i])).norm_squared();
    let mut others: Vec<&BoardPoint> = points.iter().filter(|p| p.feature_id != points[i].feature_id).collect();
    if others.len() > NEAR {
        others.select_nth_unstable_by(NEAR - 1, |a, b| far(a).total_cmp(&far(b)).then(a.feature_id.cmp(&b.feature_id)));
        others.truncate(NEAR);
    }
    let (from, to): (Vec<Vec2>, Vec<Vec2>) = others.iter().map(|p| (at(p), p.pixel)).unzip();
    homography(&from, &to).map_or(0.0, |h| (apply(&h, &at(&points[i])) - points[i].pixel).norm())
}

/// Of the readings of a grid (blobs in the order of the features), the one whose first dot lies beside the triangle
/// of the frame. `spot`: a place of the triangle, from the first dot, mm.
pub fn by_frame_corner(
    grey: &Grey,
    readings: &[Vec<usize>],
    blobs: &[Blob],
    features: &[Vec2],
    spot: [f64; 2],
) -> Result<Vec<usize>> {
    let far = features[features.len() - 1];
    let spot = Vec2::from(spot);
    // The same place beside the other three corners of the grid.
    let spots = [spot, Vec2::new(far.x - spot.x, spot.y), far - spot, Vec2::new(spot.x, far.y - spot.y)];
    let step = (features[1].x - features[0].x) / 2.0;
    let inward = [Vec2::new(step, step), Vec2::new(-step, step), Vec2::new(-step, -step), Vec2::new(step, -step)];
    let corners = [Vec2::zeros(), Vec2::new(far.x, 0.0), far, Vec2::new(0.0, far.y)];
    let mut seen = Vec::new();
    for reading in readings {
        let pixels: Vec<Vec2> = reading.iter().map(|b| blobs[*b].centre).collect();
        let Some(h) = homography(features, &pixels) else { continue };
        let level = |p: Vec2| grey.at(&apply(&h, &p));
        let black = |k: usize| {
            let (dot, white) = (level(corners[k])?, level(corners[k] + inward[k])?);
            Some((level(spots[k])? - dot) / (white - dot) < BLACK)
        };
        let found: Option<Vec<bool>> = (0..4).map(black).collect();
        match found.as_deref() {
            Some([true, false, false, false]) => return Ok(reading.clone()),
            Some(all) => seen.push(all.iter().filter(|b| **b).count()),
            None => {}
        }
    }
    let what = match seen.first() {
        None => "the corners of the frame are not in the picture".into(),
        Some(1) => "the frame's triangle is not beside the first dot".into(),
        Some(n) => format!("{n} corners of the frame are filled, one is expected"),
    };
    let square = features.iter().filter(|f| f.x == 0.0).count() == features.iter().filter(|f| f.y == 0.0).count();
    let mirror = if square { "" } else { ", a mirrored picture, or columns and rows exchanged" };
    Err(Fault::refused(what)
        .cause(format!("the frame is cut off, covered or badly lit{mirror}"))
        .next("keep the whole frame in view and compare the board with its description"))
}

fn mirrored([nx, ny]: [i32; 2]) -> Fault {
    Fault::refused(format!("the grid has {ny} columns and {nx} rows as seen from its larger dot, not {nx} and {ny}"))
        .cause("a mirrored picture, or columns and rows are exchanged in the description")
        .next("switch the camera's mirroring off, or exchange the two numbers of dots")
}

fn other_size([nx, ny]: [i32; 2], [columns, rows]: [i32; 2]) -> Fault {
    Fault::refused(format!(
        "the grid has at least {columns}x{rows} dots from its larger dot on, {nx}x{ny} are described"
    ))
    .cause("the grid has another size than described, or round spots lie beside it")
    .next("compare the board with its description")
}
