//! In: a SPLINE entity: degree, knots, control points, weights. Out: points on it, within a given distance of the
//! curve.
//! Frame and unit: the drawing's own x y and unit.

use super::tags::{Entity, Tag};
use crate::fault::Result;

/// A rational B-spline in the plane.
pub struct Spline {
    degree: usize,
    knots: Vec<f64>,
    /// Homogeneous: x w, y w, w.
    control: Vec<[f64; 3]>,
}

/// Programs write degree 3, some 5; the limit keeps a damaged number from taking hours.
const HIGHEST_DEGREE: i64 = 25;
/// Most segments between two knots.
const MOST_PIECES: usize = 1024;

impl Spline {
    /// Reads a spline. `None` where the file gives only points that the curve passes through: its shape between them
    /// depends on the program that wrote it.
    pub fn of(e: &Entity) -> Result<Option<Spline>> {
        let all = |code: i32| e.tags.iter().filter(|t| t.code == code).map(Tag::number).collect::<Result<Vec<f64>>>();
        let (knots, weights, x, y) = (all(40)?, all(41)?, all(10)?, all(20)?);
        if x.is_empty() && !all(11)?.is_empty() {
            return Ok(None);
        }
        let degree = e.whole(71, 3)?;
        if !(1..=HIGHEST_DEGREE).contains(&degree) {
            return Err(e.fault(format!("its degree is {degree}; allowed: 1 to {HIGHEST_DEGREE}")));
        }
        let (n, degree) = (x.len(), degree as usize);
        if n <= degree || y.len() != n || knots.len() != n + degree + 1 {
            let what = format!(
                "degree {degree} with {n} control points and {} knots; allowed: above {degree} points and {} knots",
                knots.len(),
                n + degree + 1
            );
            return Err(e.fault(what));
        }
        if knots.windows(2).any(|k| k[1] < k[0]) || knots[n] <= knots[degree] {
            return Err(e.fault("its knots do not rise"));
        }
        if !(weights.is_empty() || weights.len() == n && weights.iter().all(|&w| w > 0.0)) {
            return Err(e.fault(format!("{} weights for {n} control points, wanted as many, above 0", weights.len())));
        }
        let weight = |i: usize| weights.get(i).copied().unwrap_or(1.0);
        let control = (0..n).map(|i| [x[i] * weight(i), y[i] * weight(i), weight(i)]).collect();
        Ok(Some(Spline { degree, knots, control }))
    }

    /// The point at a parameter within the given knot span, by de Boor's corner cutting.
    fn at(&self, span: usize, t: f64) -> [f64; 2] {
        let p = self.degree;
        let mut d: Vec<[f64; 3]> = self.control[span - p..=span].to_vec();
        for r in 1..=p {
            for j in (r..=p).rev() {
                let (low, high) = (self.knots[span - p + j], self.knots[span + 1 + j - r]);
                let a = if high > low { (t - low) / (high - low) } else { 0.0 };
                d[j] = std::array::from_fn(|k| (1.0 - a) * d[j - 1][k] + a * d[j][k]);
            }
        }
        [d[p][0] / d[p][2], d[p][1] / d[p][2]]
    }

    /// Points from end to end. The midpoint of each chord lies within `flat` of the curve, up to `MOST_PIECES` segments
    /// a span.
    pub fn flat(&self, flat: f64) -> Vec<[f64; 2]> {
        let spans = (self.degree..self.control.len()).filter(|&i| self.knots[i + 1] > self.knots[i]);
        let mut out: Vec<[f64; 2]> = Vec::new();
        for span in spans {
            let (low, high) = (self.knots[span], self.knots[span + 1]);
            let at = |i: usize, n: usize| self.at(span, low + (high - low) * i as f64 / n as f64);
            let mut pieces = if self.degree == 1 { 1 } else { 8 };
            let far = |n: usize| {
                (0..n).any(|i| {
                    let (a, m, b) = (at(2 * i, 2 * n), at(2 * i + 1, 2 * n), at(2 * i + 2, 2 * n));
                    (m[0] - 0.5 * (a[0] + b[0])).hypot(m[1] - 0.5 * (a[1] + b[1])) > flat
                })
            };
            while self.degree > 1 && pieces < MOST_PIECES && far(pieces) {
                pieces *= 2;
            }
            out.extend((usize::from(!out.is_empty())..=pieces).map(|i| at(i, pieces)));
        }
        out
    }
}
