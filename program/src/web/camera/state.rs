//! In: pictures, settings, the camera's user. Out: the same, shared by viewers and jobs.
//! Frame and unit: px, grey levels, ms; ns of the host's clock.

use axum::body::Bytes;
use sheetlight::camera::Readout;
use sheetlight::capture::{Account, Feature};
use sheetlight::raster::Image;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use tokio::sync::Notify;

/// Number of newest pictures whose times are stored; a page shows none that is older.
const MOMENTS: usize = 64;

/// A picture to show.
pub struct Looked {
    /// Increases with every picture that was measured.
    pub number: u64,
    /// The picture as received.
    pub image: Image,
    /// u, v and `fate` (0: kept) of each peak.
    pub peaks: Vec<(f32, f32, u32)>,
    /// Time from its last byte to its points, ms.
    pub delay_ms: f32,
    /// Time at which its last byte arrived, ns of the host's clock.
    pub came_ns: u64,
    bytes: OnceLock<Bytes>,
}

impl Looked {
    /// A picture with its peaks.
    pub(super) fn new(number: u64, image: Image, peaks: Vec<(f32, f32, u32)>, delay_ms: f32, came_ns: u64) -> Looked {
        Looked { number, image, peaks, delay_ms, came_ns, bytes: OnceLock::new() }
    }

    /// Number, columns, rows, number of peaks (u32), delay in ms (float), then u, v (float) and fate (u32) of each
    /// peak, then the grey levels. Serialized once for all viewers.
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
    /// How the camera reads its pictures from the sensor, if it reports it.
    pub readout: Option<Readout>,
    /// The camera's settings, as it last reported them.
    pub features: Option<Vec<Feature>>,
    /// Settings changed here, in order. They are set again when the camera is reopened, because it may have lost
    /// them.
    pub kept: Vec<(String, String)>,
    /// Number and arrival time of the newest pictures, ns of the host's clock.
    pub moments: VecDeque<(u64, u64)>,
    pub account: Account,
    /// Recent frame rate, Hz.
    pub rate_hz: Option<f64>,
    pub measured: u64,
    pub without_stripe: u64,
    /// Pictures that arrived during a job while no viewer asked.
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

/// The use of the camera.
#[derive(Default)]
pub(super) struct Use {
    /// A job wants it, or has it.
    pub lent: AtomicBool,
    /// It is being watched: its connection is open.
    pub open: AtomicBool,
    /// The station's settings or calibrations have changed.
    pub renewed: AtomicBool,
    /// A job runs and has priority.
    pub busy: AtomicBool,
    /// Time of the last request for a picture, ns of the host's clock; 0: none since the last one was measured.
    pub asked_ns: AtomicU64,
    /// A picture was measured.
    pub came: Notify,
}

pub(super) fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(|e| e.into_inner())
}
