//! One picture at a time to the points of its stripe.

use crate::arrays::{format_of, picture, structured};
use crate::fault::{OrRaise, raised, word};
use crate::station::with_station;
use pyo3::prelude::*;
use sheetlight::capture::Format;
use sheetlight::fault::Fault;
use sheetlight::raster::Image;
use sheetlight::scan::{self, Measured, Where};
use sheetlight::station::volume::believed;
use std::sync::Mutex;

/// Measures pictures one by one with the least delay. Points are in the camera's frame, mm.
#[pyclass(frozen, module = "sheetlight")]
pub struct Live {
    inner: Mutex<scan::Live>,
    format: Format,
    bits: Option<u8>,
}

impl Live {
    fn open(station: &Bound<'_, PyAny>, format: Format, bits: Option<u8>, on: &str) -> PyResult<Live> {
        let place: Where = word(on)?;
        with_station(station, |s| {
            let volume = believed(&s.settings, &s.rig);
            let open = || scan::Live::new(&s.rig, format, &s.settings.extraction, volume.as_ref(), place);
            let inner = station.py().detach(open).or_raise()?;
            Ok(Live { inner: Mutex::new(inner), format, bits })
        })
    }

    fn points(&self, py: Python<'_>, image: Image) -> PyResult<Option<Py<PyAny>>> {
        let is = format_of(&image);
        if is != self.format {
            return Err(raised(
                Fault::input(format!("the picture is {}x{} with {} bits", is.width, is.height, is.bits))
                    .cause("another size or depth than was stated when the measuring began")
                    .next(format!("give {}x{} with {} bits", self.format.width, self.format.height, self.format.bits)),
            ));
        }
        let measured = py.detach(|| {
            let mut live = self.inner.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            live.measure(0, image)
        });
        measured.or_raise()?.map(|m| structured(py, words(&m), "PICTURE_POINT")).transpose()
    }
}

/// x, y, z, sigma, intensity, u, v of each kept peak.
fn words(measured: &Measured) -> Vec<f32> {
    let both = measured.peaks.iter().zip(&measured.points).filter(|(k, _)| k.kept());
    both.flat_map(|(k, p)| {
        let [x, y, z] = p.position.to_array();
        [x, y, z, p.sigma_mm, k.amplitude, k.u, k.v]
    })
    .collect()
}

#[pymethods]
impl Live {
    /// `size` is (width, height) of the pictures, `bits` the depth of uint16 levels, `on` auto, gpu or cpu.
    #[new]
    #[pyo3(signature = (station, size, *, bits = None, on = "auto"))]
    fn new(station: &Bound<'_, PyAny>, size: (u32, u32), bits: Option<u8>, on: &str) -> PyResult<Live> {
        let format = Format { width: size.0, height: size.1, bits: bits.unwrap_or(8) };
        Live::open(station, format, bits, on)
    }

    /// The points of a picture (rows x columns): a structured array PICTURE_POINT, camera frame, mm. None until a
    /// picture has shown the stripe.
    #[pyo3(name = "measure")]
    fn measure_picture(&self, py: Python<'_>, picture: &Bound<'_, PyAny>) -> PyResult<Option<Py<PyAny>>> {
        self.points(py, self::picture(picture, self.bits, "the picture")?)
    }

    /// What the stages run on.
    #[getter]
    fn ran_on(&self) -> String {
        self.inner.lock().unwrap_or_else(std::sync::PoisonError::into_inner).ran_on()
    }
}

/// The points of one picture of the stripe: a structured array PICTURE_POINT in the camera's frame, mm. For many
/// pictures make a Live once. Raises SheetlightError where no stripe is seen.
#[pyfunction]
#[pyo3(signature = (picture, station, *, bits = None, on = "auto"))]
pub fn picture_points(
    py: Python<'_>,
    picture: &Bound<'_, PyAny>,
    station: &Bound<'_, PyAny>,
    bits: Option<u8>,
    on: &str,
) -> PyResult<Py<PyAny>> {
    let image = self::picture(picture, bits, "the picture")?;
    let live = Live::open(station, format_of(&image), bits, on)?;
    live.points(py, image)?.ok_or_else(|| {
        raised(
            Fault::input("no stripe is seen")
                .cause("a dark picture, or the laser was off")
                .next("look at exposure and laser, and whether the stripe lies within the working volume"),
        )
    })
}
