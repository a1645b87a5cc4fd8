//! In: heights on a regular grid. Out: the height map type with look-ups; missing cells stay missing.
//! Frame and unit: grid frame (x along columns, y along rows, z up), mm; `base_from_grid` places it.

use crate::geometry::{Base, Grid, Rigid, Vec3};

/// Heights above the grid's x-y plane, row-major. The centre of cell (ix, iy) is at
/// ((ix + 0.5) · cell, (iy + 0.5) · cell) in the grid frame.
#[derive(Clone, Debug)]
pub struct HeightMap {
    /// Columns: cells along the grid's x.
    pub width: u32,
    /// Rows: cells along the grid's y.
    pub height: u32,
    /// Edge of a cell, mm.
    pub cell: f64,
    /// Pose of the grid in the cloud's frame, mm; its origin is the outer corner of cell (0, 0).
    pub base_from_grid: Rigid<Base, Grid>,
    /// Height, mm; NaN where nothing was measured.
    pub z: Vec<f32>,
    /// Points in the cell.
    pub count: Vec<u32>,
    /// Mean stripe amplitude, grey levels; NaN where nothing was measured.
    pub intensity: Vec<f32>,
    /// Standard deviation of the height, derived from the points' own sigmas, mm; NaN where nothing was measured.
    pub sigma: Vec<f32>,
}

impl HeightMap {
    /// A map without any measurement.
    pub fn empty(width: u32, height: u32, cell: f64, base_from_grid: Rigid<Base, Grid>) -> HeightMap {
        let n = width as usize * height as usize;
        HeightMap {
            width,
            height,
            cell,
            base_from_grid,
            z: vec![f32::NAN; n],
            count: vec![0; n],
            intensity: vec![f32::NAN; n],
            sigma: vec![f32::NAN; n],
        }
    }
    /// Height of a cell; `None` outside the map and where nothing was measured.
    pub fn get(&self, ix: i64, iy: i64) -> Option<f32> {
        let inside = (0..i64::from(self.width)).contains(&ix) && (0..i64::from(self.height)).contains(&iy);
        let z = *inside.then(|| &self.z[iy as usize * self.width as usize + ix as usize])?;
        z.is_finite().then_some(z)
    }
    /// Centre of a cell at its height, grid frame.
    pub fn point(&self, ix: u32, iy: u32) -> Option<Vec3> {
        let z = self.get(i64::from(ix), i64::from(iy))?;
        Some(Vec3::new((f64::from(ix) + 0.5) * self.cell, (f64::from(iy) + 0.5) * self.cell, f64::from(z)))
    }
    /// Share of the cells that were measured.
    pub fn coverage(&self) -> f64 {
        self.z.iter().filter(|z| z.is_finite()).count() as f64 / self.z.len().max(1) as f64
    }
    /// The heights between which the given share of the measured cells lies, e.g. 0.01 and 0.99.
    pub fn quantiles(&self, low: f64, high: f64) -> Option<(f32, f32)> {
        quantiles(&self.z, low, high)
    }
}

/// The values below which the given shares of the finite values lie; `None` if none is finite.
pub(in crate::scan) fn quantiles(values: &[f32], low: f64, high: f64) -> Option<(f32, f32)> {
    let mut finite: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let last = finite.len().checked_sub(1)?;
    let mut at = |q: f64| *finite.select_nth_unstable_by((last as f64 * q).round() as usize, f32::total_cmp).1;
    Some((at(low), at(high)))
}
