//! In: pictures, settings, who has the camera. Out: the same, shared by who looks and who borrows.
//! Frame and unit: px, grey levels, ms; ns of the host's clock.

use crate::camera::Readout;
use crate::capture::{Account, Feature};
use crate::raster::Image;
use axum::body::Bytes;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use tokio::sync::Notify;

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
    /// When its last byte came, ns of the host's clock.
    pub came_ns: u64,
    bytes: OnceLock<Bytes>,
}

impl Looked {
    /// A picture with its peaks.
    pub(super) fn new(number: u64, image: Image, peaks: Vec<(f32, f32, u32)>, delay_ms: f32, came_ns: u64) -> Looked {
        Looked { number, image, peaks, delay_ms, came_ns, bytes: OnceLock::new() }
    }

    /// Number, columns, rows, number of peaks (u32), delay in ms (float), then u, v (float) and fate (u32) of each
    /// peak, then the grey levels; written once for all who look.
    pub fn bytes(&self) -> Bytes {
        self.bytes.get_or_init(|| self.written().into()).clone()
    }

    fn written(&self) -> Vec<u8> {
        let grey = self.image.to_u8();
        let mut out = Vec::with_capacity(20 + 12 * self.peaks.len() + grey.len());
        let (w, h) = (self.image.width, self.image.height);
        for word in [self.number as u32, w, h, self.peaks.len() as u32, self.delay_ms.to_bits()] {
            out.extend(word.to_le_bytes());
        }
        for (u, v, fate) in &self.peaks {
            out.extend([u.to_bits(), v.to_bits(), *fate].iter().flat_map(|w| w.to_le_bytes()));
        }
        out.extend(&grey);
        out
    }
}

#[derive(Default)]
pub(super) struct State {
    pub newest: Option<Arc<Looked>>,
    /// How the camera reads its pictures from the sensor, where it says so.
    pub readout: Option<Readout>,
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
    /// Came while a job ran and nobody looked.
    pub unlooked: u64,
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
    /// A job runs: it comes first.
    pub busy: AtomicBool,
    /// When somebody asked for a picture last, ns of the host's clock; 0: nobody did since the last one was measured.
    pub asked_ns: AtomicU64,
    /// A picture was measured.
    pub came: Notify,
}

pub(super) fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(|e| e.into_inner())
}
