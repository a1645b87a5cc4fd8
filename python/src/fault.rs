//! Makes of the engine's faults the one exception that Python users meet, `sheetlight.SheetlightError`.

use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use sheetlight::fault::{Fault, Result};

static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();

/// The exception that says what a fault says.
pub fn raised(fault: Fault) -> PyErr {
    Python::attach(|py| {
        let class = CLASS.import(py, "sheetlight._error", "SheetlightError");
        let made = class.and_then(|c| c.call1((fault.what, fault.cause, fault.next)));
        made.map_or_else(|e| e, PyErr::from_value)
    })
}

/// The same for what Python code raised on the engine's behalf. Signals and exits (no `Exception`) stay what they are.
pub fn raised_by(error: PyErr, fault: impl FnOnce(&str) -> Fault) -> PyErr {
    Python::attach(|py| {
        let ours = CLASS.get(py).is_some_and(|c| error.is_instance(py, c.bind(py)));
        if ours || !error.is_instance_of::<PyException>(py) {
            return error;
        }
        let said = raised(fault(&error.to_string()));
        said.set_cause(py, Some(error));
        said
    })
}

/// Faults of the engine as exceptions.
pub trait OrRaise<T> {
    fn or_raise(self) -> PyResult<T>;
}

impl<T> OrRaise<T> for Result<T> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(raised)
    }
}

/// A value of a word among the engine's, e.g. where stages run.
pub fn word<T: std::str::FromStr<Err = String>>(text: &str) -> PyResult<T> {
    text.parse().map_err(|what: String| raised(Fault::usage(what).next("give one of these words")))
}
