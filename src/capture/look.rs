//! In: a picture of a stripe. Out: its levels, and along the stripe how bright, how wide and how dark it is; the exposure that suits it.
//! Frame and unit: px; shares of full scale and of the stripe's length; exposure in us.

use super::feature::{Range, Value};
use super::picture::{Event, PictureSource};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use std::time::{Duration, Instant};

/// Levels of a picture and its stripe.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Look {
    /// Lowest, median, 99th percentile, highest level.
    pub levels: [u16; 4],
    /// Share of saturated pixels.
    pub saturated: f64,
    /// Pixels by level, sixteen ranges of the same width.
    pub histogram: [u64; 16],
    /// None where no line of the picture shows one.
    pub stripe: Option<StripeLook>,
}

/// A stripe, looked at across, line by line of the picture.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StripeLook {
    /// It lies: it is looked at column by column.
    pub lying: bool,
    /// Level that a twentieth of its peaks are above, as share of full scale.
    pub peak: f64,
    /// Share of its peaks that are saturated.
    pub saturated: f64,
    /// Full width at half height, px, median.
    pub width_px: f64,
    /// Its peak against the level beside it, median.
    pub contrast: f64,
    /// Share of the lines without a stripe.
    pub dark: f64,
    /// Peak (share of full scale) in eight parts along it; 0 where dark.
    pub along: [f64; 8],
}

/// Where the peak is to stand, and how many may be saturated.
pub const WANTED: [f64; 2] = [0.70, 0.85];
/// Share of saturated peaks that is still right.
pub const MOST_SATURATED: f64 = 0.005;
/// A peak stands out from its line by so many times the line's own scatter, and by this share of full scale.
const STANDS_OUT: f64 = 8.0;
const LEAST: f64 = 0.03;

/// Looks at a picture.
pub fn look(image: &Image) -> Look {
    let full = f64::from(image.full_scale());
    let mut counts = vec![0u64; usize::from(image.full_scale()) + 1];
    (0..image.height).for_each(|y| (0..image.width).for_each(|x| counts[usize::from(image.get(x, y))] += 1));
    let total = image.pixel_count() as u64;
    let level = |share: f64| {
        let mut left = (share * (total - 1) as f64) as u64;
        let at = counts.iter().position(|n| {
            let here = left < *n;
            left = left.saturating_sub(*n);
            here
        });
        at.unwrap_or(0) as u16
    };
    let mut histogram = [0; 16];
    counts.iter().enumerate().for_each(|(l, n)| histogram[l * 16 / counts.len()] += n);
    let saturated = *counts.last().expect("a level") as f64 / total as f64;
    let levels = [level(0.0), level(0.5), level(0.99), level(1.0)];
    let [lying, upright] = [true, false].map(|lying| across(image, lying, full));
    // The right way to look at a stripe shows it in more lines, and narrower.
    let score = |s: &Option<StripeLook>| s.as_ref().map_or(0.0, |s| (1.0 - s.dark) / s.width_px.max(1.0));
    let stripe = if score(&lying) >= score(&upright) { lying } else { upright };
    Look { levels, saturated, histogram, stripe }
}

fn across(image: &Image, lying: bool, full: f64) -> Option<StripeLook> {
    let (lines, length) = if lying { (image.width, image.height) } else { (image.height, image.width) };
    let (mut peaks, mut widths, mut contrasts, mut saturated) = (Vec::new(), Vec::new(), Vec::new(), 0u32);
    let mut along = [(0.0, 0u32); 8];
    let mut line = vec![0u16; length as usize];
    for k in 0..lines {
        line.iter_mut().zip(0..).for_each(|(l, i)| *l = if lying { image.get(k, i) } else { image.get(i, k) });
        let (at, top) = line.iter().copied().enumerate().max_by_key(|(_, l)| *l)?;
        let mut sorted = line.clone();
        sorted.sort_unstable();
        let part = |share: f64| f64::from(sorted[(share * (sorted.len() - 1) as f64) as usize]);
        let (ground, scatter) = (part(0.5), (part(0.84) - part(0.5)).max(0.5));
        let rises = f64::from(top) - ground;
        if rises < STANDS_OUT * scatter || rises < LEAST * full {
            continue;
        }
        let half = ground + 0.5 * rises;
        let above = |l: &u16| f64::from(*l) > half;
        let after = line[at..].iter().take_while(|l| above(l)).count();
        let before = line[..at].iter().rev().take_while(|l| above(l)).count();
        peaks.push(f64::from(top) / full);
        widths.push((after + before) as f64);
        contrasts.push(f64::from(top) / ground.max(1.0));
        saturated += u32::from(top == image.full_scale());
        let eighth = &mut along[(k * 8 / lines) as usize];
        *eighth = (eighth.0 + f64::from(top) / full, eighth.1 + 1);
    }
    let shown = peaks.len();
    if shown * 50 < lines as usize {
        return None;
    }
    let at = |v: &mut Vec<f64>, share: f64| {
        v.sort_by(f64::total_cmp);
        v[(share * (v.len() - 1) as f64) as usize]
    };
    Some(StripeLook {
        lying,
        peak: at(&mut peaks, 0.95),
        saturated: f64::from(saturated) / shown as f64,
        width_px: at(&mut widths, 0.5),
        contrast: at(&mut contrasts, 0.5),
        dark: 1.0 - shown as f64 / f64::from(lines),
        along: along.map(|(sum, n)| if n > 0 { sum / f64::from(n) } else { 0.0 }),
    })
}

impl Look {
    /// Whether the exposure is right.
    pub fn right(&self) -> bool {
        self.stripe.as_ref().is_some_and(|s| (WANTED[0]..=WANTED[1]).contains(&s.peak) && s.saturated <= MOST_SATURATED)
    }

    /// By how much the exposure is to be multiplied.
    fn factor(&self) -> f64 {
        let middle = 0.5 * (WANTED[0] + WANTED[1]);
        match &self.stripe {
            // Nothing is known of what lies above full scale.
            Some(s) if s.saturated > 0.2 => 0.4,
            Some(s) if s.saturated > MOST_SATURATED => (middle / s.peak).min(0.9),
            Some(s) => (middle / s.peak).clamp(0.2, 5.0),
            None if self.saturated > 0.01 => 0.3,
            None => 4.0,
        }
    }
}

impl std::fmt::Display for Look {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, median, p99, high] = self.levels;
        let saturated = 100.0 * self.saturated;
        writeln!(f, "levels: lowest {low}, median {median}, 99 % {p99}, highest {high}; {saturated:.3} % saturated")?;
        let total: u64 = self.histogram.iter().sum();
        let bar = |n: &u64| b" .:-=+*#%@"[(9.0 * (1.0 + *n as f64).ln() / (1.0 + total as f64).ln()) as usize] as char;
        writeln!(f, "histogram, dark to full scale: [{}]", self.histogram.iter().map(bar).collect::<String>())?;
        let Some(s) = &self.stripe else { return write!(f, "no stripe") };
        let along: Vec<String> = s.along.iter().map(|p| format!("{:.0}", 100.0 * p)).collect();
        write!(
            f,
            "stripe ({}): peaks at {:.0} % of full scale, {:.2} % of them saturated, {:.1} px wide, contrast {:.0}, dark {:.1} %; along it {} %",
            if s.lying { "lying" } else { "upright" },
            100.0 * s.peak,
            100.0 * s.saturated,
            s.width_px,
            s.contrast,
            100.0 * s.dark,
            along.join(" ")
        )
    }
}

/// Pictures that were exposed before a setting took effect.
const STALE: usize = 2;
const TRIES: usize = 15;
/// An exposure of seconds, and cameras that begin slowly.
const PATIENCE: Duration = Duration::from_secs(30);

/// The next picture that was taken after now.
///
/// # Errors
/// None comes within `patience`; the camera is gone.
pub fn fresh(source: &mut dyn PictureSource, patience: Duration) -> Result<Image> {
    let until = Instant::now() + patience;
    let mut stale = STALE;
    while Instant::now() < until {
        match source.next(Duration::from_millis(100)) {
            Event::Picture(_) if stale > 0 => stale -= 1,
            Event::Picture(picture) => return Ok(picture.image),
            Event::Lost(fault) => return Err(fault),
            Event::Ended => break,
            Event::Quiet | Event::Incomplete { .. } => {}
        }
    }
    Err(Fault::input(format!("{}: no picture within {:.0} s", source.name(), patience.as_secs_f64()))
        .cause("it waits for a trigger, or its packets do not come through (packet size, firewall)")
        .next("see TriggerMode: sheetlight camera show; or try gige://...?packet=1500"))
}

/// What tuning came to.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Tuned {
    /// us.
    pub exposure_us: f64,
    /// What pictures look like at it.
    pub look: Look,
}

/// Finds the exposure at which the stripe's peak is right, and leaves it set.
///
/// # Errors
/// A source without ExposureTime; no stripe at any exposure; a stripe too bright or too dark at the ends of its range.
pub fn tune(source: &mut dyn PictureSource, mut tried: impl FnMut(f64, &Look)) -> Result<Tuned> {
    let features = source.features()?;
    let names = ["ExposureTime", "ExposureTimeAbs"];
    let feature = names.iter().find_map(|n| features.iter().find(|f| f.name == *n)).ok_or_else(|| {
        Fault::usage(format!("{}: has no ExposureTime to set", source.name()))
            .cause("a pipe, a folder, a file, or a camera whose exposure is set elsewhere")
            .next("set the exposure there; sheetlight camera snap says how the stripe looks")
    })?;
    let (low, high) = if let Range::Between(low, high) = feature.range { (low.max(1.0), high) } else { (1.0, 1e6) };
    let mut exposure_us = match feature.value {
        Some(Value::Float(v)) => v,
        Some(Value::Integer(v)) => v as f64,
        _ => 1000.0,
    };
    for _ in 0..TRIES {
        let look = look(&fresh(source, PATIENCE)?);
        tried(exposure_us, &look);
        if look.right() {
            return Ok(Tuned { exposure_us, look });
        }
        let next = (exposure_us * look.factor()).clamp(low, high);
        if (next - exposure_us).abs() < 1e-3 * exposure_us {
            return Err(Fault::refused(format!(
                "at {exposure_us:.0} us, the end of its range ({low:.0} to {high:.0}), {look}"
            ))
            .cause("laser, lens aperture or gain do not suit")
            .next("change the aperture, the laser's power or the gain, then tune again"));
        }
        exposure_us = next;
        source.set(&feature.name, &format!("{exposure_us}"))?;
    }
    Err(Fault::refused(format!("no exposure suits after {TRIES} tries, the last was {exposure_us:.0} us"))
        .cause("the light changes: a laser that is switched, room light, something that moves")
        .next("hold everything still and tune again"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(peak: f64, lying: bool) -> Image {
        let (w, h) = (200u32, 160u32);
        let at = |x: u32, y: u32| {
            let (along, across) = if lying { (x, y) } else { (y, x) };
            let middle = 70.0 + 0.1 * f64::from(along);
            let stripe = peak * (-0.5 * ((f64::from(across) - middle) / 2.0).powi(2)).exp();
            // A tenth of the stripe is in shadow.
            let shown = if along < 16 { 0.0 } else { stripe };
            (10.0 + f64::from((x * 7 + y * 13) % 5) + shown).min(255.0) as u8
        };
        Image::from_u8(w, h, (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect())
    }

    #[test]
    fn a_stripe_is_looked_at_across() {
        for lying in [true, false] {
            let seen = look(&picture(190.0, lying));
            let stripe = seen.stripe.as_ref().unwrap();
            assert_eq!(stripe.lying, lying);
            assert!((stripe.width_px - 4.7).abs() < 1.0 && (stripe.peak - 0.79).abs() < 0.03, "{seen}");
            assert!((stripe.dark - 16.0 / if lying { 200.0 } else { 160.0 }).abs() < 0.01 && seen.right(), "{seen}");
        }
        let bright = look(&picture(500.0, true));
        assert!(bright.stripe.as_ref().unwrap().saturated > 0.9 && !bright.right() && bright.factor() < 1.0);
        assert!(look(&picture(0.0, true)).stripe.is_none());
    }
}
