//! In: the covariance of a sensor's pose, the plate's normals in the flange frame. Out: in words what the profiles do
//! not determine, and what they lack.
//! Frame and unit: flange frame; mm, rad (docs/math.md, Plate (8)).

use crate::geometry::{Mat3, Vec3};
use nalgebra::DMatrix;

/// rms spread of the plate's normals below which the plate counts as seen at one angle, rad: 2 degrees.
const ONE_ANGLE: f64 = 0.035;
/// rms distance of the normals from a common plane below which they lie on one cone or fan.
const ONE_CONE: f64 = 0.01;

/// Directions that count as undetermined: sigma beyond `limit` mm; turns act at `lever` mm.
pub struct Limit {
    pub mm: f64,
    pub lever: f64,
}

impl Limit {
    /// Whether the pose's covariance (tx ty tz mm, rx ry rz rad) keeps within the limit in all directions.
    pub fn holds(&self, c: &DMatrix<f64>) -> bool {
        let [shifts, turns] = blocks(c);
        largest(&shifts) < self.mm && largest(&turns) * self.lever < self.mm
    }

    /// What is not determined.
    pub fn beyond(&self, c: &DMatrix<f64>) -> String {
        let [shifts, turns] = blocks(c);
        let what = [
            directions(&turns, self.mm / self.lever).map(|d| format!("its turn about {d}")),
            directions(&shifts, self.mm).map(|d| format!("its position along {d}")),
        ];
        what.into_iter().flatten().collect::<Vec<_>>().join(", and ")
    }
}

fn blocks(c: &DMatrix<f64>) -> [Mat3; 2] {
    [0, 3].map(|at| c.fixed_view::<3, 3>(at, at).into_owned())
}

fn largest(variance: &Mat3) -> f64 {
    // NaN counts as undetermined.
    let eigenvalues = variance.symmetric_eigenvalues();
    if eigenvalues.iter().all(|v| v.is_finite()) { eigenvalues.max().max(0.0).sqrt() } else { f64::INFINITY }
}

/// The directions with a larger sigma, in words; `None` if there is none.
fn directions(variance: &Mat3, limit: f64) -> Option<String> {
    let own = variance.symmetric_eigen();
    let loose: Vec<Vec3> =
        (0..3).filter(|&i| own.eigenvalues[i] > limit * limit).map(|i| own.eigenvectors.column(i).into()).collect();
    let tight = (0..3).find(|&i| own.eigenvalues[i] <= limit * limit);
    match (loose.as_slice(), tight) {
        ([], _) => None,
        ([d], _) => Some(format!("the flange's direction {}", arrow(d))),
        (_, Some(i)) => {
            Some(format!("all directions across the flange's {}", arrow(&own.eigenvectors.column(i).into())))
        }
        (_, None) => Some("every direction".into()),
    }
}

/// A direction without sign: its largest component is positive.
fn arrow(d: &Vec3) -> String {
    let d = d * d[d.iamax()].signum();
    let r = |v: f64| (v * 100.0).round() / 100.0 + 0.0;
    format!("({:.2}, {:.2}, {:.2})", r(d.x), r(d.y), r(d.z))
}

/// Why. `normals`: the plate's normal in the flange frame, by profile.
pub fn cause(normals: &[Vec3]) -> String {
    let mean = normals.iter().sum::<Vec3>() / normals.len().max(1) as f64;
    let scatter: Mat3 =
        normals.iter().map(|m| (m - mean) * (m - mean).transpose()).sum::<Mat3>() / normals.len().max(1) as f64;
    let own = scatter.symmetric_eigen();
    let rms = |i: usize| own.eigenvalues[i].max(0.0).sqrt();
    let widest = own.eigenvalues.imax();
    if rms(widest) < ONE_ANGLE {
        let widest = normals.iter().map(|m| m.angle(&mean)).fold(0.0, f64::max).to_degrees();
        return format!(
            "all profiles see the plate at the same angle (to {widest:.1} degrees): shifts, and turns about the \
             plate's normal, do not change it"
        );
    }
    let flattest = own.eigenvalues.imin();
    if rms(flattest) < ONE_CONE {
        return format!(
            "the flange turned about one axis only, or is tilted against the plate by one and the same angle: the \
             plate's normal keeps its angle to the flange's direction {}",
            arrow(&own.eigenvectors.column(flattest).into())
        );
    }
    "the profiles are too few or too alike for their noise".into()
}
