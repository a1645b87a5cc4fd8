//! Scans: of a recording, of arrays, of an iterator, to points and a height map in memory or in a folder.

use crate::arrays::{self, picture};
use crate::calibration::parsed;
use crate::fault::{OrRaise, raised, word};
use crate::map::HeightMap;
use crate::poses::{matrix, poses};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::source::PythonSource;
use crate::station::{Station, path, with_station};
use pyo3::prelude::*;
use pyo3::types::PyList;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording;
use sheetlight::scan::{self as engine, RecordingSource, Shots, Source, Where};
use sheetlight::station::{
    HeldScan, ScanOptions, ScanReport, cloud_of, load_report, scan as scan_into, scan_held, scan_recording, shots_of,
};
use std::path::{Path, PathBuf};

/// A finished scan. `points` is a structured array (POINT): x, y, z and sigma in mm in the frame that `frame` names,
/// intensity in grey levels, quality 0 to 1, shot, and the place u, v in that shot's picture in px. `map` is a
/// HeightMap, None where there are too few points. The arrays are read-only and share the engine's memory.
#[pyclass(frozen, module = "sheetlight")]
pub struct Scan {
    /// The points, a structured array POINT, in the order of their shots.
    #[pyo3(get)]
    points: Py<PyAny>,
    /// The height map; None where there are too few points for one.
    #[pyo3(get)]
    map: Option<Py<HeightMap>>,
    /// The scan's folder; None of a scan in memory.
    #[pyo3(get)]
    folder: Option<PathBuf>,
    about: ScanReport,
    shots: Shots,
}

impl Scan {
    fn new(py: Python<'_>, held: HeldScan, folder: Option<PathBuf>) -> PyResult<Scan> {
        let HeldScan { report: about, points, shots, map } = held;
        let map = map.map(|m| Py::new(py, HeightMap::new(py, m)?)).transpose()?;
        Ok(Scan { points: arrays::points(py, points)?, map, folder, about, shots })
    }

    /// The scan without its map, for what searches in the points.
    pub fn held(&self, py: Python<'_>) -> PyResult<HeldScan> {
        let points = arrays::cloud(self.points.bind(py))?;
        Ok(HeldScan { report: self.about.clone(), points, shots: self.shots.clone(), map: None })
    }
}

/// A scan folder's contents, checked to be those that the scan wrote.
pub fn read(folder: &Path) -> Result<HeldScan> {
    let report = load_report(folder)?;
    let (points, shots) = (cloud_of(folder)?, shots_of(folder)?);
    let map = report.height_map.as_ref().map(|_| engine::HeightMap::load(folder)).transpose()?;
    Ok(HeldScan { report, points, shots, map })
}

#[pymethods]
impl Scan {
    /// Reads the folder that a scan wrote. Raises SheetlightError for files that are not those that it wrote.
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf) -> PyResult<Scan> {
        let held = py.detach(|| read(&folder)).or_raise()?;
        Scan::new(py, held, Some(folder))
    }

    /// All that scan.json says: counts, stripe, remarks, settings.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parsed(py, &self.about)
    }

    /// Frame of the points: base, axis, or flange of a robot that carries the part.
    #[getter]
    fn frame(&self) -> String {
        self.about.frame.clone()
    }

    /// Where the camera stood at each shot that was done: (shot, 4 x 4 that takes camera points to the cloud's frame,
    /// mm).
    #[getter]
    fn camera_places<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let all: Vec<_> = self.shots.places().map(|(shot, place)| (shot, matrix(py, &place))).collect();
        PyList::new(py, all)
    }

    /// What the scan says against itself and its calibrations, one sentence each.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.about.remarks.clone()
    }

    fn __repr__(&self) -> String {
        let sigma = self.about.median_sigma_mm.map_or(String::new(), |s| format!(", good to {s:.3} mm"));
        format!("Scan({} points from {} shots{sigma})", self.about.points, self.about.shots)
    }
}

/// What is to be scanned.
enum What {
    Recorded(Box<recording::Recording>, Option<String>),
    Given(PythonSource),
}

/// Scans pictures of the stripe to points and a height map.
///
/// `what` is a Recording or its folder; or pictures, an array of N x rows x columns or any iterable of pictures, with
/// one pose each as `poses`; or an iterable of (picture, pose). Pictures are contiguous uint8, or uint16 with their
/// depth as `bits`. A pose takes the flange's points to the robot's base: a 4 x 4 matrix in mm, an object with
/// as_matrix (scipy's RigidTransform), or (Rotation, [x, y, z]).
///
/// `station` is a Station or its folder. `ambient` is a picture with the laser off and the shots' exposure. `out` is a
/// folder for the files that `sheetlight scan` writes; without it nothing is written. `on` is auto, gpu or cpu.
/// `skip_bad` leaves out shots that cannot be read, `cell_mm` is the edge of the map's cells, `resume` goes on with an
/// interrupted scan of a recording in `out`. `progress(done, all)` is called as shots are done; what it raises ends
/// the scan. Ctrl-C does too.
///
/// Raises SheetlightError for what cannot be scanned: it says what, why, and what to do next.
#[pyfunction]
#[pyo3(signature = (what, station, poses = None, *, bits = None, ambient = None, out = None, on = "auto",
    skip_bad = false, cell_mm = None, resume = false, progress = None))]
pub fn scan(
    py: Python<'_>,
    what: &Bound<'_, PyAny>,
    station: &Bound<'_, PyAny>,
    poses: Option<&Bound<'_, PyAny>>,
    bits: Option<u8>,
    ambient: Option<&Bound<'_, PyAny>>,
    out: Option<PathBuf>,
    on: &str,
    skip_bad: bool,
    cell_mm: Option<f64>,
    resume: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Scan> {
    let progress = Progress::new(progress);
    let place: Where = word(on)?;
    let ambient = ambient.map(|a| picture(a, bits, "the ambient picture")).transpose()?;
    with_station(station, |station| {
        let folder = out.clone().unwrap_or_default();
        let mut options =
            ScanOptions { place, ambient, skip_bad, resume, stop: progress.stop(), ..station.options(&folder) };
        options.grid.cell = cell_mm;
        let what = to_scan(what, poses, bits, resume, &progress)?;
        let told = progress.clone();
        let tell = move |done, all| told.tell(done, all);
        let held = progress.run(py, move || match out {
            None => held(what, station, options, tell),
            Some(_) => filed(what, station, &options, tell),
        })?;
        Scan::new(py, held, (!folder.as_os_str().is_empty()).then_some(folder))
    })
}

fn to_scan(
    what: &Bound<'_, PyAny>,
    given: Option<&Bound<'_, PyAny>>,
    bits: Option<u8>,
    resume: bool,
    progress: &Progress,
) -> PyResult<What> {
    let recorded = match what.cast::<Recording>() {
        Ok(recording) => Some(recording.get().copy()),
        Err(_) if what.extract::<PathBuf>().is_ok() => {
            Some(Recording::load(&path(what, "what", "a recording's folder")?).or_raise()?)
        }
        Err(_) => None,
    };
    let Some(recording) = recorded else {
        if resume {
            return Err(raised(
                Fault::usage("resume is given with pictures that are no recording")
                    .cause("an array or an iterator does not say which of its pictures were done")
                    .next("scan them from the first one, or scan a Recording"),
            ));
        }
        let poses = given.map(poses).transpose()?;
        return Ok(What::Given(PythonSource::new(what, poses, bits, progress.clone())?));
    };
    if given.is_some() || bits.is_some() {
        return Err(raised(
            Fault::usage("poses or bits are given beside a recording")
                .cause("a recording has its own poses and depth")
                .next("leave them out; Recording(folder, poses=NAME) chooses another pose file"),
        ));
    }
    Ok(What::Recorded(Box::new(recording.inner), recording.poses))
}

/// The scan in memory.
fn held(
    what: What,
    station: &Station,
    options: ScanOptions,
    tell: impl FnMut(usize, Option<usize>),
) -> Result<HeldScan> {
    let (label, motion, mut source): (String, _, Box<dyn Source>) = match what {
        What::Recorded(recording, poses) => {
            let source = RecordingSource::open(&recording, poses.as_deref(), 0)?;
            (recording.folder.display().to_string(), recording.meta.motion(), Box::new(source))
        }
        What::Given(source) => (ARRAYS.into(), options.motion.clone(), Box::new(source)),
    };
    scan_held(&label, source.as_mut(), &station.rig, &ScanOptions { motion, ..options }, tell)
}

/// What reports call a scan that is of no recording.
const ARRAYS: &str = "arrays";

/// The scan in its folder, read again.
fn filed(
    what: What,
    station: &Station,
    options: &ScanOptions,
    tell: impl FnMut(usize, Option<usize>),
) -> Result<HeldScan> {
    match what {
        What::Recorded(recording, poses) => {
            scan_recording(&recording, poses.as_deref(), &station.rig, options, tell)?;
        }
        What::Given(source) => {
            scan_into(ARRAYS, ARRAYS, |_| Ok(Box::new(source) as Box<_>), &station.rig, options, tell)?;
        }
    }
    read(&options.out)
}
