//! In: lines of a plate and robot poses. Out: start values without any guess: for directions of the plate's normal
//! all over a hemisphere everything else is linear.
//! Frame and unit: see `rows`; mm (docs/math.md, Plate (5)).

use super::line::Line;
use super::rows::State;
use crate::calibrate::profile_sensor::likelihood::Item;
use crate::geometry::{Mat3, Rigid, Vec3, orthonormalise};
use nalgebra::{Const, DimMin, SMatrix, SVector};

/// Directions of the normal that are tried, 10 degrees apart.
const DIRECTIONS: usize = 200;
/// Starts that are kept for the fit.
const KEPT: usize = 10;
/// Profiles that the starts use; more make them no better.
const PROFILES: usize = 60;
/// Rounds of reweighting, so that wrong profiles count less.
const ROUNDS: usize = 4;

/// The most promising starts, the best first.
pub fn starts(items: &[Item<'_, Line>]) -> Vec<State> {
    let step = items.len().div_ceil(PROFILES).max(1);
    let some: Vec<Item<'_, Line>> = items.iter().step_by(step).copied().collect();
    let mut found: Vec<(f64, State)> = hemisphere().filter_map(|normal| start(&some, &normal)).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().take(KEPT).map(|f| f.1).collect()
}

/// Directions evenly over a hemisphere (a spiral). The opposite normal describes the same plane.
fn hemisphere() -> impl Iterator<Item = Vec3> {
    (0..DIRECTIONS).map(|k| {
        let z = (k as f64 + 0.5) / DIRECTIONS as f64;
        let turn = std::f64::consts::PI * (1.0 + 5f64.sqrt()) * (k as f64 + 0.5);
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * turn.cos(), r * turn.sin(), z)
    })
}

/// With n known, n · (R_B (x X + z Z + t) + t_B) = d is linear in the sensor's axes X and Z, its place t and d. Returns
/// the median misfit of the lines' ends too, mm.
fn start(items: &[Item<'_, Line>], normal: &Vec3) -> Option<(f64, State)> {
    let mut rows: Vec<(SVector<f64, 10>, f64)> = Vec::new();
    for item in items {
        let m = item.pose.rotation.transpose() * normal;
        for sign in [-0.5, 0.5] {
            let q = item.measured.middle + item.measured.along * (sign * item.measured.length);
            let (x, z) = (m * q.x, m * q.y);
            let row = SVector::from_row_slice(&[x.x, x.y, x.z, z.x, z.y, z.z, m.x, m.y, m.z, -1.0]);
            rows.push((row, -normal.dot(&item.pose.translation)));
        }
    }
    let (s, _) = reweighted(&rows)?;
    let v = |i: usize| Vec3::new(s[i], s[i + 1], s[i + 2]);
    let (x, z) = (v(0), v(3));
    let rotation = orthonormalise(&Mat3::from_columns(&[x, z.cross(&x), z]));
    if !rotation.iter().all(|c| c.is_finite()) {
        return None;
    }
    // The place and d again, with axes that are orthonormal.
    let (x, z) = (rotation.column(0).into_owned(), rotation.column(2).into_owned());
    let rest: Vec<(SVector<f64, 4>, f64)> = rows
        .iter()
        .map(|(row, right)| {
            let axes = row.fixed_rows::<3>(0).dot(&x) + row.fixed_rows::<3>(3).dot(&z);
            (row.fixed_rows::<4>(6).into_owned(), right - axes)
        })
        .collect();
    let (t, misfit) = reweighted(&rest)?;
    let x = Rigid::new(rotation, Vec3::new(t[0], t[1], t[2]));
    Some((misfit, State { x, normal: *normal, offset: t[3] }))
}

/// Solution of an overdetermined linear system in which some rows may be wrong, and the median of its misfits. What
/// the rows do not determine stays near zero.
fn reweighted<const N: usize>(rows: &[(SVector<f64, N>, f64)]) -> Option<(SVector<f64, N>, f64)>
where
    Const<N>: DimMin<Const<N>, Output = Const<N>>,
{
    let mut weights = vec![1.0; rows.len()];
    let mut last = None;
    for _ in 0..ROUNDS {
        let (mut h, mut g) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
        for ((row, right), w) in rows.iter().zip(&weights) {
            h += row * row.transpose() * *w;
            g += row * (right * w);
        }
        for i in 0..N {
            h[(i, i)] += 1e-9 * h[(i, i)] + 1e-12 * h.trace();
        }
        let s = h.cholesky()?.solve(&g);
        let off: Vec<f64> = rows.iter().map(|(row, right)| (row.dot(&s) - right).abs()).collect();
        let mut sorted = off.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted[sorted.len() / 2];
        let scale = 1.5 * middle + 1e-6;
        weights = off.iter().map(|e| 1.0 / (1.0 + (e / scale).powi(2))).collect();
        last = Some((s, middle));
    }
    last
}
