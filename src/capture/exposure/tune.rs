//! In: a camera whose pictures show a stripe. Out: the exposure that suits the stripe.
//! Frame and unit: exposure in us; shares of full scale.

use super::fresh::Fresh;
use super::setting::Setting;
use crate::capture::look::{Look, MOST_SATURATED, WANTED, look, look_at};
use crate::capture::picture::PictureSource;
use crate::fault::{Fault, Result};
use std::time::Duration;

/// Allows for an exposure of seconds, and for cameras that start slowly.
pub(super) const PATIENCE: Duration = Duration::from_secs(30);
/// Exposure of a camera that does not report its own, us.
const USUAL: f64 = 1000.0;

/// Result of tuning.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Tuned {
    /// Exposure, us.
    pub exposure_us: f64,
    /// What pictures look like with it.
    pub look: Look,
    /// If no exposure is right: the reason why this one is the best.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remark: Option<String>,
}

const TRIES: usize = 20;
/// Number of peaks needed to measure a share of 0.5 %.
const PEAKS: usize = 1000;
const PICTURES: usize = 8;
/// If the exposure that is too bright is at most this factor above the one that is too dark, nothing between them is
/// right.
const NARROW: f64 = 1.04;
/// Number of final downward steps, each by the factor `NARROW`.
const STEPS_DOWN: usize = 5;
/// If peaks must stay below this share of full scale because of a few glints, they are too dark.
const DIMMEST: f64 = 0.5;
/// If saturation is the limit, peaks are aimed just inside the wanted range.
const CAREFUL: f64 = WANTED[0] + 0.02;

/// Finds the exposure at which the stripe's peak is right, and leaves it set.
///
/// # Errors
/// A source without ExposureTime; no stripe at any exposure; a stripe too bright or too dark at the ends of the
/// range; a stripe whose glints saturate while the rest is dark.
pub fn tune(source: &mut dyn PictureSource, mut tried: impl FnMut(f64, &Look)) -> Result<Tuned> {
    let Setting { name, range: [low, high], us } = Setting::of(source)?;
    let (low, mut exposure_us) = (low.max(1.0), us.unwrap_or(USUAL));
    let mut bounds = Bounds::default();
    for _ in 0..TRIES {
        let seen = judged(source)?;
        tried(exposure_us, &seen);
        if seen.right() {
            return Ok(Tuned { exposure_us, look: seen, remark: None });
        }
        let Some(wish) = bounds.next(exposure_us, &seen) else { return settle(source, &name, &bounds, tried) };
        let next = wish.clamp(low, high);
        if (next - exposure_us).abs() < 1e-3 * exposure_us {
            return Err(Fault::refused(format!(
                "at {exposure_us:.0} us, the end of its range ({low:.0} to {high:.0}), {seen}"
            ))
            .cause("laser, lens aperture or gain do not suit")
            .next("change the aperture, the laser's power or the gain, then tune again"));
        }
        exposure_us = next;
        source.set(&name, &format!("{exposure_us}"))?;
    }
    Err(changes(format!("no exposure suits after {TRIES} tries, the last was {exposure_us:.0} us")))
}

fn changes(what: String) -> Fault {
    Fault::refused(what)
        .cause("the light changes: a laser that is switched, room light, something that moves")
        .next("hold everything still and tune again")
}

/// Assesses present pictures: near a right exposure it uses as many as are needed to measure shares of a few per
/// mille.
fn judged(source: &mut dyn PictureSource) -> Result<Look> {
    let mut fresh = Fresh::now(source, PATIENCE);
    let mut images = vec![fresh.next()?];
    let first = look(&images[0]);
    let Some(stripe) = first.stripe.as_ref().filter(|s| s.peak > DIMMEST && s.saturated < 10.0 * MOST_SATURATED) else {
        return Ok(first);
    };
    let lines = if stripe.lying { images[0].width } else { images[0].height };
    let wanted = PEAKS.div_ceil(lines as usize).min(PICTURES);
    while images.len() < wanted {
        images.push(fresh.next()?);
    }
    Ok(look_at(&images))
}

/// Used if neither side is right: finds the brightest exposure that saturates nothing. Between exposures so close
/// together, whether five or six of a thousand peaks saturate is chance. So it goes down in small steps before it
/// concludes that the light changes.
fn settle(
    source: &mut dyn PictureSource,
    name: &str,
    bounds: &Bounds,
    mut tried: impl FnMut(f64, &Look),
) -> Result<Tuned> {
    let (mut dark, bright) = (bounds.dark.unwrap_or(1.0), bounds.bright.unwrap_or(1.0));
    let mut seen = None;
    for _ in 0..STEPS_DOWN {
        source.set(name, &format!("{dark}"))?;
        let now = judged(source)?;
        tried(dark, &now);
        if now.stripe.as_ref().is_none_or(|s| s.saturated <= MOST_SATURATED) {
            return settled(dark, bright, now);
        }
        seen = Some(now);
        dark /= NARROW;
    }
    let seen = seen.map(|s| s.to_string()).unwrap_or_default();
    Err(changes(format!("at {:.0} us, where it was too dark before, {seen}", dark * NARROW)))
}

/// The result for an exposure that is the best possible.
fn settled(dark: f64, bright: f64, seen: Look) -> Result<Tuned> {
    let Some(peak) = seen.stripe.as_ref().map(|s| s.peak) else {
        return Err(Fault::refused(format!("no stripe at {dark:.0} us, and at {bright:.0} us too much light; {seen}"))
            .cause("the laser is off or out of view, or room light is brighter than it")
            .next("switch the laser on and the room light off, look with sheetlight camera snap, then tune again"));
    };
    let most = 100.0 * MOST_SATURATED;
    let said = format!(
        "peaks stand at {:.0} % of full scale at {dark:.0} us, and at {bright:.0} us more than {most} % of them are \
         saturated",
        100.0 * peak
    );
    if peak < DIMMEST {
        return Err(Fault::refused(said)
            .cause("glints: a part that shines in places and is dark in others")
            .next("turn or matt the part, or set an exposure by hand: sheetlight camera set ExposureTime US"));
    }
    Ok(Tuned { exposure_us: dark, look: seen, remark: Some(said) })
}

/// The longest exposure that was too dark and the shortest that was too bright, us.
#[derive(Default)]
struct Bounds {
    dark: Option<f64>,
    bright: Option<f64>,
}

impl Bounds {
    /// The exposure to try after one that is not right; none if nothing between the two bounds can be right.
    fn next(&mut self, exposure_us: f64, seen: &Look) -> Option<f64> {
        let factor = factor(seen);
        if factor < 1.0 {
            self.bright = Some(exposure_us);
        } else {
            self.dark = Some(exposure_us);
        }
        let aim = exposure_us * factor;
        let (Some(dark), Some(bright)) = (self.dark, self.bright) else { return Some(aim) };
        if dark >= bright {
            // The light changed: the other bound is no longer valid.
            *self = Bounds::default();
            return Some(aim);
        }
        let within = aim > dark && aim < bright;
        (bright > NARROW * dark).then(|| if within { aim } else { (dark * bright).sqrt() })
    }
}

/// Factor by which an exposure that is not right is to be multiplied.
fn factor(seen: &Look) -> f64 {
    let middle = 0.5 * (WANTED[0] + WANTED[1]);
    match &seen.stripe {
        // The level of saturated peaks above full scale is unknown.
        Some(s) if s.saturated > 0.2 => 0.4,
        Some(s) if s.saturated > MOST_SATURATED => {
            if 0.95 * s.peak > CAREFUL {
                CAREFUL / s.peak
            } else {
                0.8
            }
        }
        Some(s) => (middle / s.peak).clamp(0.2, 5.0),
        None if seen.saturated > 0.01 => 0.3,
        None => 4.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::feature::{Feature, Range, Value};
    use crate::capture::{Event, Format, Picture, RoundTrip};
    use crate::raster::Image;
    use std::collections::VecDeque;

    /// Pictures of 100x80 at 50 a second by the camera's own clock. `waiting` of them are always in flight, so that
    /// those that arrive after a setting were exposed long before it. One line in `glint` is `glints` times as
    /// bright. In each picture that factor varies by up to a share of `flicker`, like counting noise.
    struct Late {
        exposure_us: f64,
        ns: u64,
        dated: bool,
        glint: u32,
        glints: f64,
        flicker: f64,
        waiting: VecDeque<(u64, f64)>,
        set: Vec<f64>,
    }

    impl Late {
        fn new(exposure_us: f64, dated: bool, glint: u32) -> Late {
            Late {
                exposure_us,
                ns: 7_000_000_000,
                dated,
                glint,
                glints: 10.0,
                flicker: 0.0,
                waiting: VecDeque::new(),
                set: Vec::new(),
            }
        }

        fn fill(&mut self, most: usize) {
            while self.waiting.len() < most {
                self.waiting.push_back((self.ns, self.exposure_us));
                self.ns += 20_000_000;
            }
        }
    }

    impl PictureSource for Late {
        fn format(&self) -> Format {
            Format { width: 100, height: 80, bits: 8 }
        }
        fn next(&mut self, within: Duration) -> Event {
            if within.is_zero() && self.waiting.is_empty() {
                return Event::Quiet;
            }
            if !within.is_zero() {
                self.fill(1);
            }
            let (ns, exposure_us) = self.waiting.pop_front().expect("filled");
            let level = |x: u32, y: u32| {
                let chance = (ns / 20_000_000 * 100 + u64::from(x)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
                let flicker = 1.0 + self.flicker * (chance as f64 / f64::from(1 << 23) - 1.0);
                let glint = if self.glint > 0 && x.is_multiple_of(self.glint) { self.glints * flicker } else { 1.0 };
                let across = f64::from(y) - 40.0;
                (2.0 + 0.1 * exposure_us * glint * (-0.5 * across * across / 2.25).exp()).min(255.0) as u8
            };
            let levels = (0..80).flat_map(|y| (0..100).map(move |x| (x, y))).map(|(x, y)| level(x, y)).collect();
            Event::Picture(Box::new(Picture {
                image: Image::from_u8(100, 80, levels),
                id: ns / 20_000_000,
                device_ns: self.dated.then_some(ns),
                host_ns: ns,
                exposure_ns: None,
                count: None,
                stand: None,
                profiles: None,
            }))
        }
        fn clock(&mut self) -> Result<Option<RoundTrip>> {
            let ns = self.ns;
            Ok(self.dated.then_some(RoundTrip { before_ns: ns, there_ns: ns, after_ns: ns }))
        }
        fn features(&mut self) -> Result<Vec<Feature>> {
            let value = Some(Value::Float(self.exposure_us));
            let range = Range::Between(1.0, 1e5);
            Ok(vec![Feature { name: "ExposureTime".into(), value, unit: "us".into(), range, writable: true }])
        }
        fn set(&mut self, _: &str, value: &str) -> Result<()> {
            // Pictures in flight were exposed before the setting.
            self.fill(6);
            self.exposure_us = value.parse().expect("a number");
            self.set.push(self.exposure_us);
            Ok(())
        }
        fn name(&self) -> String {
            "late".into()
        }
    }

    #[test]
    fn pictures_of_the_former_exposure_are_not_judged_however_many_are_under_way() {
        for dated in [true, false] {
            for from in [50.0, 30_000.0] {
                let mut camera = Late::new(from, dated, 0);
                let tuned = tune(&mut camera, |_, _| {}).unwrap();
                let peak = (2.0 + 0.1 * tuned.exposure_us) / 255.0;
                assert!((WANTED[0]..=WANTED[1]).contains(&peak) && tuned.remark.is_none(), "{tuned:?}");
                // Each step follows from its own pictures: at 0.1 levels per us none is tried twice.
                assert!(camera.set.len() <= 9, "dated {dated}: {:?}", camera.set);
                assert!(camera.set.is_sorted() == (from < 100.0), "it turned back: {:?}", camera.set);
            }
        }
    }

    #[test]
    fn where_a_few_glints_saturate_it_settles_on_what_is_best_or_says_so() {
        // One line in fifty is glossy: 2 % of the peaks are saturated before the others are half as bright.
        let fault = tune(&mut Late::new(1000.0, true, 50), |_, _| {}).unwrap_err();
        assert!(fault.what.contains("are saturated") && fault.next.contains("camera set ExposureTime"), "{fault}");
        // These are 1.6 times as bright as the others, which are at 60 % when these saturate.
        let tuned = tune(&mut Late { glints: 1.6, ..Late::new(1000.0, true, 50) }, |_, _| {}).unwrap();
        let stripe = tuned.look.stripe.as_ref().unwrap();
        assert!((0.58..0.66).contains(&stripe.peak) && stripe.saturated <= MOST_SATURATED, "{tuned:?}");
        assert!(tuned.remark.is_some_and(|said| said.contains("are saturated")));
        // Which pictures show one glint more is chance, not a change of light.
        for begun in 0..40 {
            let late = Late::new(200.0 + 60.0 * begun as f64, true, 50);
            let mut camera = Late { glints: 1.6, flicker: 0.2, ns: 7_000_000_000 + 20_000_000 * begun, ..late };
            let tuned = tune(&mut camera, |_, _| {}).unwrap();
            let stripe = tuned.look.stripe.as_ref().unwrap();
            assert!((0.5..0.72).contains(&stripe.peak) && stripe.saturated <= MOST_SATURATED, "{tuned:?}");
        }
        // Laser off, room light only.
        let fault = tune(&mut Late { glints: 0.0, ..Late::new(1000.0, true, 1) }, |_, _| {}).unwrap_err();
        assert!(fault.what.contains("no stripe"), "{fault}");
    }
}
