//! In: a part's measured sizes, and what all calibrations predict. Out: their deviations along the stripe and from shot
//! to shot, and the gate on them.
//! Frame and unit: the scan's directions in the part's plane; percent, degrees. docs/math.md, Sizes.

use super::levers::Lever;
use crate::fault::Gate;
use crate::find::insert::recipe::Gates;
use crate::find::measure::shape::Shape;
use nalgebra::{Matrix3, SMatrix, Vector2};

/// Deviations of the sizes from the drawing, along the stripe and across it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct SizeCheck {
    /// Along the stripe, percent longer than drawn.
    pub along_percent: f64,
    /// From shot to shot, percent longer than drawn.
    pub across_percent: f64,
    /// Difference of the two, along less across, percent.
    pub difference_percent: f64,
    /// Deviation of the angle between the two directions, degrees.
    pub shear_deg: f64,
    /// Standard deviations of the four, expected from all covariances and the scatter of the part's own sizes.
    pub expected: [f64; 4],
    /// The largest of the four over its expected value.
    pub ratio: f64,
}

/// A note is given where the sizes could hide more than this, percent, three standard deviations.
const TOLD_PERCENT: f64 = 1.0;

impl SizeCheck {
    /// `axes`: the stripe's direction in the part's plane and the one across it; `size_sigma`: standard deviation of
    /// the part's own sizes.
    pub fn new(shape: &Shape, levers: &[Lever], axes: &[Vector2<f64>; 2], size_sigma: f64) -> SizeCheck {
        let all = expected(shape, levers, size_sigma);
        let rows = size_rows(axes);
        let seen = rows.map(|r| (r * shape.strain)[0]);
        let sigma = rows.map(|r| (r * all * r.transpose())[0].max(0.0).sqrt());
        let units = [100.0, 100.0, 100.0, 1f64.to_degrees()];
        let [along_percent, across_percent, difference_percent, shear_deg] =
            std::array::from_fn(|k| seen[k] * units[k]);
        SizeCheck {
            along_percent,
            across_percent,
            difference_percent,
            shear_deg,
            expected: std::array::from_fn(|k| sigma[k] * units[k]),
            ratio: (0..4).map(|k| seen[k].abs() / sigma[k].max(1e-12)).fold(0.0, f64::max),
        }
    }

    pub(in crate::find) fn gate(&self, g: &Gates) -> Gate {
        Gate::most("sizes' ratio", self.ratio, g.max_look_ratio)
    }

    /// A note on what the sizes of this part cannot show.
    pub(in crate::find) fn silent(&self) -> Option<String> {
        let worst = self.expected[0].max(self.expected[1]);
        (3.0 * worst > TOLD_PERCENT).then(|| {
            format!(
                "the part's sizes tell lengths to {:.1} % only (three sigmas): smaller errors of scale and steps are \
                 not tested",
                3.0 * worst
            )
        })
    }
}

/// Rows that give the lengths along the stripe and across it, their difference, and the shear, from the part's own
/// three sizes.
pub(in crate::find) fn size_rows(axes: &[Vector2<f64>; 2]) -> [SMatrix<f64, 1, 3>; 4] {
    let [s, c] = axes;
    let along = |d: &Vector2<f64>| SMatrix::<f64, 1, 3>::new(d.x * d.x, d.y * d.y, d.x * d.y);
    let shear = SMatrix::<f64, 1, 3>::new(2.0 * s.x * c.x, 2.0 * s.y * c.y, s.x * c.y + s.y * c.x);
    [along(s), along(c), along(s) - along(c), shear]
}

/// Covariance of the sizes from all stated sources: the measurement, the calibrations, the part.
pub(in crate::find) fn expected(shape: &Shape, levers: &[Lever], size_sigma: f64) -> Matrix3<f64> {
    let mut all = shape.covariance + of_part(size_sigma);
    for l in levers.iter().filter(|l| !l.supposed) {
        if let Some(c) = &l.covariance {
            let j = l.jacobian.rows(6, 3);
            all += Matrix3::from_iterator((j * c * j.transpose()).iter().copied());
        }
    }
    all
}

/// Covariance of the sizes of parts made from one drawing: most of it is common to both directions.
pub(in crate::find) fn of_part(sigma: f64) -> Matrix3<f64> {
    let (common, each) = (sigma * sigma, (sigma / 3.0).powi(2));
    Matrix3::new(common + each, common, 0.0, common, common + each, 0.0, 0.0, 0.0, 2.0 * each)
}
