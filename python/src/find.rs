//! Parts in scans: found, taught.

use crate::calibration::parsed;
use crate::fault::{OrRaise, raised, word};
use crate::poses::matrix;
use crate::scan::{Scan, read};
use crate::station::{path, with_station};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sheetlight::fault::Fault;
use sheetlight::find::insert::recipe::InsertionSpec;
use sheetlight::find::insert::teach::TeachOptions;
use sheetlight::find::{LocateOptions, Report};
use sheetlight::raster::RgbImage;
use sheetlight::robot::Convention;
use sheetlight::station::{HeldScan, find_part_held, teach_held};
use std::path::PathBuf;

/// A recipe: what a part looks like and where the tool goes.
#[pyclass(frozen, module = "sheetlight")]
pub struct Recipe(sheetlight::find::Recipe);

#[pymethods]
impl Recipe {
    /// Reads a recipe's file (TOML).
    #[new]
    fn new(file: PathBuf) -> PyResult<Recipe> {
        Ok(Recipe(sheetlight::find::Recipe::load(&file).or_raise()?))
    }

    /// A recipe from its text (TOML).
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Recipe> {
        Ok(Recipe(sheetlight::find::Recipe::parse(text).or_raise()?))
    }

    /// The part's name.
    #[getter]
    fn name(&self) -> String {
        self.0.name.clone()
    }

    /// The recipe as its file would have it (TOML).
    #[getter]
    fn text(&self) -> String {
        toml::to_string(&self.0).expect("plain data")
    }

    fn __repr__(&self) -> String {
        format!("Recipe({:?})", self.0.name)
    }
}

/// What was found out about a part. There are poses for the robot only where every gate was passed.
#[pyclass(frozen, module = "sheetlight")]
pub struct Found {
    report: Report,
    picture: RgbImage,
}

#[pymethods]
impl Found {
    /// Whether every gate was passed.
    #[getter]
    fn passed(&self) -> bool {
        self.report.passed
    }

    /// Which gates failed; empty when passed.
    #[getter]
    fn reasons(&self) -> Vec<String> {
        self.report.reasons.clone()
    }

    /// The part as measured: 4 x 4 that takes its points to the scan's frame, mm.
    #[getter]
    fn base_from_part<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        matrix(py, &self.report.base_from_part)
    }

    /// Where the tool goes: 4 x 4 that takes the tool's points to the base, mm; None where a gate failed.
    #[getter]
    fn insertion<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        self.report.poses.as_ref().map(|p| matrix(py, &p.insertion.base_from_tool))
    }

    /// Insertion, approach and retract in the notation that was asked for, by name; None where a gate failed.
    #[getter]
    fn numbers<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(poses) = &self.report.poses else { return Ok(None) };
        let all = PyDict::new(py);
        for (name, pose) in
            [("insertion", &poses.insertion), ("approach", &poses.approach), ("retract", &poses.retract)]
        {
            all.set_item(name, pose.numbers.clone())?;
        }
        Ok(Some(all))
    }

    /// One standard deviation along x, y, z of the part, mm.
    #[getter]
    fn sigma_mm(&self) -> [f64; 3] {
        self.report.sigma_mm
    }

    /// One standard deviation of the turns about x, y, z of the part, degrees.
    #[getter]
    fn sigma_deg(&self) -> [f64; 3] {
        self.report.sigma_deg
    }

    /// What else a reader must know, one sentence each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.report.notes.clone()
    }

    /// All that was found out, as `sheetlight find` writes it.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parsed(py, &self.report)
    }

    /// A picture of the height map with the part drawn in: rows x columns x 3, uint8.
    #[getter]
    fn picture<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let flat = PyArray1::from_slice(py, self.picture.pixels.as_flattened());
        flat.call_method1("reshape", ((self.picture.height, self.picture.width, 3),))
    }

    fn __repr__(&self) -> String {
        let said = if self.report.passed { "found".into() } else { self.report.reasons.join("; ") };
        format!("Found({}: {said})", self.report.recipe)
    }
}

/// A Scan, or a scan's folder.
fn scanned(object: &Bound<'_, PyAny>) -> PyResult<HeldScan> {
    match object.cast::<Scan>() {
        Ok(scan) => scan.get().held(object.py()),
        Err(_) => {
            let folder = path(object, "scan", "a Scan or a scan's folder")?;
            object.py().detach(|| read(&folder)).or_raise()
        }
    }
}

/// Finds a recipe's part in a scan (a Scan or its folder).
///
/// `recipe` is a Recipe or its file. With `station`, the one that scanned, the uncertainty holds the calibrations'
/// share. `notation` is that of `numbers` (see notations()); `all` lists every place that looks like the part in
/// `report`. Raises SheetlightError where the part is not there or is seen too badly to be measured; a part that
/// misses a gate is Found without poses.
#[pyfunction]
#[pyo3(signature = (scan, recipe, station = None, *, notation = "matrix", all = false))]
pub fn find(
    py: Python<'_>,
    scan: &Bound<'_, PyAny>,
    recipe: &Bound<'_, PyAny>,
    station: Option<&Bound<'_, PyAny>>,
    notation: &str,
    all: bool,
) -> PyResult<Found> {
    let held = scanned(scan)?;
    let recipe = match recipe.cast::<Recipe>() {
        Ok(recipe) => recipe.get().0.clone(),
        Err(_) => sheetlight::find::Recipe::load(&path(recipe, "recipe", "a Recipe or its file")?).or_raise()?,
    };
    let options = LocateOptions { robot: word::<Convention>(notation)?, all, ..LocateOptions::default() };
    let search = |rig: Option<&sheetlight::rig::Rig>| {
        py.detach(|| find_part_held(&held, &recipe, rig, &options)).map(|(report, picture)| Found { report, picture })
    };
    match station {
        Some(station) => with_station(station, |s| search(Some(&s.rig)).or_raise()),
        None => search(None).or_raise(),
    }
}

/// Teaches a part from a scan (a Scan or its folder): the recipe, and its proof on that scan.
///
/// All lengths are mm in the scan's height map, from its corner, x along columns: `outline` is (x0, y0, x1, y1) of the
/// body before it is turned by `angle_deg` about its centre; `windows` are such corners, `holes` (x, y, radius). The
/// insertion bears `tolerance_mm` and `tolerance_deg`. Raises SheetlightError for an outline outside the map, or one
/// that shows no part.
#[pyfunction]
#[pyo3(signature = (scan, name, outline, *, angle_deg = 0.0, windows = vec![], holes = vec![], tolerance_mm = 0.25,
    tolerance_deg = 0.5, approach_mm = 30.0, retract_mm = 60.0))]
pub fn teach(
    py: Python<'_>,
    scan: &Bound<'_, PyAny>,
    name: String,
    outline: [f64; 4],
    angle_deg: f64,
    windows: Vec<[f64; 4]>,
    holes: Vec<[f64; 3]>,
    tolerance_mm: f64,
    tolerance_deg: f64,
    approach_mm: f64,
    retract_mm: f64,
) -> PyResult<(Recipe, Found)> {
    if name.is_empty() {
        return Err(raised(Fault::usage("the part has no name").next("give it one")));
    }
    let held = scanned(scan)?;
    let insertion = InsertionSpec::at_the_part((tolerance_mm, tolerance_deg), approach_mm, retract_mm);
    let options = TeachOptions { name, outline, angle_deg, windows, holes, insertion };
    let (recipe, report, picture) = py.detach(|| teach_held(&held, &options)).or_raise()?;
    Ok((Recipe(recipe), Found { report, picture }))
}
