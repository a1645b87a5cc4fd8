//! Simulated recordings of a station whose truth is known.

use crate::arrays::xyz;
use crate::fault::{OrRaise, raised, word};
use crate::poses::poses;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::station::Station;
use numpy::PyArray1;
use pyo3::prelude::*;
use sheetlight::fault::Fault;
use sheetlight::geometry::Vec3;
use sheetlight::simulate::{self as engine, Set, SimulateOptions, Truth};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;

/// Simulated recordings, the station with its true calibration, and what is true of them.
#[pyclass(frozen, module = "sheetlight")]
pub struct Simulation {
    folder: PathBuf,
    kept: Option<Arc<TempDir>>,
    made: engine::Simulated,
}

impl Simulation {
    fn set(&self, name: &str) -> PyResult<&Path> {
        let found = self.made.recordings.iter().find(|(set, _, _)| set == name);
        found.map(|(_, folder, _)| folder.as_path()).ok_or_else(|| {
            let names: Vec<&str> = self.made.recordings.iter().map(|r| r.0.as_str()).collect();
            raised(
                Fault::usage(format!("no set '{name}' was simulated: {}", names.join(", "))).next("name one of these"),
            )
        })
    }
}

#[pymethods]
impl Simulation {
    /// Where it lies; a folder that nobody named is there as long as this and its recordings are.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }

    /// Names of the recordings.
    #[getter]
    fn sets(&self) -> Vec<String> {
        self.made.recordings.iter().map(|r| r.0.clone()).collect()
    }

    /// The station with the true calibration.
    #[getter]
    fn station(&self) -> PyResult<Station> {
        Station::load(&self.made.station).or_raise()
    }

    /// A recording by its set.
    #[pyo3(signature = (set = "scan"))]
    fn recording(&self, set: &str) -> PyResult<Recording> {
        let mut recording = Recording::load(self.set(set)?).or_raise()?;
        recording.kept = self.kept.clone();
        Ok(recording)
    }

    /// What is true of a set, as truth.json has it (docs/file-formats.md).
    #[pyo3(signature = (set = "scan"))]
    fn truth<'py>(&self, py: Python<'py>, set: &str) -> PyResult<Bound<'py, PyAny>> {
        let path = self.set(set)?.join("truth.json");
        let text = std::fs::read_to_string(&path).map_err(|e| raised(Fault::read(&path, e)))?;
        py.import("json")?.call_method1("loads", (text,))
    }

    /// Distance of points (a scan's, or N x 3) from the nearest true surface, mm.
    #[pyo3(signature = (points, set = "scan"))]
    fn distances<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'_, PyAny>,
        set: &str,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (places, path) = (xyz(points)?, self.set(set)?.join("truth.json"));
        let far = py.detach(|| {
            let truth = Truth::load(&path)?;
            Ok(places.iter().map(|p| truth.distance(&Vec3::from(*p))).collect())
        });
        Ok(PyArray1::from_vec(py, far.or_raise()?))
    }

    fn __repr__(&self) -> String {
        format!("Simulation({:?}: {})", self.folder, self.sets().join(", "))
    }
}

/// Simulates recordings of a station whose truth is known: pictures, poses, the station with its true calibration.
///
/// `sets` are scan, intrinsics, handeye, laserplane, pointer_cal, pointer, surface. `seed` 0 is the design itself,
/// every other number another specimen. `noise` scales the sensor's noise (0: none). Reported poses err by
/// `pose_noise_mm` and `pose_noise_deg` (1 sigma). `poses` are the flange's for each shot of a scan. Without `folder`
/// all lies in a temporary one. Raises SheetlightError for options out of range.
#[pyfunction]
#[pyo3(signature = (folder = None, *, sets = vec!["scan".to_owned()], shots = 200, size = None, seed = 1, noise = 1.0,
    pose_noise_mm = 0.0, pose_noise_deg = 0.0, scene = None, poses = None, progress = None))]
pub fn simulate(
    py: Python<'_>,
    folder: Option<PathBuf>,
    sets: Vec<String>,
    shots: usize,
    size: Option<(u32, u32)>,
    seed: u64,
    noise: f64,
    pose_noise_mm: f64,
    pose_noise_deg: f64,
    scene: Option<PathBuf>,
    poses: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Simulation> {
    if !(0.0..=100.0).contains(&noise) {
        return Err(raised(Fault::usage(format!("noise is {noise}, allowed 0..=100")).next("1 is a usual sensor")));
    }
    let usual = SimulateOptions::default();
    let (width, height) = size.unwrap_or((usual.width, usual.height));
    let options = SimulateOptions {
        sets: sets.iter().map(|s| word::<Set>(s)).collect::<PyResult<_>>()?,
        shots,
        width,
        height,
        seed,
        pose_noise_mm,
        pose_noise_deg,
        scene,
        poses: poses.map(self::poses).transpose()?,
        ..usual
    }
    .with_noise(noise);
    let kept = match &folder {
        Some(_) => None,
        None => Some(Arc::new(tempfile::tempdir().map_err(|e| raised(Fault::write(&std::env::temp_dir(), e)))?)),
    };
    let folder = folder.or(kept.as_ref().map(|k| k.path().to_owned())).expect("one of both");
    let progress = Progress::new(progress);
    let tell = |done, all| progress.tell(done, Some(all));
    let made = progress.run(py, || engine::simulate(&folder, &options, &tell))?;
    Ok(Simulation { folder, kept, made })
}
