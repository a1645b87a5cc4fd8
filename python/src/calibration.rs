//! A calibration as Python sees it: the value, how well it is known, what the solver says of it.

use crate::camera::{Camera, rows};
use crate::fault::{OrRaise, raised};
use crate::poses::matrix;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sheetlight::camera::Intrinsics;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Axis, Base, Camera as CameraFrame, Plane, Ray, Rigid};
use sheetlight::rig::{self, Covariance, HandEye, Kind, Quality, Rig, Verdict};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A calibration of any kind.
pub enum Any {
    Camera(rig::Calibration<Intrinsics>),
    LaserPlane(rig::Calibration<Plane<CameraFrame>>),
    Pointer(rig::Calibration<Ray<CameraFrame>>),
    HandEye(rig::Calibration<HandEye>),
    BaseCamera(rig::Calibration<Rigid<Base, CameraFrame>>),
    Axis(rig::Calibration<Axis>),
}

/// The same expression of whatever kind it is.
macro_rules! each {
    ($any:expr, $c:ident => $what:expr) => {
        match $any {
            Any::Camera($c) => $what,
            Any::LaserPlane($c) => $what,
            Any::Pointer($c) => $what,
            Any::HandEye($c) => $what,
            Any::BaseCamera($c) => $what,
            Any::Axis($c) => $what,
        }
    };
}

impl Any {
    fn kind(&self) -> Kind {
        each!(self, c => c.kind)
    }
    fn quality(&self) -> &Quality {
        each!(self, c => &c.quality)
    }
    fn covariance(&self) -> &Covariance {
        each!(self, c => &c.covariance)
    }
}

/// What a calibration adds for plots and people.
#[derive(Default)]
pub struct Beside {
    /// The report, HTML.
    pub page: Option<String>,
    /// Pictures that could not be used, with the reason.
    pub left_out: Vec<(String, String)>,
    /// Of each picture the features: u, v, residual in u and v, px.
    pub residuals: Vec<(String, Vec<[f64; 4]>)>,
}

/// A calibration: value, covariance, verdict, and what the solver says of it. Lengths are mm, angles rad, pixels px.
#[pyclass(frozen, module = "sheetlight")]
pub struct Calibration {
    any: Any,
    beside: Beside,
}

impl Calibration {
    pub fn new(any: Any, beside: Beside) -> Calibration {
        Calibration { any, beside }
    }
    pub fn of(any: Any) -> Calibration {
        Calibration::new(any, Beside::default())
    }
}

#[pymethods]
impl Calibration {
    /// What was calibrated: camera, laser_plane, pointer, hand_eye, base_camera, linear_axis or turntable.
    #[getter]
    fn kind(&self) -> &'static str {
        self.any.kind().name()
    }

    /// The value: a Camera; of a plane {normal (3), offset_mm}, of a pointer {origin_mm (3), direction (3)}, both in
    /// the camera's frame; a 4 x 4 matrix that takes camera points to the flange (hand_eye) or the base (base_camera),
    /// mm; an axis' numbers as its file has them.
    #[getter]
    fn value<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let dict = PyDict::new(py);
        match &self.any {
            Any::Camera(c) => return Ok(Bound::new(py, Camera(c.value))?.into_any()),
            Any::HandEye(c) => return Ok(matrix(py, &c.value).into_any()),
            Any::BaseCamera(c) => return Ok(matrix(py, &c.value).into_any()),
            Any::LaserPlane(c) => {
                dict.set_item("normal", PyArray1::from_slice(py, c.value.normal.as_slice()))?;
                dict.set_item("offset_mm", c.value.offset)?;
            }
            Any::Pointer(c) => {
                dict.set_item("origin_mm", PyArray1::from_slice(py, c.value.origin.as_slice()))?;
                dict.set_item("direction", PyArray1::from_slice(py, c.value.direction.as_slice()))?;
            }
            Any::Axis(c) => return parsed(py, &c.value),
        }
        Ok(dict.into_any())
    }

    /// Names of the covariance's parameters, each ending with its unit; empty where nothing is known.
    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.any.covariance().parameters.clone()
    }

    /// Covariance, parameters x parameters, in their units.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(PyArray2::from_vec2(py, &self.any.covariance().matrix)?)
    }

    /// Standard deviation of one of `parameters`, None where nothing is known. Raises SheetlightError for another name.
    fn sigma(&self, parameter: &str) -> PyResult<Option<f64>> {
        let known = &self.any.covariance().parameters;
        if known.is_empty() || known.iter().any(|name| name == parameter) {
            return Ok(self.any.covariance().sigma(parameter));
        }
        let what = format!("the calibration has no parameter '{parameter}': {}", known.join(", "));
        Err(raised(Fault::usage(what).next("give one of these names, with its unit")))
    }

    /// good, usable, badly determined or refused.
    #[getter]
    fn verdict(&self) -> &'static str {
        self.any.quality().verdict.words()
    }

    /// Why, one sentence each.
    #[getter]
    fn reasons(&self) -> Vec<String> {
        self.any.quality().reasons.clone()
    }

    /// The next best pictures to take; empty when nothing is missing.
    #[getter]
    fn advice(&self) -> Vec<String> {
        self.any.quality().advice.clone()
    }

    /// Named figures with their unit in the name, e.g. rms_px.
    #[getter]
    fn figures(&self) -> BTreeMap<String, f64> {
        self.any.quality().figures.clone()
    }

    /// Of each picture or pose its name and rms residual, in the unit of `figures`.
    #[getter]
    fn per_picture(&self) -> Vec<(String, f64)> {
        self.any.quality().per_picture.clone()
    }

    /// What a person vouched for, and what an import assumed.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        each!(&self.any, c => c.remarks.clone())
    }

    /// SHA-256 of everything that went in, by name.
    #[getter]
    fn inputs(&self) -> BTreeMap<String, String> {
        each!(&self.any, c => c.inputs.clone())
    }

    /// When it was made, RFC 3339.
    #[getter]
    fn created(&self) -> String {
        each!(&self.any, c => c.created.clone())
    }

    /// Pictures that were not used, with the reason.
    #[getter]
    fn left_out(&self) -> Vec<(String, String)> {
        self.beside.left_out.clone()
    }

    /// Of a camera's calibration, for plots: by picture N x 4 of u, v and the residual (seen minus predicted) in both,
    /// px.
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, features) in &self.beside.residuals {
            all.set_item(name, rows(py, features.clone())?)?;
        }
        Ok(all)
    }

    /// The report as a web page that loads nothing; None of a calibration that was read from a station.
    #[getter]
    fn page(&self) -> Option<String> {
        self.beside.page.clone()
    }

    /// Stores it in a station's folder; the former one stays beside it. A badly determined one is refused unless kept
    /// on purpose.
    #[pyo3(signature = (station, *, keep_badly_determined = false))]
    fn store(&self, station: PathBuf, keep_badly_determined: bool) -> PyResult<PathBuf> {
        let q = self.any.quality();
        if q.verdict >= Verdict::BadlyDetermined && !keep_badly_determined {
            let what = format!("the {} is {}: {}", self.any.kind().words(), q.verdict.words(), q.reasons.join("; "));
            return Err(raised(
                Fault::refused(what)
                    .cause("too few, too similar or contradicting pictures; the station keeps its former calibration")
                    .next(q.advice.first().map_or("take more pictures", String::as_str)),
            ));
        }
        let page = self.beside.page.as_deref();
        let stored: Result<PathBuf> = each!(&self.any, c => Rig::store(&station, c, page));
        stored.or_raise()
    }

    fn __repr__(&self) -> String {
        format!("Calibration({}, {})", self.kind(), self.verdict())
    }
}

/// What the engine writes as JSON, as Python's own objects.
pub fn parsed<'py>(py: Python<'py>, value: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).expect("plain data");
    py.import("json")?.call_method1("loads", (text,))
}
