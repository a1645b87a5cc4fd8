//! In: pictures as a camera delivers them. Out: the points of the newest one; those that came while it was worked on are
//! passed over and counted. Frame and unit: camera frame, mm.

use super::engine::{Engine, Measured, Optical};
use super::{Extraction, Format, Processor, Where, camera_for};
use crate::fault::Result;
use crate::geometry::{Camera, Rigid};
use crate::raster::Image;
use crate::rig::{Rig, Volume};
use crate::stages::stripe::point::pose_words;
use std::sync::{Condvar, Mutex, PoisonError};

/// Holds the newest of what one thread puts in until another takes it out.
pub struct Newest<T> {
    state: Mutex<State<T>>,
    filled: Condvar,
}

struct State<T> {
    value: Option<T>,
    passed_over: u64,
    closed: bool,
}

impl<T> Default for Newest<T> {
    fn default() -> Self {
        Newest { state: Mutex::new(State { value: None, passed_over: 0, closed: false }), filled: Condvar::new() }
    }
}

impl<T> Newest<T> {
    /// Replaces what was not taken yet.
    pub fn put(&self, value: T) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.value.replace(value).is_some() {
            state.passed_over += 1;
        }
        self.filled.notify_one();
    }
    /// Nothing will be put in any more.
    pub fn close(&self) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        self.filled.notify_all();
    }
    /// Waits for a value; `None` when it is closed and empty.
    pub fn take(&self) -> Option<T> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(value) = state.value.take() {
                return Some(value);
            }
            if state.closed {
                return None;
            }
            state = self.filled.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
    /// Values that were replaced before anyone took them.
    pub fn passed_over(&self) -> u64 {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).passed_over
    }
}

/// The stripe chain for one picture at a time.
pub struct Live {
    engine: Engine,
    /// The stripe's width and speckle are known, from the first picture that showed it.
    ready: bool,
}

impl Live {
    /// Refused: a rig without camera or laser plane; another picture shape than the camera's; no GPU where one is asked for.
    pub fn new(
        rig: &Rig,
        format: Format,
        extraction: &Extraction,
        volume: Option<&Volume>,
        place: Where,
    ) -> Result<Live> {
        extraction.check()?;
        let camera = camera_for(&rig.need_camera()?.value, format)?;
        let laser = rig.need_laser_plane()?.value;
        let optical = Optical { camera, laser, depth_mm: Volume::depths(volume) };
        let processor: Processor = place.open()?;
        let engine = Engine::new(format, &optical, extraction, None, processor).one_at_a_time();
        Ok(Live { engine, ready: false })
    }

    /// Adapter and driver, or this machine's processor and why.
    pub fn ran_on(&self) -> String {
        self.engine.ran_on()
    }

    /// Peaks and points of one picture, camera frame; `None` until a picture has shown the stripe.
    pub fn measure(&mut self, frame: u32, image: Image) -> Result<Option<Measured>> {
        if !self.ready {
            let Some(stripe) = self.engine.measure(&[&image]) else { return Ok(None) };
            self.engine.set_stripe(&stripe)?;
            self.ready = true;
        }
        self.engine.submit(frame, image, pose_words(&Rigid::<Camera, Camera>::identity()))?;
        Ok(self.engine.collect(true)?.pop())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_is_taken_and_the_others_are_counted() {
        let box_ = Newest::default();
        (0..3).for_each(|i| box_.put(i));
        assert_eq!((box_.take(), box_.passed_over()), (Some(2), 2));
        box_.put(7);
        box_.close();
        assert_eq!((box_.take(), box_.take(), box_.passed_over()), (Some(7), None, 2));
    }
}
