//! In: a profile of a plate. Out: the straight lines in it, each as a measurement with its information.
//! Frame and unit: the sensor's plane y = 0, mm, rad; docs/math.md, Plate (2).

use super::options::PlaneOptions;
use crate::geometry::Vec2;
use crate::recording::profiles::Profile;
use crate::solve::{ConsensusOptions, LmOptions, Loss, Problem, Residuals, consensus, lm};

/// Fewest points on a line.
const LEAST: usize = 8;
/// Most lines of one profile: the plate, the table beside it, a clamp.
const MOST: usize = 3;
/// Smallest share of a profile's points on a line: of scattered points, too, a few lie on one.
const SHARE: f64 = 0.1;

/// A straight line in a profile.
#[derive(Clone, Debug)]
pub struct Line {
    /// Its middle: the weighted mean of its points, x and z.
    pub middle: Vec2,
    /// Unit vector along it.
    pub along: Vec2,
    /// Sum of the points' weights: the information about the distance across the line, for a point variance of 1 mm².
    pub weight: f64,
    /// Weighted sum of the squared distances from the middle, mm²: the information about the direction.
    pub spread: f64,
    /// Distance between its outermost points, mm.
    pub length: f64,
    /// The profile's points on it.
    pub on: Vec<[f64; 2]>,
    /// Number of points on it, and number of points in the profile.
    pub points: [usize; 2],
    /// Weighted sum of the squared distances from the line, mm².
    pub squares: f64,
}

/// A line through points near `origin`: its angle from the x axis, and its distance from the origin.
struct LineFit<'a> {
    points: &'a [[f64; 2]],
    origin: Vec2,
}

impl Problem for LineFit<'_> {
    type State = (f64, f64);
    fn width(&self) -> usize {
        2
    }
    fn moved(&self, s: &(f64, f64), d: &[f64]) -> (f64, f64) {
        (s.0 + d[0], s.1 + d[1])
    }
    fn residuals(&self, s: &(f64, f64), out: &mut Residuals) -> Option<()> {
        let (sin, cos) = s.0.sin_cos();
        for p in self.points {
            let d = Vec2::new(p[0], p[1]) - self.origin;
            out.group(&[cos * d.y - sin * d.x - s.1], &[0, 1], &[-sin * d.y - cos * d.x, -1.0]);
        }
        Some(())
    }
}

/// The lines of a profile, the one with most points first. The error says why no line was found.
pub fn lines(profile: &Profile, o: &PlaneOptions) -> Result<Vec<Line>, String> {
    let all = profile.points.len();
    let mut rest = profile.points.clone();
    let mut found = Vec::new();
    let mut most = 0;
    let least = LEAST.max((SHARE * all as f64).ceil() as usize);
    while found.len() < MOST && rest.len() >= least {
        let on = straight(&rest, o);
        most = most.max(on.len());
        if on.len() < least {
            break;
        }
        let chosen: Vec<[f64; 2]> = on.iter().map(|&i| rest[i]).collect();
        match fitted(chosen, all) {
            Some(line) => found.push(line),
            None => break,
        }
        let mut keep = vec![true; rest.len()];
        on.iter().for_each(|&i| keep[i] = false);
        let mut keep = keep.into_iter();
        rest.retain(|_| keep.next().unwrap_or(false));
    }
    if found.is_empty() {
        return Err(format!("{most} of its {all} points lie on a straight line, {least} are needed"));
    }
    Ok(found)
}

/// Indices of the points on the line that most of them lie on.
fn straight(p: &[[f64; 2]], o: &PlaneOptions) -> Vec<usize> {
    let options = ConsensusOptions { threshold: o.gate_mm, max_draws: 2000, seed: o.seed, ..Default::default() };
    let at = |i: usize| Vec2::new(p[i][0], p[i][1]);
    let found = consensus(
        p.len(),
        2,
        &options,
        |c| {
            let d = at(c[1]) - at(c[0]);
            // Points closer than a few gates have no direction.
            (d.norm() > 4.0 * o.gate_mm).then(|| (at(c[0]), Vec2::new(-d.y, d.x).normalize()))
        },
        |(a, across), i| (at(i) - a).dot(across),
    );
    found.map_or_else(Vec::new, |f| f.inliers)
}

/// The line through points; `None` if they coincide.
fn fitted(on: Vec<[f64; 2]>, all: usize) -> Option<Line> {
    let at = |p: &[f64; 2]| Vec2::new(p[0], p[1]);
    let origin = on.iter().map(at).sum::<Vec2>() / on.len() as f64;
    let scatter: nalgebra::Matrix2<f64> = on.iter().map(|p| (at(p) - origin) * (at(p) - origin).transpose()).sum();
    let angle = 0.5 * (2.0 * scatter[(0, 1)]).atan2(scatter[(0, 0)] - scatter[(1, 1)]);
    let options = LmOptions { loss: Loss::Huber(2.0), estimate_scale: true, ..Default::default() };
    let fit = lm(&LineFit { points: &on, origin }, (angle, 0.0), &options).minimum()?;
    let (sin, cos) = fit.state.0.sin_cos();
    let (along, across) = (Vec2::new(cos, sin), Vec2::new(-sin, cos));
    let weight: f64 = fit.weights.iter().sum();
    let place: Vec<f64> = on.iter().map(|p| (at(p) - origin).dot(&along)).collect();
    let mean = place.iter().zip(&fit.weights).map(|(s, w)| s * w).sum::<f64>() / weight;
    let spread: f64 = place.iter().zip(&fit.weights).map(|(s, w)| w * (s - mean).powi(2)).sum();
    let off = |p: &[f64; 2]| (at(p) - origin).dot(&across) - fit.state.1;
    let squares = on.iter().zip(&fit.weights).map(|(p, w)| w * off(p).powi(2)).sum();
    let (low, high) = place.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(*s), h.max(*s)));
    let length = high - low;
    (weight > 0.0 && spread > 1e-9).then_some(Line {
        middle: origin + along * mean + across * fit.state.1,
        along,
        weight,
        spread,
        length,
        points: [on.len(), all],
        squares,
        on,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate of 60 points that ends beside a table of 40, with five stray points.
    #[test]
    fn the_longer_line_comes_first_and_the_other_is_kept() {
        let plate = (0..60).map(|k| [0.5 * f64::from(k), 100.0 + 0.05 * f64::from(k) + 0.01 * f64::from(k % 3 - 1)]);
        let table = (60..100).map(|k| [0.5 * f64::from(k), 120.0]);
        let stray = (0..5).map(|k| [3.0 * f64::from(k), 90.0 - 7.0 * f64::from(k * k)]);
        let profile = Profile { name: "a".into(), points: plate.chain(table).chain(stray).collect() };
        let found = lines(&profile, &PlaneOptions::default()).unwrap();
        assert_eq!(found.iter().map(|l| l.points).collect::<Vec<_>>(), [[60, 105], [40, 105]]);
        let slope = found[0].along.y / found[0].along.x;
        assert!((slope - 0.1).abs() < 1e-4 && (found[0].middle - Vec2::new(14.75, 101.475)).norm() < 1e-3);
        assert!((found[0].length - 29.6).abs() < 0.1 && found[0].squares < 60.0 * 1e-4);
        let few = Profile { name: "b".into(), points: profile.points[..6].to_vec() };
        assert!(lines(&few, &PlaneOptions::default()).unwrap_err().contains("6 points"));
    }
}
