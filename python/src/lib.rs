//! The engine as a Python module, `sheetlight._engine`; sheetlight/__init__.py shows it to users,
//! sheetlight/_engine.pyi types it.

mod arrays;
mod calibrate;
mod calibration;
mod camera;
mod fault;
mod find;
mod live;
mod map;
mod matching;
mod poses;
mod progress;
mod recording;
mod scan;
mod simulate;
mod source;
mod station;

use pyo3::prelude::*;

#[pymodule]
fn _engine(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<calibration::Calibration>()?;
    m.add_class::<camera::Camera>()?;
    m.add_class::<find::Found>()?;
    m.add_class::<find::Recipe>()?;
    m.add_class::<live::Live>()?;
    m.add_class::<map::HeightMap>()?;
    m.add_class::<matching::Template>()?;
    m.add_class::<recording::Recording>()?;
    m.add_class::<scan::Scan>()?;
    m.add_class::<simulate::Simulation>()?;
    m.add_class::<station::Station>()?;
    m.add_function(wrap_pyfunction!(calibrate::calibrate_camera, m)?)?;
    m.add_function(wrap_pyfunction!(calibrate::calibrate_hand_eye, m)?)?;
    m.add_function(wrap_pyfunction!(calibrate::calibrate_laser_plane, m)?)?;
    m.add_function(wrap_pyfunction!(find::find, m)?)?;
    m.add_function(wrap_pyfunction!(find::teach, m)?)?;
    m.add_function(wrap_pyfunction!(live::picture_points, m)?)?;
    m.add_function(wrap_pyfunction!(matching::match_template, m)?)?;
    m.add_function(wrap_pyfunction!(poses::notations, m)?)?;
    m.add_function(wrap_pyfunction!(poses::pose_from_numbers, m)?)?;
    m.add_function(wrap_pyfunction!(poses::numbers_from_pose, m)?)?;
    m.add_function(wrap_pyfunction!(scan::scan, m)?)?;
    m.add_function(wrap_pyfunction!(simulate::simulate, m)?)?;
    Ok(())
}
