//! A pinhole camera with its lens, in the engine's terms and in OpenCV's, which are the same fourteen.

use crate::arrays::{as_floats, vectors};
use crate::fault::{OrRaise, raised};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sheetlight::camera::{Distortion, Intrinsics};
use sheetlight::fault::Fault;
use sheetlight::geometry::{Vec2, Vec3};

/// A camera with its lens: focal lengths and principal point in px (an integer is a pixel's centre), OpenCV's
/// distortion terms.
#[pyclass(frozen, module = "sheetlight")]
pub struct Camera(pub Intrinsics);

#[pymethods]
impl Camera {
    /// A camera from OpenCV's 3 x 3 matrix, its 4, 5, 8, 12 or 14 distortion terms and the size (width, height) in px.
    #[staticmethod]
    fn from_opencv(matrix: &Bound<'_, PyAny>, distortion: &Bound<'_, PyAny>, size: (u32, u32)) -> PyResult<Camera> {
        let matrix = as_floats(matrix, "the camera matrix")?;
        let shape = matrix.shape().to_vec();
        let k: Vec<f64> = matrix.readonly().as_array().iter().copied().collect();
        let (fx, skew, cx, fy, cy) = match (&shape[..], &k[..]) {
            ([3, 3], &[fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]) => (fx, skew, cx, fy, cy),
            _ => {
                return Err(raised(
                    Fault::input(format!("the camera matrix has the shape {shape:?} and the numbers {k:?}"))
                        .cause("another matrix, or one written column by column")
                        .next("give [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]"),
                ));
            }
        };
        let terms: Vec<f64> = as_floats(distortion, "the distortion")?.readonly().as_array().iter().copied().collect();
        let Some(distortion) = Distortion::from_opencv(&terms) else {
            return Err(raised(
                Fault::input(format!(
                    "the distortion has {} terms, OpenCV's lists have 4, 5, 8, 12 or 14",
                    terms.len()
                ))
                .next("give what cv2.calibrateCamera returned"),
            ));
        };
        let camera = Intrinsics { fx, fy, cx, cy, skew, distortion, width: size.0, height: size.1 };
        camera.check().or_raise()?;
        Ok(Camera(camera))
    }

    /// OpenCV's camera matrix, 3 x 3, px.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let k = &self.0;
        let rows = [k.fx, k.skew, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0];
        PyArray1::from_slice(py, &rows).reshape([3, 3])
    }

    /// OpenCV's distortion terms: the shortest of its lists (5, 8, 12 or 14) that holds all that are not zero.
    #[getter]
    fn distortion<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.distortion.to_opencv())
    }

    /// (width, height), px.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.0.width, self.0.height)
    }

    /// Pixels (N x 2) of points (N x 3, camera frame, mm); NaN behind the camera.
    fn project<'py>(&self, py: Python<'py>, points: &Bound<'_, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pixel = |p: [f64; 3]| self.0.pixel_from_point(&Vec3::from(p)).map_or([f64::NAN; 2], Into::into);
        rows(py, vectors(points, "points")?.into_iter().map(pixel).collect())
    }

    /// Unit vectors (N x 3, camera frame) towards what pixels (N x 2) see; NaN where the lens has no ray.
    fn rays<'py>(&self, py: Python<'py>, pixels: &Bound<'_, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let ray = |p: [f64; 2]| self.0.ray_from_pixel(&Vec2::from(p)).map_or([f64::NAN; 3], |r| r.direction.into());
        rows(py, vectors(pixels, "pixels")?.into_iter().map(ray).collect())
    }

    fn __repr__(&self) -> String {
        let k = &self.0;
        format!("Camera({}x{}, fx {:.2}, fy {:.2}, cx {:.2}, cy {:.2} px)", k.width, k.height, k.fx, k.fy, k.cx, k.cy)
    }
}

/// One row an entry.
pub fn rows<const N: usize>(py: Python<'_>, values: Vec<[f64; N]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let n = values.len();
    PyArray1::from_vec(py, values.into_flattened()).reshape([n, N])
}
