//! In: a board's features as drawn, coefficients. Out: the positions of the features on the printed and mounted
//! board.
//! Frame and unit: board frame; mm. docs/math.md, Camera calibration (12).

use crate::geometry::{Vec2, Vec3};

/// Highest degree of the polynomials.
const DEGREE: usize = 5;
/// Number of linear terms: the stretch of x against y, and the shear.
const LINEAR: usize = 2;

/// The modes in which a board may differ from its drawing. They are smooth, and none of them equals a motion of the
/// board or a scale of the drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    middle: Vec2,
    /// Half of the features' extent along x and y, mm.
    half: Vec2,
}

impl Basis {
    /// The basis for a board with these features. `None` if they lie on one line.
    pub fn of(features: &[Vec3]) -> Option<Basis> {
        let first = features.first()?.xy();
        let (low, high) = features.iter().fold((first, first), |(l, h), x| (l.inf(&x.xy()), h.sup(&x.xy())));
        let half = (high - low) / 2.0;
        (half.min() > 0.0).then_some(Basis { middle: (low + high) / 2.0, half })
    }

    /// Number of coefficients.
    pub const LEN: usize = LINEAR + 3 * ((DEGREE + 1) * (DEGREE + 2) / 2 - 3);

    /// True for coefficients that move features out of the plane.
    pub fn lifts(term: usize) -> bool {
        term >= LINEAR && (term - LINEAR) % 3 == 2
    }

    /// True for the stretch along x against y and the shear.
    pub fn stretches(term: usize) -> bool {
        term < LINEAR
    }

    /// Half of the board's longer side, mm: the reference length for bending and stretching.
    pub fn size(&self) -> f64 {
        self.half.max()
    }

    /// Displacement of a feature per unit of each coefficient, mm per mm.
    pub fn terms(&self, feature: &Vec3) -> Vec<Vec3> {
        let at = (feature.xy() - self.middle).component_div(&self.half);
        let (x, y) = (legendre(at.x), legendre(at.y));
        // Stretch and shear are scaled by the longer half side, so that they are isotropic on a board with unequal
        // sides.
        let [u, v] = [at.x * self.half.x, at.y * self.half.y].map(|d| d / self.size());
        let mut out = vec![Vec3::new(u, -v, 0.0), Vec3::new(v, u, 0.0)];
        for degree in 2..=DEGREE {
            for i in 0..=degree {
                let height = x[i] * y[degree - i];
                out.extend([Vec3::x() * height, Vec3::y() * height, Vec3::z() * height]);
            }
        }
        out
    }

    /// Position of the feature with these coefficients, mm.
    pub fn place(&self, feature: &Vec3, coefficients: &[f64]) -> Vec3 {
        self.terms(feature).iter().zip(coefficients).fold(*feature, |p, (t, c)| p + t * *c)
    }
}

/// Legendre's polynomials of degree 0 to `DEGREE`.
fn legendre(x: f64) -> [f64; DEGREE + 1] {
    let mut p = [1.0; DEGREE + 1];
    p[1] = x;
    for n in 2..=DEGREE {
        let k = n as f64;
        p[n] = ((2.0 * k - 1.0) * x * p[n - 1] - (k - 1.0) * p[n - 2]) / k;
    }
    p
}

/// Shape of a board as estimated from its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// The basis of the coefficients.
    pub basis: Basis,
    /// [`Basis::LEN`] coefficients, mm.
    pub coefficients: Vec<f64>,
}

impl Shape {
    /// Position of a feature, mm.
    pub fn place(&self, feature: &Vec3) -> Vec3 {
        self.basis.place(feature, &self.coefficients)
    }
    /// rms of the features' displacements from the drawing, mm: in the board's plane, and out of it.
    pub fn departs(&self, features: &[Vec3]) -> [f64; 2] {
        let n = features.len().max(1) as f64;
        let off: Vec<Vec3> = features.iter().map(|x| self.place(x) - x).collect();
        let rms = |of: &dyn Fn(&Vec3) -> f64| (off.iter().map(of).sum::<f64>() / n).sqrt();
        [rms(&|d| d.xy().norm_squared()), rms(&|d| d.z * d.z)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, SVD};

    fn features() -> Vec<Vec3> {
        (0..54).map(|i| Vec3::new(f64::from(i % 9) * 12.0 + 3.0, f64::from(i / 9) * 12.0, 0.0)).collect()
    }

    /// Together with the seven parameters of a similarity, the terms stay independent: nothing is estimated twice.
    #[test]
    fn no_term_is_a_motion_or_a_scale() {
        let (features, basis) = (features(), Basis::of(&features()).unwrap());
        let middle = features.iter().sum::<Vec3>() / features.len() as f64;
        let columns: Vec<Vec<Vec3>> = features
            .iter()
            .map(|x| {
                let d = (x - middle) / basis.size();
                let turns = [Vec3::x(), Vec3::y(), Vec3::z()].map(|a| a.cross(&d));
                let mut all = basis.terms(x);
                all.extend([Vec3::x(), Vec3::y(), Vec3::z(), turns[0], turns[1], turns[2], d]);
                all
            })
            .collect();
        let m = DMatrix::from_fn(3 * features.len(), Basis::LEN + 7, |r, c| columns[r / 3][c][r % 3]);
        let singular = SVD::new(m, false, false).singular_values;
        assert!(singular.min() > 1e-3 * singular.max(), "{} of {}", singular.min(), singular.max());
    }

    #[test]
    fn a_bend_is_out_of_the_plane_and_a_stretch_in_it() {
        let (features, basis) = (features(), Basis::of(&features()).unwrap());
        let mut coefficients = vec![0.0; Basis::LEN];
        coefficients[0] = 0.1;
        let stretched = Shape { basis, coefficients: coefficients.clone() };
        let [flat, lifted] = stretched.departs(&features);
        assert!(flat > 0.04 && lifted == 0.0, "{flat} {lifted}");
        assert_eq!((0..Basis::LEN).filter(|&i| Basis::lifts(i)).count(), 18);
        let bend = (0..Basis::LEN).find(|&i| Basis::lifts(i)).unwrap();
        coefficients[0] = 0.0;
        coefficients[bend] = 0.1;
        let [flat, lifted] = Shape { basis, coefficients }.departs(&features);
        assert!(flat == 0.0 && lifted > 0.03, "{flat} {lifted}");
    }

    #[test]
    fn a_line_of_features_has_no_shape() {
        assert_eq!(Basis::of(&[Vec3::zeros(), Vec3::x(), Vec3::x() * 2.0]), None);
        assert_eq!(Basis::of(&[]), None);
    }
}
