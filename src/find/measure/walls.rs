//! In: the points of a scan near a part, the edges that locate it. Out: how much of the sheet's light the walls below those edges
//! send back, on the sides where the sheet falls on them and the camera sees them (docs/math.md, Insertion (4)).
//! Frame and unit: part frame, mm; light as a share of a fully lit sample's.

use super::points::Ordered;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::model::face::Face;
use crate::geometry::Vec3;
use nalgebra::Vector2;

/// A wall stands below its edge: nearer than this to it, in units of the recipe.
const BELOW: f64 = 0.3;
/// Fewer places may be anything.
const MIN_PLACES: usize = 8;
/// What a wall adds to the light of samples beside its edge looks like an edge that lies farther out by so many widths of the
/// light's fall, for a wall as bright as the face: the integral of (1 - Φ) φ over that of φ², samples from 0 outwards.
pub(in crate::find) const FARTHER: f64 = 0.886;

/// Light of the walls that face against the direction from shot to shot, and of those that face along it; 0 where none is seen.
pub(in crate::find) fn wall_light(
    points: &Ordered,
    local: &[Option<Vec3>],
    deep: &[bool],
    faces: &[Face],
    edges: &EdgeIndex,
    gate: f64,
    across: &Vector2<f64>,
) -> [f64; 2] {
    let median = |mut v: Vec<f64>| {
        let middle = v.len() / 2;
        *v.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let full: Vec<f64> = (0..deep.len()).filter(|&i| deep[i]).map(|i| f64::from(points.intensity[i])).collect();
    if full.is_empty() {
        return [0.0; 2];
    }
    let full = median(full).max(1e-6);
    let mut sides = [vec![], vec![]];
    for (i, q) in local.iter().enumerate() {
        let Some(q) = q else { continue };
        // Below every face that it may belong to, and on none.
        if faces.iter().any(|f| (q.z - f.z).abs() <= gate) {
            continue;
        }
        let Some(z) = faces.iter().map(|f| f.z).filter(|z| *z > q.z).min_by(f64::total_cmp) else { continue };
        let Some(edge) = edges.nearest_locating(q.x, q.y, BELOW * edges.unit(), z) else { continue };
        let along = edge.nx * across.x + edge.ny * across.y;
        if along.abs() > std::f64::consts::FRAC_1_SQRT_2 {
            sides[usize::from(along > 0.0)].push(f64::from(points.intensity[i]) / full);
        }
    }
    sides.map(|s| if s.len() < MIN_PLACES { 0.0 } else { median(s).min(1.0) })
}
