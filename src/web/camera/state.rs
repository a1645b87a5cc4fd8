//! In: pictures, settings, who has the camera. Out: the same, shared by who looks and who borrows.
//! Frame and unit: px, grey levels, ms; ns of the host's clock.

use crate::capture::{Account, Feature};
use crate::raster::Image;
use std::collections::VecDeque;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard};

/// Pictures whose moments are known: pages show one that is at most so many old.
const MOMENTS: usize = 64;

/// A picture to look at.
pub struct Looked {
    /// Counts up with every picture that was measured.
    pub number: u64,
    /// As it came.
    pub image: Image,
    /// u, v and fate (0: kept) of each peak.
    pub peaks: Vec<(f32, f32, u32)>,
    /// From its last byte to its points, ms.
    pub delay_ms: f32,
}

#[derive(Default)]
pub(super) struct State {
    pub newest: Option<Arc<Looked>>,
    /// What the camera can be set to, as it said last.
    pub features: Option<Vec<Feature>>,
    /// What was set from here, in that order: a camera that forgets it is told again when it is opened.
    pub kept: Vec<(String, String)>,
    /// When the newest pictures' last bytes came, ns of the host's clock.
    pub moments: VecDeque<(u64, u64)>,
    pub account: Account,
    /// Pictures a second, as they came lately.
    pub rate_hz: Option<f64>,
    pub measured: u64,
    pub without_stripe: u64,
    pub delays: VecDeque<f64>,
    pub wrong: Option<String>,
}

impl State {
    pub fn taken(&mut self, number: u64, at_ns: u64) {
        self.moments.push_back((number, at_ns));
        if self.moments.len() > MOMENTS {
            self.moments.pop_front();
        }
    }

    pub fn keep(&mut self, name: &str, value: &str) {
        self.kept.retain(|(n, _)| n != name);
        self.kept.push((name.to_owned(), value.to_owned()));
    }
}

/// Who has the camera.
#[derive(Default)]
pub(super) struct Use {
    /// A job wants it, or has it.
    pub lent: AtomicBool,
    /// It is looked at: its connection is open.
    pub open: AtomicBool,
    /// Settings or calibrations of the station are other ones.
    pub renewed: AtomicBool,
}

pub(super) fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(|e| e.into_inner())
}
