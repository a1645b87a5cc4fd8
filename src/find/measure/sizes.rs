//! In: ends of surfaces and light beside their edges, the drawing. Out: the measured sizes relative to the drawn ones.
//! Frame and unit: the part's axes; shares, shear in rad. docs/math.md, Sizes.

use super::lit_edges::Lit;
use super::robust::robust;
use super::shape::{Shape, shape_row};
use super::surface_ends::Observation;
use nalgebra::{SVector, Vector3};

/// Measures the sizes: from the ends of surfaces to some tenths of a percent, then refined by light.
/// `unit` is the recipe's, by which lengths in mm are scaled; sizes and shear have none.
pub(in crate::find) fn measure_shape(
    ends: &[Observation],
    unit: f64,
    by_light: impl Fn(Vector3<f64>) -> Option<Lit>,
) -> Option<Shape> {
    // Unknowns: place, turn, growth along the stripe and from shot to shot, sizes.
    let row = |o: &Observation| {
        let mut j = SVector::<f64, 8>::zeros();
        (j[0], j[1], j[2], j[3 + o.axis]) = (o.nx, o.ny, o.x * o.ny - o.y * o.nx, 1.0);
        j.fixed_rows_mut::<3>(5).copy_from_slice(&shape_row(o.x, o.y, o.nx, o.ny));
        (j, o.residual, o.row)
    };
    let rows: Vec<_> = ends.iter().filter(|o| o.locates).map(row).collect();
    if rows.is_empty() {
        return None;
    }
    let growth = 0.05 * unit;
    let priors = [(3, growth), (4, growth), (5, 0.03), (6, 0.03), (7, 0.03)];
    let start = robust(&rows, &priors, 0.03 * unit).map_or(Vector3::zeros(), |f| f.step.fixed_rows::<3>(5).into());
    by_light(start).map(|lit| lit.shape)
}
