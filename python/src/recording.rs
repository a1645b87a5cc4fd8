//! A recording folder: its pictures as arrays, its poses as matrices.

use crate::arrays::levels;
use crate::fault::OrRaise;
use crate::poses::matrix;
use numpy::PyArray2;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Flange, Rigid};
use sheetlight::recording;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use tempfile::TempDir;

/// A recording folder: meta.json, pictures, poses. It is a sequence of its laser pictures with their poses:
/// `recording[i]` and iteration give (picture, pose), uint8 or uint16 of rows x columns, and 4 x 4 in mm. Raises
/// SheetlightError for a folder that is no recording.
#[pyclass(frozen, module = "sheetlight")]
pub struct Recording {
    pub inner: recording::Recording,
    pub poses: Option<String>,
    /// Of its frames, once somebody asked.
    loaded: OnceLock<Vec<Rigid<Base, Flange>>>,
    /// The folder of a simulation that nobody named: it is there as long as its recordings are.
    pub kept: Option<Arc<TempDir>>,
}

impl Recording {
    pub fn load(folder: &Path) -> Result<Recording> {
        Ok(Recording { inner: recording::Recording::open(folder)?, poses: None, loaded: OnceLock::new(), kept: None })
    }

    /// The same recording, for work without the interpreter.
    pub fn copy(&self) -> Recording {
        let (inner, poses, kept) = (self.inner.clone(), self.poses.clone(), self.kept.clone());
        Recording { inner, poses, loaded: OnceLock::new(), kept }
    }

    fn robot(&self) -> Result<&[Rigid<Base, Flange>]> {
        if self.inner.meta.motion().axis().is_some() {
            return Err(Fault::usage("an axis moved in this recording: its pictures have counts, not poses")
                .next("scan the recording itself: scan(recording, station)"));
        }
        if let Some(poses) = self.loaded.get() {
            return Ok(poses);
        }
        let poses = self.inner.poses(self.poses.as_deref())?;
        Ok(self.loaded.get_or_init(|| poses))
    }

    /// Refuses to give one picture of a pose that has several exposures: its levels are not those that a scan merges.
    fn one_each(&self) -> Result<()> {
        match self.inner.meta.exposures_us.len() {
            0 => Ok(()),
            n => Err(Fault::usage(format!("each pose has {n} pictures of different exposures, not one"))
                .cause("exposures_us in meta.json")
                .next(
                    "scan the recording itself: scan(recording, station); recording.picture(name) reads one picture",
                )),
        }
    }

    /// Frames with the laser on: place in the recording, picture's name.
    fn lit(&self) -> Vec<(usize, &str)> {
        let named = self.inner.meta.frames.iter().enumerate();
        named.filter_map(|(i, f)| Some((i, f.laser.as_deref()?))).collect()
    }
}

#[pymethods]
impl Recording {
    /// `poses` names the pose file where meta.json names none or several.
    #[new]
    #[pyo3(signature = (folder, *, poses = None))]
    fn new(folder: PathBuf, poses: Option<String>) -> PyResult<Recording> {
        let mut recording = Recording::load(&folder).or_raise()?;
        recording.poses = poses;
        Ok(recording)
    }

    /// The folder.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.inner.folder.clone()
    }

    /// (width, height), px.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.inner.meta.image.width, self.inner.meta.image.height)
    }

    /// Depth of the grey levels, 8 to 16.
    #[getter]
    fn bits(&self) -> u8 {
        self.inner.bits()
    }

    /// What meta.json calls the recording.
    #[getter]
    fn name(&self) -> String {
        self.inner.meta.set.clone()
    }

    /// Names of the pictures with the laser on, in order.
    #[getter]
    fn laser(&self) -> Vec<String> {
        self.lit().into_iter().map(|(_, name)| name.to_owned()).collect()
    }

    /// Names of the pictures without laser that frames have, e.g. of boards.
    #[getter]
    fn ambient(&self) -> Vec<String> {
        self.inner.meta.frames.iter().filter_map(|f| f.ambient.clone()).collect()
    }

    /// A picture by its name, rows x columns.
    fn picture<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let image = py.detach(|| self.inner.picture(name)).or_raise()?;
        levels(py, image)
    }

    /// The flange's pose in the base at each laser picture, 4 x 4 in mm. Raises SheetlightError where an axis moved
    /// instead of a robot.
    fn flange_poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let all = self.robot().or_raise()?;
        let list = PyList::empty(py);
        for (frame, _) in self.lit() {
            list.append(matrix(py, self.inner.pose_of(frame, all).or_raise()?))?;
        }
        Ok(list)
    }

    fn __len__(&self) -> usize {
        self.lit().len()
    }

    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        index: isize,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray2<f64>>)> {
        let lit = self.lit();
        let at = if index < 0 { index + lit.len() as isize } else { index };
        let Some(&(frame, name)) = usize::try_from(at).ok().and_then(|i| lit.get(i)) else {
            return Err(PyIndexError::new_err(format!("picture {index} of {}", lit.len())));
        };
        self.one_each().or_raise()?;
        let pose = self.inner.pose_of(frame, self.robot().or_raise()?).or_raise()?;
        Ok((self.picture(py, name)?, matrix(py, pose)))
    }

    fn __repr__(&self) -> String {
        let (w, h) = self.size();
        format!("Recording({:?}, {} laser pictures of {w}x{h})", self.inner.folder, self.lit().len())
    }
}
