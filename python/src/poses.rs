//! Poses between Python and the engine: 4 x 4 matrices in mm, scipy's rotations with a place, the notations of robots.

use crate::arrays::{as_floats, type_name};
use crate::fault::{OrRaise, raised, raised_by, word};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use sheetlight::fault::Fault;
use sheetlight::geometry::{Base, Flange, Frame, ORTHONORMAL_WARN, Rigid};
use sheetlight::recording::looks_like_metres;
use sheetlight::robot::Convention;

/// A pose: a 4 x 4 matrix (or what has `as_matrix`, as scipy's RigidTransform), or a pair of a rotation (3 x 3 or
/// scipy's Rotation) and a place, mm.
pub fn pose<A: Frame, B: Frame>(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Rigid<A, B>> {
    let rows = match object.cast::<PyTuple>() {
        Ok(pair) if pair.len() == 2 => {
            let (turn, place) = (numbers(&pair.get_item(0)?, name)?, numbers(&pair.get_item(1)?, name)?);
            let (Ok(r), Ok(t)) = (<[f64; 9]>::try_from(turn), <[f64; 3]>::try_from(place)) else {
                return Err(shape(name, "a pair of other sizes"));
            };
            [r[0], r[1], r[2], t[0], r[3], r[4], r[5], t[1], r[6], r[7], r[8], t[2], 0.0, 0.0, 0.0, 1.0]
        }
        _ => {
            let given = numbers(object, name)?;
            let n = given.len();
            <[f64; 16]>::try_from(given).map_err(|_| shape(name, &format!("{n} numbers")))?
        }
    };
    let (rigid, departure) = Rigid::from_rows(&rows).map_err(|e| e.at(name)).or_raise()?;
    if departure > ORTHONORMAL_WARN {
        let text = format!("{name}: the rotation was repaired, it was {departure:.1e} from orthonormal");
        let kind = object.py().get_type::<pyo3::exceptions::PyUserWarning>();
        object.py().import("warnings")?.call_method1("warn", (text, kind))?;
    }
    Ok(rigid)
}

fn shape(name: &str, is: &str) -> PyErr {
    raised(
        Fault::input(format!("{name} is {is}, a 4 x 4 matrix is needed"))
            .cause("a rotation without its place, or a pose in a robot's own notation")
            .next(
                "give a 4 x 4 matrix in mm, (Rotation, [x, y, z]), or sheetlight.pose_from_numbers(numbers, notation)",
            ),
    )
}

/// The numbers of a matrix, row by row.
fn numbers(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let matrix = if object.hasattr("as_matrix")? {
        object.call_method0("as_matrix").map_err(|error| {
            let kind = type_name(object);
            raised_by(error, |said| Fault::input(format!("{name}: a {kind} gave no matrix: {said}")))
        })?
    } else {
        object.clone()
    };
    let array = as_floats(&matrix, name)?;
    let fits = matches!(array.shape(), [4, 4] | [3, 3] | [3]);
    if !fits {
        return Err(shape(name, &format!("of the shape {:?}", array.shape())));
    }
    Ok(array.readonly().as_array().iter().copied().collect())
}

/// Poses of a stack or a sequence.
pub fn poses(object: &Bound<'_, PyAny>) -> PyResult<Vec<Rigid<Base, Flange>>> {
    let all = object.try_iter().map_err(|error| {
        raised_by(error, |_| {
            Fault::input(format!("poses is a {}, one pose a picture is needed", type_name(object)))
                .next("give an array of N x 4 x 4, or a list of poses")
        })
    })?;
    let one = |(i, one): (usize, PyResult<Bound<'_, PyAny>>)| {
        let one = one.map_err(|error| {
            raised_by(error, |said| {
                Fault::input(format!("the poses ended at pose {i}: {said}"))
                    .cause("the code that gives them raised an exception")
                    .next("see the exception that this one names as its cause")
            })
        })?;
        pose(&one, &format!("pose {i}"))
    };
    let poses = all.enumerate().map(one).collect::<PyResult<Vec<_>>>()?;
    if let Some(said) = looks_like_metres(&poses) {
        let kind = object.py().get_type::<pyo3::exceptions::PyUserWarning>();
        object.py().import("warnings")?.call_method1("warn", (said, kind))?;
    }
    Ok(poses)
}

/// A 4 x 4 array.
pub fn matrix<'py, A: Frame, B: Frame>(py: Python<'py>, rigid: &Rigid<A, B>) -> Bound<'py, PyArray2<f64>> {
    let rows = PyArray1::from_slice(py, &rigid.to_rows());
    rows.reshape([4, 4]).expect("16 numbers")
}

/// Names of the robots' pose notations, each with the labels and units of its numbers.
#[pyfunction]
pub fn notations(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let all = PyDict::new(py);
    for notation in Convention::ALL {
        all.set_item(notation.name(), PyTuple::new(py, notation.labels())?)?;
    }
    Ok(all)
}

/// The 4 x 4 matrix, mm, of a pose in a robot's notation (see notations()). Raises SheetlightError for another number
/// of numbers.
#[pyfunction]
pub fn pose_from_numbers<'py>(
    py: Python<'py>,
    numbers: Vec<f64>,
    notation: &str,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rigid = word::<Convention>(notation)?.read::<Base, Flange>(&numbers).or_raise()?;
    Ok(matrix(py, &rigid))
}

/// A pose in a robot's notation (see notations()); the pose is a 4 x 4 matrix in mm, or as in scan().
#[pyfunction]
pub fn numbers_from_pose(pose: &Bound<'_, PyAny>, notation: &str) -> PyResult<Vec<f64>> {
    let rigid = self::pose::<Base, Flange>(pose, "the pose")?;
    Ok(word::<Convention>(notation)?.write(&rigid))
}
