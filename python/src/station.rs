//! A station: what a person chose and what was measured of a rig.

use crate::calibration::{Any, Calibration};
use crate::camera::Camera;
use crate::fault::{OrRaise, raised};
use crate::poses::pose;
use pyo3::prelude::*;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Camera as CameraFrame, Flange};
use sheetlight::rig::Rig;
use sheetlight::station::{PlaneValue, ScanOptions, Settings, Sigmas, Values};
use std::path::{Path, PathBuf};

/// A station folder, read when this is made: station.toml and the calibrations. Raises SheetlightError for files that
/// are damaged.
#[pyclass(frozen, module = "sheetlight")]
pub struct Station {
    pub folder: Option<PathBuf>,
    pub settings: Settings,
    pub rig: Rig,
}

impl Station {
    pub fn load(folder: &Path) -> Result<Station> {
        Ok(Station { settings: Settings::load(folder)?, rig: Rig::load(folder)?, folder: Some(folder.to_owned()) })
    }

    pub fn options(&self, out: &Path) -> ScanOptions {
        ScanOptions::for_station(&self.settings, &self.rig, out)
    }
}

/// A Station, or the folder of one.
pub fn with_station<T>(object: &Bound<'_, PyAny>, use_it: impl FnOnce(&Station) -> PyResult<T>) -> PyResult<T> {
    if let Ok(station) = object.cast::<Station>() {
        return use_it(station.get());
    }
    let folder = path(object, "station", "a Station or a station's folder")?;
    use_it(&Station::load(&folder).or_raise()?)
}

/// A path that Python gives as text or as a Path.
pub fn path(object: &Bound<'_, PyAny>, name: &str, wanted: &str) -> PyResult<PathBuf> {
    object.extract::<PathBuf>().map_err(|_| {
        let is = crate::arrays::type_name(object);
        raised(Fault::usage(format!("{name} is a {is}, {wanted} is needed")).next("see help(sheetlight)"))
    })
}

#[pymethods]
impl Station {
    #[new]
    fn new(folder: PathBuf) -> PyResult<Station> {
        Station::load(&folder).or_raise()
    }

    /// A station of values that are known from elsewhere, e.g. from OpenCV: the camera, the laser plane `normal . X =
    /// offset_mm` in the camera's frame (mm), and the 4 x 4 pose of the camera on the flange or in the base (mm). The
    /// values count as known as well as such calibrations usually are, and their remarks say so. With `folder` they
    /// are stored there.
    #[staticmethod]
    #[pyo3(signature = (camera, normal, offset_mm, *, flange_from_camera = None, base_from_camera = None,
        folder = None))]
    fn from_values(
        camera: &Camera,
        normal: [f64; 3],
        offset_mm: f64,
        flange_from_camera: Option<&Bound<'_, PyAny>>,
        base_from_camera: Option<&Bound<'_, PyAny>>,
        folder: Option<PathBuf>,
    ) -> PyResult<Station> {
        let in_flange = flange_from_camera.map(|p| pose::<Flange, CameraFrame>(p, "flange_from_camera")).transpose()?;
        let in_base = base_from_camera.map(|p| pose::<Base, CameraFrame>(p, "base_from_camera")).transpose()?;
        let values = Values {
            intrinsics: Some(camera.0),
            laser_plane_camera: Some(PlaneValue { normal, offset_mm }),
            flange_from_camera: in_flange.map(|p| p.to_rows()),
            base_from_camera: in_base.map(|p| p.to_rows()),
            ..Values::default()
        };
        stored(&values, folder.as_deref()).or_raise()
    }

    /// The folder; None of a station of values in memory.
    #[getter]
    fn folder(&self) -> Option<PathBuf> {
        self.folder.clone()
    }

    /// The camera's calibration, or None.
    #[getter]
    fn camera(&self) -> Option<Calibration> {
        self.rig.camera.clone().map(|c| Calibration::of(Any::Camera(c)))
    }

    /// The laser plane's calibration, or None.
    #[getter]
    fn laser_plane(&self) -> Option<Calibration> {
        self.rig.laser_plane.clone().map(|c| Calibration::of(Any::LaserPlane(c)))
    }

    /// The pointer's calibration, or None.
    #[getter]
    fn pointer(&self) -> Option<Calibration> {
        self.rig.pointer.clone().map(|c| Calibration::of(Any::Pointer(c)))
    }

    /// The calibration of the camera on the flange, or None.
    #[getter]
    fn hand_eye(&self) -> Option<Calibration> {
        self.rig.hand_eye.clone().map(|c| Calibration::of(Any::HandEye(c)))
    }

    /// The calibration of a camera that stands still before a robot, or None.
    #[getter]
    fn base_camera(&self) -> Option<Calibration> {
        self.rig.base_camera.clone().map(|c| Calibration::of(Any::BaseCamera(c)))
    }

    /// The calibration of a linear axis, or None.
    #[getter]
    fn linear_axis(&self) -> Option<Calibration> {
        self.rig.linear_axis.clone().map(|c| Calibration::of(Any::Axis(c)))
    }

    /// The calibration of a turntable, or None.
    #[getter]
    fn turntable(&self) -> Option<Calibration> {
        self.rig.turntable.clone().map(|c| Calibration::of(Any::Axis(c)))
    }

    fn __repr__(&self) -> String {
        let of = |kinds: Vec<&dyn sheetlight::rig::Record>| {
            kinds.iter().map(|r| r.kind().name()).collect::<Vec<_>>().join(", ")
        };
        format!("Station({:?}, {})", self.folder.as_deref().unwrap_or(Path::new("")), of(self.rig.records()))
    }
}

/// Values as calibrations, checked as an import checks them; kept in `folder` where one is named.
fn stored(values: &Values, folder: Option<&Path>) -> Result<Station> {
    let aside = tempfile::tempdir().map_err(|e| Fault::write(&std::env::temp_dir(), e))?;
    let source = aside.path().join("values.json");
    let text = serde_json::to_string(values).expect("plain data");
    std::fs::write(&source, text).map_err(|e| Fault::write(&source, e))?;
    let station = folder.unwrap_or(aside.path());
    values.store(station, &source, false, &Sigmas::default())?;
    Ok(Station { folder: folder.map(Path::to_owned), ..Station::load(station)? })
}
