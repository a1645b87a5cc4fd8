//! A height map as arrays.

use crate::arrays::rows;
use crate::poses::matrix;
use numpy::PyArray2;
use pyo3::prelude::*;
use sheetlight::geometry::{Base, Grid, Rigid};
use sheetlight::scan;

/// Heights on a regular grid: arrays of rows x columns, row 0 at the smallest y. The centre of cell [j, i] lies at ((i
/// + 0.5) cell_mm, (j + 0.5) cell_mm) in the grid's frame. The arrays are read-only.
#[pyclass(frozen, module = "sheetlight")]
pub struct HeightMap {
    /// Height above the grid's plane, mm, float32; NaN where nothing was measured.
    #[pyo3(get)]
    z: Py<PyAny>,
    /// Standard deviation of the height, mm, float32; NaN where nothing was measured.
    #[pyo3(get)]
    sigma: Py<PyAny>,
    /// Mean brightness of the stripe, grey levels, float32; NaN where nothing was measured.
    #[pyo3(get)]
    intensity: Py<PyAny>,
    /// Points in the cell, uint32.
    #[pyo3(get)]
    count: Py<PyAny>,
    /// Edge of a cell, mm.
    #[pyo3(get)]
    cell_mm: f64,
    place: Rigid<Base, Grid>,
    size: [u32; 2],
}

impl HeightMap {
    pub fn new(py: Python<'_>, map: scan::HeightMap) -> PyResult<HeightMap> {
        let size = [map.width, map.height];
        Ok(HeightMap {
            z: rows(py, map.z, size)?,
            sigma: rows(py, map.sigma, size)?,
            intensity: rows(py, map.intensity, size)?,
            count: rows(py, map.count, size)?,
            cell_mm: map.cell,
            place: map.base_from_grid,
            size,
        })
    }
}

#[pymethods]
impl HeightMap {
    /// 4 x 4: takes points of the grid's frame to the cloud's, mm.
    #[getter]
    fn base_from_grid<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        matrix(py, &self.place)
    }

    /// (rows, columns).
    #[getter]
    fn shape(&self) -> (u32, u32) {
        (self.size[1], self.size[0])
    }

    fn __repr__(&self) -> String {
        format!("HeightMap({} rows x {} columns of {} mm)", self.size[1], self.size[0], self.cell_mm)
    }
}
