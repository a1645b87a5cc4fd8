//! Tells a Python function how far work is, and takes notice of Ctrl-C while the engine works without the interpreter.

use crate::fault::OrRaise;
use pyo3::prelude::*;
use sheetlight::fault::Result;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Ctrl-C is looked for so often: each time costs a wait for the interpreter.
const LOOK: Duration = Duration::from_millis(50);

/// How far some work is, and what was raised meanwhile.
#[derive(Clone)]
pub struct Progress(Arc<Inner>);

struct Inner {
    callback: Option<Py<PyAny>>,
    raised: Mutex<Option<PyErr>>,
    stop: Arc<AtomicBool>,
    looked: Mutex<Instant>,
}

impl Progress {
    /// `callback(done, all)` is called as work goes on; `all` is None where it is not known.
    pub fn new(callback: Option<Py<PyAny>>) -> Progress {
        let (raised, stop, looked) = (Mutex::default(), Arc::default(), Mutex::new(Instant::now()));
        Progress(Arc::new(Inner { callback, raised, stop, looked }))
    }

    /// Set when something was raised: who works ends then.
    pub fn stop(&self) -> Arc<AtomicBool> {
        self.0.stop.clone()
    }

    /// Keeps what was raised, if it is the first, for whoever waits for the work; the work ends by itself.
    pub fn keep(&self, error: PyErr) {
        self.0.raised.lock().expect("nothing panics with it").get_or_insert(error);
    }

    pub fn tell(&self, done: usize, all: Option<usize>) {
        let due = {
            let mut looked = self.0.looked.lock().expect("nothing panics with it");
            let due = looked.elapsed() >= LOOK;
            if due {
                *looked = Instant::now();
            }
            due
        };
        if self.0.stop.load(Ordering::Relaxed) || !(due || self.0.callback.is_some()) {
            return;
        }
        let told = Python::attach(|py| {
            py.check_signals()?;
            self.0.callback.as_ref().map_or(Ok(()), |c| c.call1(py, (done, all)).map(|_| ()))
        });
        if let Err(error) = told {
            self.keep(error);
            self.0.stop.store(true, Ordering::Relaxed);
        }
    }

    /// Runs work without the interpreter; what was raised meanwhile comes before what the work says.
    pub fn run<T: Send>(&self, py: Python<'_>, work: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
        let result = py.detach(work);
        if let Some(error) = self.0.raised.lock().expect("nothing panics with it").take() {
            return Err(error);
        }
        result.or_raise()
    }
}
