//! Takes pictures from numpy arrays, and gives points and maps as numpy arrays that take over the engine's memory.

use crate::fault::{OrRaise, raised};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sheetlight::capture::Format;
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::Image;
use sheetlight::scan::CloudPoint;

/// The module that names the fields of structured arrays.
const DTYPES: &str = "sheetlight._dtypes";

/// A picture: rows x columns of uint8, or of uint16 with the sensor's depth. Its levels are copied once.
pub fn picture(array: &Bound<'_, PyAny>, bits: Option<u8>, name: &str) -> PyResult<Image> {
    image(array, bits).map_err(|e| e.at(name)).or_raise()
}

fn image(array: &Bound<'_, PyAny>, bits: Option<u8>) -> Result<Image> {
    let Ok(untyped) = array.cast::<PyUntypedArray>() else {
        return Err(Fault::input(format!("is a {}, a numpy array is needed", type_name(array)))
            .cause("a picture's file name or a list")
            .next("give an array of rows x columns, uint8 or uint16"));
    };
    // Its levels under the mask would count like all others.
    if array.hasattr("mask").unwrap_or(false) {
        return Err(Fault::input(format!("is a {}: masks of pictures are not used", type_name(array)))
            .cause("some of its pixels are marked as bad")
            .next("give picture.filled(0): what is black is no stripe; or leave the picture out"));
    }
    let shape = untyped.shape();
    let &[height, width] = shape else {
        return Err(Fault::input(format!("has the shape {shape:?}, rows x columns are needed"))
            .cause("a colour picture, or a stack of pictures")
            .next("give one channel of one picture, e.g. np.ascontiguousarray(picture[..., 1])"));
    };
    if height == 0 || width == 0 || !untyped.is_c_contiguous() {
        let strides = untyped.strides();
        return Err(Fault::input(format!(
            "has the shape {shape:?} and strides {strides:?}: its rows do not follow each other"
        ))
        .cause("an empty array, or a part or another view of one")
        .next("give np.ascontiguousarray(picture)"));
    }
    let size = [width, height].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    if let Ok(levels) = array.extract::<PyReadonlyArray2<u8>>() {
        if bits.is_some_and(|b| b != 8) {
            return Err(depth_of(8, bits));
        }
        return Ok(Image::from_u8(size[0], size[1], levels.as_slice().expect("contiguous").to_vec()));
    }
    if let Ok(levels) = array.extract::<PyReadonlyArray2<u16>>() {
        let Some(bits @ 9..=16) = bits else { return Err(depth_of(16, bits)) };
        let levels = levels.as_slice().expect("contiguous").to_vec();
        let (most, full) = (levels.iter().max().copied().unwrap_or(0), ((1u32 << bits) - 1) as u16);
        if most > full {
            return Err(Fault::input(format!("holds the level {most}, {bits} bits reach to {full}"))
                .cause("the levels are stretched to 16 bits, or of a deeper sensor")
                .next("state the depth of the array's levels as bits"));
        }
        return Ok(Image::from_u16(size[0], size[1], bits, levels));
    }
    let dtype = untyped.dtype();
    Err(Fault::input(format!("is of dtype '{dtype}', uint8 or uint16 in this machine's byte order is needed"))
        .cause("floating point numbers (NaN is no level of light), or a file of another byte order")
        .next("give the levels as the camera sent them: picture.astype(np.uint8), or np.uint16 with bits"))
}

fn depth_of(stored: u8, bits: Option<u8>) -> Fault {
    let said = bits.map_or("bits is not given".into(), |b| format!("bits is {b}"));
    Fault::input(format!("has levels of {stored} bits, {said}"))
        .cause("a camera of 10 or 12 bits fills a part of an uint16's levels, and nobody said which")
        .next("give bits=9 to 16 with uint16 pictures, none or 8 with uint8")
}

pub fn type_name(object: &Bound<'_, PyAny>) -> String {
    object.get_type().name().map_or_else(|_| "thing".into(), |n| n.to_string())
}

/// A picture as an array, uint8 or uint16.
pub fn levels(py: Python<'_>, image: Image) -> PyResult<Bound<'_, PyAny>> {
    let shape = (image.height as usize, image.width as usize);
    let flat = match image.pixels {
        sheetlight::raster::Pixels::U8(levels) => PyArray1::from_vec(py, levels).into_any(),
        sheetlight::raster::Pixels::U16(levels) => PyArray1::from_vec(py, levels).into_any(),
    };
    flat.call_method1("reshape", (shape,))
}

/// Rows x columns of a map.
pub fn rows<'py, T: numpy::Element>(py: Python<'py>, values: Vec<T>, [w, h]: [u32; 2]) -> PyResult<Py<PyAny>> {
    let array = PyArray1::from_vec(py, values).call_method1("reshape", ((h as usize, w as usize),))?;
    read_only(array)
}

fn read_only(array: Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
    let keywords = pyo3::types::PyDict::new(array.py());
    keywords.set_item("write", false)?;
    array.call_method("setflags", (), Some(&keywords))?;
    Ok(array.unbind())
}

/// Numbers of a structured array whose fields `dtype` of `sheetlight._dtypes` names.
pub fn structured(py: Python<'_>, words: Vec<f32>, dtype: &str) -> PyResult<Py<PyAny>> {
    let dtype = py.import(DTYPES)?.getattr(dtype)?;
    read_only(PyArray1::from_vec(py, words).call_method1("view", (dtype,))?)
}

/// A cloud as a structured array over the same memory.
pub fn points(py: Python<'_>, cloud: Vec<CloudPoint>) -> PyResult<Py<PyAny>> {
    // Nine words a point, of which the array's dtype says which is a count.
    structured(py, bytemuck::cast_vec(cloud), "POINT")
}

/// The cloud of such an array.
pub fn cloud(array: &Bound<'_, PyAny>) -> PyResult<Vec<CloudPoint>> {
    let words = array.call_method1("view", ("<f4",))?.extract::<PyReadonlyArray1<f32>>()?;
    Ok(bytemuck::cast_slice(words.as_slice().expect("contiguous")).to_vec())
}

/// N x 3 numbers (or N x 2): what `wanted` names.
pub fn vectors<const N: usize>(object: &Bound<'_, PyAny>, wanted: &str) -> PyResult<Vec<[f64; N]>> {
    let array = as_floats(object, wanted)?;
    let shape = array.shape().to_vec();
    if shape.len() != 2 || shape[1] != N {
        return Err(raised(
            Fault::input(format!("{wanted} have the shape {shape:?}, (any number, {N}) is needed"))
                .cause("columns and rows exchanged, or a structured array")
                .next("give one row a point; sheetlight.xyz(points) makes rows of a scan's points"),
        ));
    }
    let flat: Vec<f64> = array.readonly().as_array().iter().copied().collect();
    Ok(flat.chunks_exact(N).map(|c| std::array::from_fn(|i| c[i])).collect())
}

/// Places of points: N x 3, or a structured array with x, y and z.
pub fn xyz(object: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
    let named = object.getattr("dtype").and_then(|d| d.getattr("names")).is_ok_and(|n| !n.is_none());
    if named {
        return vectors(&object.py().import(DTYPES)?.call_method1("xyz", (object,))?, "points");
    }
    vectors(object, "points")
}

/// Anything that numpy makes an array of numbers of.
pub fn as_floats<'py>(object: &Bound<'py, PyAny>, wanted: &str) -> PyResult<Bound<'py, numpy::PyArrayDyn<f64>>> {
    let numpy = object.py().import("numpy")?;
    // What is no array at all is said below.
    let complex = numpy.call_method1("iscomplexobj", (object,)).and_then(|c| c.is_truthy()).unwrap_or(false);
    if complex || object.hasattr("mask")? {
        let is = if complex { "complex" } else { "masked" };
        return Err(raised(
            Fault::input(format!("{wanted} are {is} numbers, real ones are needed"))
                .cause("a calculation made them so, or another array was given")
                .next("give an array of float64"),
        ));
    }
    let made = numpy.call_method1("asarray", (object, "f8"));
    let array = made.and_then(|a| Ok(a.cast_into::<numpy::PyArrayDyn<f64>>()?));
    array.map_err(|error| {
        crate::fault::raised_by(error, |said| {
            Fault::input(format!("{wanted} are no numbers: {said}"))
                .cause(format!("a {} was given", type_name(object)))
                .next("give an array of float64")
        })
    })
}

/// Size and depth of an image.
pub fn format_of(image: &Image) -> Format {
    Format { width: image.width, height: image.height, bits: image.bits }
}
