//! In: points of one shot's line, each with its distance from its neighbours' surface. Out: one representative point
//! for each half of the line, unaffected by steps and edges under the rest.
//! Frame and unit: the cloud's frame, mm.

use crate::geometry::Vec3;
use crate::solve::robust_scale;

/// With fewer points a half is not judged.
const FEWEST: usize = 10;
/// Points whose distance is within this many robust deviations of the median belong to the surface.
const USUAL: f64 = 2.0;

#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub at: Vec3,
    pub normal: Vec3,
    pub along: Vec3,
    pub off: f64,
    pub after: f64,
}

/// `places` are in order along the stripe; they are split at the middle of their list.
pub(super) fn halves(mut places: Vec<Side>) -> [Option<Side>; 2] {
    // Give all normals the same sign, so that they can be summed.
    if let Some(first) = places.first().map(|p| p.normal) {
        for p in &mut places {
            let sign = p.normal.dot(&first).signum();
            (p.normal, p.off) = (sign * p.normal, sign * p.off);
        }
    }
    let (left, right) = places.split_at(places.len() / 2);
    [usual(left), usual(right)]
}

fn usual(places: &[Side]) -> Option<Side> {
    if places.len() < FEWEST {
        return None;
    }
    let mut off: Vec<f64> = places.iter().map(|p| p.off).collect();
    let half = off.len() / 2;
    let middle = *off.select_nth_unstable_by(half, f64::total_cmp).1;
    off.iter_mut().for_each(|off| *off = (*off - middle).abs());
    let width = robust_scale(&mut off, 1);
    let of_it: Vec<&Side> = places.iter().filter(|p| (p.off - middle).abs() <= USUAL * width).collect();
    let n = of_it.len() as f64;
    let sum = |f: fn(&Side) -> Vec3| of_it.iter().map(|p| f(p)).sum::<Vec3>();
    Some(Side {
        at: sum(|p| p.at) / n,
        normal: sum(|p| p.normal).try_normalize(1e-9)?,
        along: sum(|p| p.along).try_normalize(1e-9)?,
        off: middle,
        after: of_it.iter().map(|p| p.after).sum::<f64>() / n,
    })
}
