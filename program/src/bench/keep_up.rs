//! In: a rate of pictures. Out: how many pictures of a camera with that rate the newest-picture chain measures, at
//! half and at full resolution. Every picture is counted in one class.
//! Frame and unit: px, pictures, ms from a picture's last byte to its points.

use super::scenes::{Scene, pictures};
use super::steady::percentile;
use sheetlight::camera::{Distortion, Intrinsics};
use sheetlight::capture::{Event, Fate, Fed, Feed, FeedOptions, Format, Mode, Picture, PictureSource, now_ns};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Plane, Vec3};
use sheetlight::raster::Image;
use sheetlight::rig::{Calibration, Covariance, Kind, Quality, Rig, Verdict};
use sheetlight::scan::{Extraction, Live, Where};
use sheetlight::stages::stripe::point::Optics;
use std::time::Duration;

/// Half of the resolution, and the full resolution.
const SIZES: [(u32, u32); 2] = [(640, 480), (1280, 960)];
/// Number of different pictures that are sent in turn.
const PICTURES: u32 = 8;
/// Longest wait for a picture before the end of the run is checked.
const WITHIN: Duration = Duration::from_millis(100);

/// What became of a camera's pictures.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct KeptUp {
    /// Processor or device that measured them.
    pub on: String,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Rate of the camera, pictures a second.
    pub rate_hz: f64,
    /// Pictures that were sent.
    pub sent: u64,
    /// Sent pictures that gave points.
    pub measured: u64,
    /// Pictures skipped because a newer one had arrived.
    pub passed_over: u64,
    /// Pictures lost otherwise: not taken from the camera in time, or without a stripe.
    pub lost: u64,
    /// Time from a picture's last byte to its points, ms: median and 99th percentile.
    pub ms: [f64; 2],
}

/// Runs the chain at both sizes for `seconds` each.
///
/// # Errors
/// A rate or time out of range; no GPU if one is requested; no thread.
pub fn keep_up(rate_hz: f64, seconds: f64, place: Where) -> Result<Vec<KeptUp>> {
    if !(0.1..=10_000.0).contains(&rate_hz) || !(0.1..=600.0).contains(&seconds) {
        return Err(Fault::usage(format!(
            "{rate_hz} pictures a second for {seconds} s, 0.1 to 10000 for 0.1 to 600 s are possible"
        ))
        .next("correct the number"));
    }
    SIZES.into_iter().map(|size| at(size, rate_hz, seconds, place)).collect()
}

fn at((width, height): (u32, u32), rate_hz: f64, seconds: f64, place: Where) -> Result<KeptUp> {
    let images = pictures(Scene::OneStripe, width, height, PICTURES);
    let format = Format { width, height, bits: 8 };
    let rig = rig(&Scene::OneStripe.optics(width, height), width, height);
    let mut live = Live::new(&rig, format, &Extraction::default(), None, place)?;
    // The first pictures compile the chain and determine the stripe.
    for image in &images {
        live.measure(0, image.clone())?;
    }
    let source = Paced { images, format, period: (1e9 / rate_hz) as u64, start: now_ns(), next: 0 };
    let options = FeedOptions { mode: Mode::Newest, seconds: Some(seconds), ..FeedOptions::default() };
    let feed = Feed::start(Box::new(source), options)?;
    let (mut waits, mut measured) = (Vec::new(), 0);
    loop {
        let picture = match feed.next(WITHIN) {
            Fed::Picture(picture, _) => picture,
            Fed::Quiet => continue,
            Fed::Ended(None) => break,
            Fed::Ended(Some(fault)) => return Err(fault),
        };
        let seen = live.measure(picture.id as u32, picture.image)?;
        feed.fate(Fate::Used);
        waits.push(now_ns().saturating_sub(picture.host_ns) as f64 * 1e-9);
        measured += u64::from(seen.is_some_and(|m| m.points.iter().any(|p| p.sigma_mm.is_finite())));
    }
    let a = feed.account();
    if waits.is_empty() {
        return Err(Fault::refused(format!("no picture was measured in {seconds} s"))
            .cause("no picture came in that time at this rate, or this machine is overloaded")
            .next("measure for longer"));
    }
    Ok(KeptUp {
        on: live.ran_on(),
        width,
        height,
        rate_hz,
        sent: a.sent,
        measured,
        passed_over: a.dropped_processing,
        lost: a.sent.saturating_sub(measured + a.dropped_processing),
        ms: [0.5, 0.99].map(|p| percentile(&mut waits, p)),
    })
}

/// A rig that fits these pictures.
fn rig(o: &Optics, width: u32, height: u32) -> Rig {
    let [fx, fy, cx, cy, skew] = o.pinhole.map(f64::from);
    let mut lens = [0.0; 14];
    lens.iter_mut().zip(o.distortion).for_each(|(to, from)| *to = from.into());
    let camera = Intrinsics { fx, fy, cx, cy, skew, distortion: Distortion(lens), width, height };
    let plane = Plane::new(Vec3::from(o.normal.as_dvec3().to_array()), o.offset.into()).expect("a normal");
    let quality = Quality {
        verdict: Verdict::Good,
        reasons: vec!["drawn pictures".into()],
        advice: vec![],
        figures: Default::default(),
        per_picture: vec![],
    };
    let camera = Calibration::new(Kind::Camera, camera, None, Covariance::default(), quality.clone());
    let laser_plane = Calibration::new(Kind::LaserPlane, plane, Some(&camera), Covariance::default(), quality);
    Rig { laser_plane: Some(laser_plane), camera: Some(camera), ..Rig::default() }
}

/// A camera that runs at its own pace: pictures not taken in time are lost, which its numbers show.
struct Paced {
    images: Vec<Image>,
    format: Format,
    /// Time between two pictures, ns.
    period: u64,
    start: u64,
    next: u64,
}

impl PictureSource for Paced {
    fn format(&self) -> Format {
        self.format
    }

    fn next(&mut self, within: Duration) -> Event {
        let due = self.start + self.next * self.period;
        let now = now_ns();
        if due > now {
            std::thread::sleep(Duration::from_nanos(due - now).min(within));
            if due > now_ns() {
                return Event::Quiet;
            }
        }
        self.next = self.next.max((now_ns() - self.start) / self.period);
        let (id, host_ns) = (self.next, now_ns());
        self.next += 1;
        let image = self.images[(id % self.images.len() as u64) as usize].clone();
        let picture = Picture::arrived(image, id, host_ns);
        Event::Picture(Box::new(picture))
    }

    fn sent(&self) -> Option<u64> {
        Some(self.next)
    }

    fn name(&self) -> String {
        "pictures that are drawn".into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `Err` if too little was measured for a comparison, which happens when the machine stalls.
    fn slow_and_fast() -> std::result::Result<(), String> {
        let kept = |rate_hz, seconds| keep_up(rate_hz, seconds, Where::Cpu).map_err(|e| e.what);
        for k in kept(8.0, 0.6)? {
            assert_eq!(k.sent, k.measured + k.passed_over + k.lost, "{k:?}");
            assert!(k.sent >= k.measured && k.ms[0] > 0.0 && k.ms[1] >= k.ms[0], "{k:?}");
            if k.measured == 0 {
                return Err(format!("{k:?}"));
            }
        }
        // A higher rate than any machine can measure: the remaining pictures are counted as skipped or lost.
        let fast = kept(10_000.0, 0.5)?;
        for k in &fast {
            assert_eq!(k.sent, k.measured + k.passed_over + k.lost, "{k:?}");
            assert!(k.passed_over + k.lost > k.sent / 4, "{k:?}");
        }
        // Four times the pixels take longer.
        let compared = fast.iter().all(|k| k.sent > 2000) && fast[1].ms[0] > fast[0].ms[0];
        if compared { Ok(()) } else { Err(format!("{fast:?}")) }
    }

    #[test]
    fn every_picture_is_accounted_for_slow_and_fast() {
        let came = (0..2).find_map(|_| slow_and_fast().ok());
        came.map_or_else(slow_and_fast, Ok).unwrap();
        assert!(keep_up(0.0, 1.0, Where::Cpu).is_err() && keep_up(30.0, f64::NAN, Where::Cpu).is_err());
    }
}
