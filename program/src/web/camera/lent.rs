//! In: an opened camera, a job. Out: that camera for the job. Its pictures are shown to viewers, its changed
//! settings are stored, and it is returned afterwards.
//! Frame and unit: as its pictures and features.

use super::state::{Looked, State, Use, lock};
use sheetlight::camera::Readout;
use sheetlight::capture::{Event, Feature, Format, PictureSource, RoundTrip};
use sheetlight::fault::{Fault, Result};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A camera that a job uses.
pub(super) struct Lent {
    /// `None` until it is open.
    pub inner: Option<Box<dyn PictureSource>>,
    /// State through which viewers see the pictures that the job takes.
    pub state: Arc<Mutex<State>>,
    pub use_: Arc<Use>,
    /// Ends the job.
    pub stop: Arc<AtomicBool>,
    /// A setting was changed.
    pub set: bool,
}

impl Lent {
    fn source(&mut self) -> &mut dyn PictureSource {
        &mut **self.inner.as_mut().expect("opened")
    }
}

impl PictureSource for Lent {
    fn format(&self) -> Format {
        self.inner.as_ref().expect("opened").format()
    }
    fn readout(&self) -> Option<Readout> {
        self.inner.as_ref().expect("opened").readout()
    }
    fn name(&self) -> String {
        self.inner.as_ref().expect("opened").name()
    }
    fn next(&mut self, within: Duration) -> Event {
        if self.stop.load(Ordering::Relaxed) {
            return Event::Lost(Fault::refused("stopped").next("order it again"));
        }
        let event = self.source().next(within);
        if let Event::Picture(p) = &event {
            let mut state = lock(&self.state);
            let number = state.newest.as_ref().map_or(0, |l| l.number) + 1;
            state.taken(number, p.host_ns);
            state.newest = Some(Arc::new(Looked::new(number, p.image.clone(), vec![], 0.0, p.host_ns)));
            self.use_.came.notify_waiters();
        }
        event
    }
    fn trigger(&mut self) -> Result<bool> {
        self.source().trigger()
    }
    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        self.source().clock()
    }
    fn features(&mut self) -> Result<Vec<Feature>> {
        self.source().features()
    }
    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        self.source().set(name, value)?;
        lock(&self.state).keep(name, value);
        self.set = true;
        Ok(())
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        let features = self.inner.as_mut().filter(|_| self.set).and_then(|source| source.features().ok());
        if features.is_some() {
            lock(&self.state).features = features;
        }
        self.inner = None;
        self.use_.lent.store(false, Ordering::SeqCst);
    }
}
