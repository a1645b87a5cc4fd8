//! In: a picture and a circle grid. Out: the images of the dots' centres with their ids, corrected for the offset
//! between an ellipse's centre and the image of the circle's centre; or the reason for a failure.
//! Frame and unit: pixels; ids row by row as in `BoardSpec::features()`.

use super::super::refine::Grey;
use super::super::{BoardPoint, BoardView, FindOptions};
use super::blobs::blobs;
use super::ellipse::{Dot, dot};
use super::finder_patterns::by_finder_patterns;
use super::lattice::{Blob, Lattice, Node, grow, labelled, seeds};
use super::origin_mark::{by_frame_corner, by_larger_dot, drop_covered};
use crate::calibrate::homography::{apply, homography};
use crate::fault::{Fault, Result};
use crate::geometry::{Mat3, Vec2, Vec3};
use crate::raster::Image;
use crate::recording::{BoardSpec, OriginMark};

/// Finds a grid with dark dots on bright ground or bright ones on dark. It is completely in view, unless a larger first
/// dot or finder patterns show which dots are seen.
pub fn find(image: &Image, board: &BoardSpec, _options: &FindOptions) -> Result<BoardView> {
    let BoardSpec::Circles { dots: [nx, ny], asymmetric, diameter_mm, origin, .. } = board else {
        return Err(Fault::usage("the board is not a circle grid").next("describe it as type circles"));
    };
    let grey = Grey::new(image);
    let features: Vec<Vec2> = board.features().iter().map(|f| f.xy()).collect();
    let nodes: Vec<Node> = (0..*ny as i32)
        .flat_map(|j| (0..*nx as i32).map(move |i| (i, j)))
        .map(|(i, j)| {
            let (x, y) = if *asymmetric { (2 * i + j % 2, j) } else { (i, j) };
            // Asymmetric dots form a square lattice that is rotated by 45 degrees.
            if *asymmetric { ((x + y).div_euclid(2), (y - x).div_euclid(2)) } else { (x, y) }
        })
        .collect();
    // Of an asymmetric lattice only the points with even x + y exist, so both sums are even.
    let (mut most, mut refused) = (0, None);
    let size = [*nx as i32, *ny as i32];
    let larger = matches!(origin, Some(OriginMark::LargerDot { .. }));
    let may_hide = larger || matches!(origin, Some(OriginMark::FinderPatterns { .. }));
    for dark in [true, false] {
        let blobs = blobs(&grey, dark, matches!(origin, Some(OriginMark::FinderPatterns { .. })));
        most = most.max(blobs.len());
        let in_order = |blobs: &[usize]| blobs.iter().copied().enumerate().collect::<Vec<_>>();
        let read = match origin {
            None => labelled(&blobs, &nodes).map(|all| Ok((in_order(&all[0]), all.len() > 1))),
            Some(OriginMark::LargerDot { .. }) => partly(&blobs, size, |l| by_larger_dot(l, &blobs, size)),
            Some(OriginMark::FinderPatterns { at }) => {
                partly(&blobs, size, |l| by_finder_patterns(l, &blobs, size, at).map(Ok))
            }
            Some(mark) => labelled(&blobs, &nodes).map(|all| {
                let spot = mark.corner_spot().expect("a frame has corners");
                by_frame_corner(&grey, &all, &blobs, &features, spot).map(|one| (in_order(&one), false))
            }),
        };
        let (chosen, ambiguous) = match read {
            None => continue,
            Some(Err(fault)) => {
                refused.get_or_insert(fault);
                continue;
            }
            Some(Ok(read)) => read,
        };
        let fitted = |(id, b): &(usize, usize)| {
            let reach = if larger && *id == 0 { LARGER_REACH } else { REACH };
            Some((*id, dot(&grey, &blobs[*b].centre, &blobs[*b].shape, reach)?))
        };
        let dots: Vec<(usize, Dot)> = chosen.iter().filter_map(fitted).collect();
        // Only where dots may be hidden may one be left out.
        if dots.len() < chosen.len() && (!may_hide || dots.len() < 4) {
            continue;
        }
        let (mut points, radius) = centred(&dots, &features, diameter_mm.map(|d| d / 2.0), larger)?;
        if points.len() < features.len() {
            drop_covered(&mut points, &features);
        }
        let dot_diameter = diameter_mm.is_none().then_some(2.0 * radius);
        return Ok(BoardView { points, ambiguous, dot_diameter, ..BoardView::default() });
    }
    if let Some(fault) = refused {
        return Err(fault);
    }
    let marked = match origin {
        Some(OriginMark::LargerDot { .. }) => " with a larger first one",
        Some(OriginMark::FinderPatterns { .. }) => " with finder patterns",
        _ => "",
    };
    Err(Fault::refused(format!("no grid of {nx}x{ny} dots{marked} was found; {most} round spots are in the picture"))
        .cause(match (origin, most < features.len()) {
            (Some(OriginMark::FinderPatterns { .. }), _) => {
                "no finder pattern is wholly in view and sharp, another plate than described, or a mirrored picture"
            }
            (_, true) => "dots are cut off, covered, out of focus, smaller than 5 px, or badly lit",
            (_, false) => "the grid has another size or kind than described",
        })
        .next("keep all dots in view and compare the board with its description"))
}

/// Radius of the pixels of a dot's fit over that of the dot. The larger dot's neighbours are closer to it.
const REACH: f64 = 1.5;
const LARGER_REACH: f64 = 1.25;

/// Features and their blobs.
type Chosen = Vec<(usize, usize)>;

/// The dots that are in view of a grid whose mark shows which ones they are. Never ambiguous.
fn partly(
    blobs: &[Blob],
    [nx, ny]: [i32; 2],
    read: impl Fn(&Lattice) -> Option<Result<Chosen>>,
) -> Option<Result<(Chosen, bool)>> {
    // The reading with the most dots, then the first seed: of a hidden grid, not every seed reaches all of it.
    let (mut best, mut refused): (Chosen, _) = (Vec::new(), None);
    for seed in seeds(blobs) {
        match read(&grow(blobs, seed, 2 * (nx * ny) as usize)) {
            Some(Ok(read)) if read.len() > best.len() => best = read,
            Some(Err(fault)) => {
                refused.get_or_insert(fault);
            }
            _ => {}
        }
        // No other seed finds much more. A few dots may be part of finder patterns.
        if 10 * best.len() >= 9 * blobs.len().min((nx * ny) as usize) {
            break;
        }
    }
    if best.is_empty() { refused.map(Err) } else { Some(Ok((best, false))) }
}

/// The image of a circle's centre is not the centre of the circle's image. With the board's homography H the circle's
/// conic C becomes H⁻ᵀCH⁻¹, whose centre gives the difference (docs/math.md, Corners (5)). A radius that is not
/// stated is measured, and so is always that of a larger first dot. Second: the radius of the other dots.
fn centred(
    dots: &[(usize, Dot)],
    features: &[Vec2],
    stated: Option<f64>,
    larger: bool,
) -> Result<(Vec<BoardPoint>, f64)> {
    let plane: Vec<Vec2> = dots.iter().map(|(id, _)| features[*id]).collect();
    let mut pixels: Vec<Vec2> = dots.iter().map(|(_, d)| d.pixel).collect();
    let mut radius = stated.unwrap_or(0.0);
    for _ in 0..3 {
        let h = homography(&plane, &pixels).ok_or_else(|| {
            Fault::refused("no board was found: the dots lie on a line").cause("an edge-on board").next("tilt it less")
        })?;
        let first = |id: usize| larger && id == 0;
        let measured = |(id, d): &(usize, Dot)| measured_radius(&h, d, &features[*id]);
        if stated.is_none() {
            let mut all: Vec<f64> = dots.iter().filter(|d| !first(d.0)).map(measured).collect();
            all.sort_by(f64::total_cmp);
            radius = all[all.len() / 2];
        }
        for (p, both) in pixels.iter_mut().zip(dots) {
            let own = if first(both.0) { measured(both) } else { radius };
            *p = both.1.pixel - eccentricity(&h, &features[both.0], own);
        }
    }
    let points = dots.iter().zip(pixels);
    Ok((
        points
            .map(|((feature_id, d), pixel)| BoardPoint { feature_id: *feature_id, pixel, sigma_px: d.sigma_px })
            .collect(),
        radius,
    ))
}

/// The radius at which a circle's image is as large as its ellipse. For small dots, areas change by the homography's
/// determinant at the dot; the circle's exact image gives the remaining correction.
fn measured_radius(h: &Mat3, dot: &Dot, x: &Vec2) -> f64 {
    let seen = 1.0 / dot.shape.determinant().max(1e-12).sqrt();
    let w = (h * Vec3::new(x.x, x.y, 1.0)).z;
    (seen * w.abs().powi(3) / h.determinant().abs().max(1e-300)).sqrt()
}

/// Centre of the circle's image minus the image of its centre, px.
fn eccentricity(h: &Mat3, x: &Vec2, radius: f64) -> Vec2 {
    let shift = Mat3::new(1.0, 0.0, x.x, 0.0, 1.0, x.y, 0.0, 0.0, 1.0);
    let g = h * shift;
    // The dual conic maps forward: its last column is the centre's homogeneous coordinates.
    let dual = g * Mat3::from_diagonal(&Vec3::new(radius * radius, radius * radius, -1.0)) * g.transpose();
    Vec2::new(dual[(0, 2)] / dual[(2, 2)], dual[(1, 2)] / dual[(2, 2)]) - apply(h, x)
}
