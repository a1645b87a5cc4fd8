//! In: a camera, the exposures of a bracket. Out: the same camera as a source that exposes with one after the other,
//! round and round; each picture states the exposure that it was taken with. The camera's own exposure is set back at
//! the end.
//! Frame and unit: exposure in us.

use super::fresh::Settling;
use super::setting::{Setting, unexposed};
use crate::camera::Readout;
use crate::capture::clock::RoundTrip;
use crate::capture::feature::Feature;
use crate::capture::format::Format;
use crate::capture::picture::{Event, Picture, PictureSource};
use crate::fault::{Fault, Kind, Result};
use crate::raster::Bracket;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Most pictures after a setting that are not used, beyond those of any camera: cameras need one to three in all.
const MOST_MORE: usize = 4;
/// Relative difference of a picture's stated exposure from the one that was set, from which on it is another exposure.
const OTHER: f64 = 0.02;
/// Number of pictures in a row with another exposure, after which the setting has no effect.
const MOST_ODD: usize = 32;
/// Number of failed settings in a row that end the source.
const MOST_FAILED: usize = 3;
/// Number of waits in a row without a picture, after which one is triggered again.
const QUIET: usize = 50;

/// What is known of a bracketed source while it runs elsewhere.
#[derive(Clone)]
pub struct Exposures {
    us: Arc<Vec<f64>>,
    more: Arc<AtomicUsize>,
    said: Arc<Mutex<Vec<String>>>,
}

impl Exposures {
    /// The exposures as the camera reported them, us, ascending.
    pub fn us(&self) -> &[f64] {
        &self.us
    }

    /// Which of them a picture was taken with, by the exposure that it states.
    pub fn index(&self, exposure_ns: u64) -> usize {
        let apart = |us: &f64| (1e-3 * exposure_ns as f64 / us).ln().abs();
        let near = self.us.iter().enumerate().min_by(|(_, a), (_, b)| apart(a).total_cmp(&apart(b)));
        near.map_or(0, |(i, _)| i)
    }

    /// From now on one picture more is excluded after each setting; their number, or none if there are enough.
    pub fn wait_longer(&self) -> Option<usize> {
        let more = self.more.load(Ordering::Relaxed) + 1;
        if more > MOST_MORE {
            return None;
        }
        self.more.store(more, Ordering::Relaxed);
        Some(more)
    }

    /// Messages since the last call.
    pub fn news(&self) -> Vec<String> {
        std::mem::take(&mut *self.said.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A camera that exposes with several exposures in turn.
pub struct Bracketed {
    source: Box<dyn PictureSource>,
    setting: Setting,
    /// The exposure to set back at the end, us.
    former: f64,
    exposures: Exposures,
    /// What the camera is set to for each of them, us.
    asked: Vec<f64>,
    /// Index of the exposure of the next picture.
    at: usize,
    /// What separates older pictures from the next; none if its exposure has to be set.
    settling: Option<Settling>,
    /// Whether a triggered picture is awaited, if the source is triggered; whether it is the first one after a setting.
    triggered: bool,
    first: bool,
    quiet: usize,
    odd: usize,
    failed: usize,
    refused: bool,
}

impl Bracketed {
    /// Sets each exposure once and reads what the camera makes of it. `black_level` is the level without light.
    ///
    /// # Errors
    /// Exposures that are no bracket, as typed or as the camera rounds them, or that are out of its range; a source
    /// without ExposureTime; a camera that is triggered by others, or that changes its exposure or gain itself.
    pub fn new(source: Box<dyn PictureSource>, exposures_us: &[f64], black_level: f64) -> Result<Bracketed> {
        let (name, bits) = (source.name(), source.format().bits);
        let typed = |fault: Fault| Fault {
            kind: Kind::Usage,
            cause: "--exposures names the exposure times of a pose, microseconds".into(),
            next: "name two to four from the shortest to the longest, each at least 1.2 times the one before".into(),
            ..fault
        };
        Bracket::new(exposures_us, bits, black_level).map_err(typed)?;
        let mut source = source;
        let features = source.features()?;
        let setting = Setting::among(&features).ok_or_else(|| {
            unexposed(&name)
                .cause("a pipe, a folder, a recording, or a camera whose exposure is set elsewhere")
                .next("set the exposure there, and take one exposure of each pose: leave --exposures out")
        })?;
        itself(&name, &features)?;
        let [low, high] = setting.range;
        if let Some(odd) = exposures_us.iter().find(|us| !(low..=high).contains(*us)) {
            return Err(Fault::usage(format!("{name}: an exposure of {odd} us, it can do {low} to {high} us"))
                .cause("the camera's limits, which may follow from its frame rate")
                .next("name exposures within, or lower AcquisitionFrameRate: sheetlight camera show"));
        }
        let former = setting.us.filter(|us| *us > 0.0).ok_or_else(|| {
            Fault::input(format!("{name}: does not report its exposure, so it could not be set back"))
                .cause("the camera's feature cannot be read")
                .next("see its features with: sheetlight camera show")
        })?;
        let exposures = Exposures { us: Arc::new(exposures_us.to_vec()), more: Arc::default(), said: Arc::default() };
        // From here on the former exposure is set back, whatever happens.
        let mut bracketed = Bracketed {
            source,
            setting,
            former,
            exposures,
            asked: exposures_us.to_vec(),
            at: 0,
            settling: None,
            triggered: false,
            first: true,
            quiet: 0,
            odd: 0,
            failed: 0,
            refused: false,
        };
        let answers: Vec<f64> = exposures_us
            .iter()
            .map(|us| bracketed.setting.set(bracketed.source.as_mut(), *us))
            .collect::<Result<_>>()?;
        Bracket::new(&answers, bits, black_level).map_err(|fault| {
            let words = |all: &[f64]| all.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
            Fault::usage(format!(
                "{name}: was set to {} us and says {} us: {}",
                words(exposures_us),
                words(&answers),
                fault.what
            ))
            .cause("the camera rounds exposures to its own steps, or limits them")
            .next("name exposures that are farther apart: sheetlight camera show states the range")
        })?;
        bracketed.exposures.us = Arc::new(answers);
        Ok(bracketed)
    }

    /// The exposures, and the messages about them while this source runs.
    pub fn exposures(&self) -> Exposures {
        self.exposures.clone()
    }

    fn us(&self) -> f64 {
        self.exposures.us[self.at]
    }

    /// Sets the exposure of the next picture, and triggers it.
    fn expose(&mut self) -> Result<()> {
        if self.settling.is_none() {
            self.source.set(&self.setting.name, &format!("{}", self.asked[self.at]))?;
            let more = self.exposures.more.load(Ordering::Relaxed);
            self.settling = Some(Settling::begin(self.source.as_mut(), more));
            (self.triggered, self.first, self.quiet) = (false, true, 0);
        }
        if (!self.triggered || self.quiet > QUIET) && self.source.trigger()? {
            if self.first {
                self.settling.as_mut().expect("set above").triggered();
            }
            (self.triggered, self.first, self.quiet) = (true, false, 0);
        }
        Ok(())
    }

    /// Reports that the source is lost. A source that refuses its settings is not opened again.
    fn lost(&mut self, fault: Fault) -> Event {
        self.failed += 1;
        self.refused |= fault.kind == Kind::Usage || self.failed >= MOST_FAILED;
        self.settling = None;
        Event::Lost(fault)
    }

    fn taken(&mut self, mut picture: Box<Picture>) -> Event {
        let (us, id, host_ns) = (self.us(), picture.id, picture.host_ns);
        (self.triggered, self.quiet) = (false, 0);
        if !self.settling.as_mut().is_some_and(|s| s.accepts(picture.device_ns)) {
            return Event::Spare { id, host_ns };
        }
        let stated = picture.exposure_ns.map(|ns| 1e-3 * ns as f64);
        if let Some(other) = stated.filter(|is| (is / us - 1.0).abs() > OTHER) {
            self.odd += 1;
            if self.odd < MOST_ODD {
                return Event::Spare { id, host_ns };
            }
            let what = format!(
                "{}: was set to {us} us and still exposes with {other} us after {MOST_ODD} pictures",
                self.source.name()
            );
            self.refused = true;
            return self.lost(
                Fault::input(what)
                    .cause("another program sets its exposure, or it sets it itself (ExposureAuto)")
                    .next("end the other program; sheetlight camera set ExposureAuto Off"),
            );
        }
        picture.exposure_ns.get_or_insert((1e3 * us).round() as u64);
        (self.odd, self.failed) = (0, 0);
        self.at = (self.at + 1) % self.exposures.us.len();
        self.settling = None;
        Event::Picture(picture)
    }
}

/// Refuses a camera that changes its exposure or gain itself, or that others trigger.
fn itself(name: &str, features: &[Feature]) -> Result<()> {
    let value = |of: &str| features.iter().find(|f| f.name == of)?.value.as_ref().map(ToString::to_string);
    for auto in ["ExposureAuto", "GainAuto"] {
        if let Some(is) = value(auto).filter(|v| v != "Off" && v != "false") {
            return Err(Fault::usage(format!("{name}: {auto} is {is}, it has to be Off"))
                .cause("levels of several exposures are only comparable if nothing else changes them")
                .next(format!("sheetlight camera set {auto} Off --camera {name}")));
        }
    }
    let by = value("TriggerSource").unwrap_or_else(|| "a wire".into());
    if value("TriggerMode").is_some_and(|v| v == "On") && by != "Software" {
        return Err(Fault::usage(format!("{name}: TriggerMode is On, it is triggered by {by}"))
            .cause("whoever triggers it does not know when the next exposure is set")
            .next(format!("let it run by itself: sheetlight camera set TriggerMode Off --camera {name}")));
    }
    Ok(())
}

impl PictureSource for Bracketed {
    fn format(&self) -> Format {
        self.source.format()
    }

    fn readout(&self) -> Option<Readout> {
        self.source.readout()
    }

    fn next(&mut self, within: Duration) -> Event {
        if let Err(fault) = self.expose() {
            return self.lost(fault);
        }
        let drains = self.settling.as_ref().is_some_and(Settling::drains);
        match self.source.next(if drains { Duration::ZERO } else { within }) {
            Event::Picture(picture) => self.taken(picture),
            Event::Lost(fault) => {
                self.settling = None;
                Event::Lost(fault)
            }
            Event::Quiet if drains => {
                self.settling.iter_mut().for_each(Settling::drained);
                Event::Quiet
            }
            Event::Quiet => {
                self.quiet += 1;
                Event::Quiet
            }
            other => other,
        }
    }

    fn sent(&self) -> Option<u64> {
        self.source.sent()
    }

    fn resent(&self) -> u64 {
        self.source.resent()
    }

    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        self.source.clock()
    }

    fn waits(&self) -> bool {
        self.source.waits()
    }

    fn reopens(&self) -> bool {
        !self.refused && self.source.reopens()
    }

    fn reopen(&mut self) -> Result<()> {
        self.settling = None;
        self.source.reopen()
    }

    fn features(&mut self) -> Result<Vec<Feature>> {
        self.source.features()
    }

    fn name(&self) -> String {
        self.source.name()
    }

    fn device(&self) -> String {
        self.source.device()
    }
}

impl Drop for Bracketed {
    fn drop(&mut self) {
        if let Err(fault) = self.source.set(&self.setting.name, &format!("{}", self.former)) {
            let said = format!(
                "{}: its exposure could not be set back to {} us: {}; set it by hand: sheetlight camera set",
                self.source.name(),
                self.former,
                fault.what
            );
            self.exposures.said.lock().unwrap_or_else(PoisonError::into_inner).push(said);
        }
    }
}
