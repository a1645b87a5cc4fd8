//! In: points of a scan by the stripe's shift. Out: the level surface that stands on the bed, if there is one.
//! Frame and unit: heights above the bed, mm; docs/math.md, Shift.

use crate::scan::CloudPoint;
use std::collections::BTreeMap;

/// A level surface in a scan: the most frequent height above the bed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Plateau {
    /// Median of the points within 0.5 mm of the most frequent height, mm.
    pub height_mm: f64,
    /// Their robust standard deviation (1.4826 MAD), mm.
    pub noise_mm: f64,
    /// Standard deviation of the medians of single pictures, mm: the error that a picture's points share and that
    /// does not average out.
    pub between_shots_mm: f64,
    /// Number of points within 0.5 mm of the most frequent height.
    pub points: usize,
    /// Pictures with ten or more of these points.
    pub shots: usize,
}

/// Points within this distance of the most frequent height belong to the surface, mm.
const NEAR: f64 = 0.5;
/// Largest robust deviation of a surface, mm. Points scattered evenly within ± NEAR have 0.37 mm and form no
/// surface.
const LEVEL: f64 = 0.25;
/// A point belongs to a surface if most of the rows within this distance have a point at its height ...
const ROWS: i64 = 4;
const HEIGHT: f64 = 0.4;
/// ... and if at least this many pictures and points show the surface.
const SHOTS: usize = 3;
const POINTS: usize = 100;
/// Least number of points for a picture's own median.
const OF_SHOT: usize = 10;
const BIN: f64 = 0.1;

/// The level surface in points above the bed; `None` if the points do not form one.
pub fn plateau(raised: &[CloudPoint]) -> Option<Plateau> {
    let together = connected(raised);
    let z = |p: &CloudPoint| f64::from(p.position[2]);
    let mut counts = BTreeMap::new();
    together.iter().for_each(|p| *counts.entry((z(p) / BIN).floor() as i64).or_insert(0usize) += 1);
    let mode = counts.iter().max_by_key(|(_, n)| **n).map(|(b, _)| (*b as f64 + 0.5) * BIN)?;
    let on: Vec<&CloudPoint> = together.into_iter().filter(|p| (z(p) - mode).abs() < NEAR).collect();
    let (height_mm, noise_mm) = spread(&on.iter().map(|p| z(p)).collect::<Vec<_>>());
    let mut shots = BTreeMap::<u32, Vec<f64>>::new();
    on.iter().for_each(|p| shots.entry(p.shot).or_default().push(z(p)));
    let medians: Vec<f64> = shots.values().filter(|z| z.len() >= OF_SHOT).map(|z| spread(z).0).collect();
    if on.len() < POINTS || medians.len() < SHOTS || noise_mm > LEVEL {
        return None;
    }
    let mean = medians.iter().sum::<f64>() / medians.len() as f64;
    let variance = medians.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (medians.len() - 1) as f64;
    Some(Plateau { height_mm, noise_mm, between_shots_mm: variance.sqrt(), points: on.len(), shots: medians.len() })
}

/// The points whose neighbours along the stripe lie at their height.
fn connected(points: &[CloudPoint]) -> Vec<&CloudPoint> {
    let key = |p: &CloudPoint| (p.shot, p.v.round() as i64);
    let by_row: BTreeMap<(u32, i64), f32> = points.iter().map(|p| (key(p), p.position[2])).collect();
    let like = |p: &&CloudPoint| {
        let (shot, row) = key(p);
        let near = by_row.range((shot, row - ROWS)..=(shot, row + ROWS));
        near.filter(|(_, z)| f64::from((*z - p.position[2]).abs()) < HEIGHT).count() as i64 > ROWS + 1
    };
    points.iter().filter(like).collect()
}

/// Median and 1.4826 times the median absolute deviation.
pub fn spread(values: &[f64]) -> (f64, f64) {
    if values.is_empty() {
        return (f64::NAN, f64::NAN);
    }
    let median = |mut x: Vec<f64>| {
        x.sort_unstable_by(f64::total_cmp);
        x[x.len() / 2]
    };
    let middle = median(values.to_vec());
    (middle, 1.4826 * median(values.iter().map(|x| (x - middle).abs()).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn point(shot: u32, row: u32, z: f64) -> CloudPoint {
        CloudPoint { position: [0.0, 0.0, z as f32].into(), shot, v: row as f32, ..Default::default() }
    }

    #[test]
    fn a_surface_is_found_and_scatter_is_none() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(2);
        let scatter: Vec<CloudPoint> = (0..60)
            .flat_map(|s| (0..40).map(move |r| (s, 7 * r)))
            .map(|(s, r)| point(s, r, rng.random_range(1.0..3.0)))
            .collect();
        assert_eq!(plateau(&scatter), None);
        // In every row: neighbours exist, but not at the same height.
        let dense: Vec<CloudPoint> = (0..40)
            .flat_map(|s| (0..300).map(move |r| (s, r)))
            .map(|(s, r)| point(s, r, rng.random_range(1.0..3.0)))
            .collect();
        assert_eq!(plateau(&dense), None);
        let mut part = scatter;
        part.extend(
            (10..15)
                .flat_map(|s| (100..160).map(move |r| (s, r)))
                .map(|(s, r)| point(s, r, 3.7 + rng.random_range(-0.1..0.1))),
        );
        let found = plateau(&part).unwrap();
        assert!((found.height_mm - 3.7).abs() < 0.02 && found.shots == 5, "{found:?}");
        // Two pictures are a reflection, not a part that travelled through the light.
        let brief: Vec<CloudPoint> = (0..2).flat_map(|s| (0..200).map(move |r| point(s, r, 2.0))).collect();
        assert_eq!(plateau(&brief), None);
    }
}
