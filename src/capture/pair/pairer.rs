//! In: pictures as they arrive, a way to pair. Out: each with the position of what moves, in order, or excluded with
//! the reason.
//! Frame and unit: base_from_flange, mm, or counts; times in ns.

use super::count::Counting;
use super::feed::PoseFeed;
use super::step::Still;
use crate::capture::clock::{ClockMap, Moment, now_ns};
use crate::capture::picture::{Numbering, Picture};
use crate::recording::{Pairing, Slip, Stand, Taken};
use std::collections::VecDeque;

/// How pictures and positions are paired.
pub enum Way {
    /// Nothing moves, or positions are not needed.
    Nothing,
    /// The source states the position.
    Given,
    /// Everything is at rest at a picture.
    Step(PoseFeed, Still),
    /// By number.
    Count(Counting),
    /// By time. The pictures' times are late by `delay_ns`, known to `delay_sigma_ns`.
    Clock {
        /// Source of the poses.
        poses: PoseFeed,
        /// Calibrated latency, ns; 0 if it was not calibrated.
        delay_ns: f64,
        /// Standard deviation of the latency, ns.
        delay_sigma_ns: f64,
    },
}

/// A picture with the position of what moves.
#[derive(Debug)]
pub struct Paired {
    /// The picture.
    pub picture: Box<Picture>,
    /// Position of what moves; none if nothing moves.
    pub stand: Option<Stand>,
    /// Numbers, clocks, pairing, uncertainty.
    pub taken: Taken,
}

/// An excluded picture, whose position is unknown.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LeftOut {
    /// The device's number of the picture.
    pub id: u64,
    /// Arrival, host's time, ns.
    pub host_ns: u64,
    /// Reason of the exclusion.
    pub why: String,
}

/// Result for a picture.
pub type Outcome = Result<Paired, LeftOut>;

/// A pose that does not arrive within this time, ns, is not waited for any longer.
const PATIENCE: u64 = 1_000_000_000;
/// Scatter of arrival times of a device without a clock, caused by the system's scheduler, 1 sigma, ns.
const ARRIVAL: f64 = 1e6;

/// Holds pictures until their position is known.
pub struct Pairer {
    way: Way,
    waiting: VecDeque<(Box<Picture>, Numbering)>,
}

impl Pairer {
    /// Pairs in the given way.
    pub fn new(way: Way) -> Pairer {
        Pairer { way, waiting: VecDeque::new() }
    }

    /// Adds the next picture.
    pub fn push(&mut self, picture: Box<Picture>, numbering: Numbering) {
        self.waiting.push_back((picture, numbering));
    }

    /// Messages since the last call.
    pub fn news(&mut self) -> Vec<String> {
        if let Way::Count(counting) = &mut self.way { counting.news() } else { Vec::new() }
    }

    /// Number of pictures that wait for a pose.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// The running source of poses, if there is one.
    pub fn poses(&self) -> Option<&PoseFeed> {
        match &self.way {
            Way::Step(poses, _) | Way::Clock { poses, .. } => Some(poses),
            _ => None,
        }
    }

    /// The next outcome, in the order of the pictures; `None` if it is too early to decide. With `all` it does not
    /// wait.
    pub fn next(&mut self, clock: &ClockMap, all: bool) -> Option<Outcome> {
        let (picture, numbering) = self.waiting.front()?;
        let late = all || now_ns().saturating_sub(picture.host_ns) > PATIENCE;
        let told = self.way.told(picture, *numbering, clock, late)?;
        let (picture, _) = self.waiting.pop_front()?;
        let Picture { id, device_ns, host_ns, exposure_ns, .. } = *picture;
        let Standing { pairing, stand, time_sigma_ns, rate, delay_ns } = match told {
            Ok(told) => told,
            Err(why) => return Some(Err(LeftOut { id, host_ns, why })),
        };
        let base_from_flange = None;
        let taken =
            Taken { id, device_ns, host_ns, exposure_ns, pairing, time_sigma_ns, delay_ns, rate, base_from_flange };
        let taken = taken.standing(stand.as_ref());
        Some(Ok(Paired { picture, stand, taken }))
    }
}

impl Way {
    fn told(
        &mut self,
        picture: &Picture,
        numbering: Numbering,
        clock: &ClockMap,
        late: bool,
    ) -> Option<Result<Standing, String>> {
        let plain = |pairing, stand| Standing { pairing, stand, time_sigma_ns: None, rate: None, delay_ns: None };
        match self {
            Way::Nothing => Some(Ok(plain(None, None))),
            Way::Given => Some(match picture.stand {
                Some(stand) => Ok(plain(Some(Pairing::Given), Some(stand))),
                None => Err("the source does not say where things stood".into()),
            }),
            Way::Count(counting) => Some(counting.at(picture, numbering).map(|s| plain(Some(Pairing::Count), Some(s)))),
            Way::Step(poses, still) => {
                // A picture may be in transit for long: if the device has a clock, it gives the time of the
                // exposure.
                let exposed = picture.exposure_ns.unwrap_or(0);
                if let Some(Some(Err(why))) = picture.device_ns.map(|ns| clock.told(ns, picture.host_ns)) {
                    return Some(Err(why));
                }
                let told = picture.device_ns.and_then(|ns| clock.host(ns));
                let begun = told.map_or(u64::MAX, |m| (m.ns - m.sigma_ns).max(0.0) as u64);
                let ended = told.map_or(u64::MAX, |m| (m.ns + m.sigma_ns) as u64 + exposed + AROUND);
                let from = begun.min(picture.host_ns.saturating_sub(exposed)).saturating_sub(AROUND);
                let to = ended.min(picture.host_ns);
                let (before, after) = match (poses.at(from), poses.at(to)) {
                    (Some(Ok(a)), Some(Ok(b))) => (a.stand, b.stand),
                    (Some(Err(why)), _) | (_, Some(Err(why))) => return Some(Err(why)),
                    _ => return late.then(|| Err("no pose came after the picture".into())),
                };
                Some(still.check(&before, &after).map(|()| plain(Some(Pairing::Step), Some(before))))
            }
            Way::Clock { poses, delay_ns, delay_sigma_ns } => {
                let middle = match picture.device_ns.map(|ns| clock.told(ns, picture.host_ns)) {
                    Some(Some(Err(why))) => return Some(Err(why)),
                    // The device's clock will be read again soon.
                    Some(None) if !late => return None,
                    _ => middle(picture, clock),
                };
                let at = middle.ns - *delay_ns;
                let Some(told) = poses.at(at.max(0.0) as u64) else {
                    return late.then(|| Err("no pose came after the picture; nothing is extrapolated".into()));
                };
                Some(told.map(|b| {
                    let sigma = middle.sigma_ns.hypot(b.sigma_ns);
                    let rate = match b.stand {
                        Stand::Robot(_) => Slip::Flange(b.rate),
                        Stand::Count(_) => Slip::Count(b.rate[0]),
                    };
                    let (pairing, stand) = (Some(Pairing::Clock), Some(b.stand));
                    let time_sigma_ns = Some(sigma.hypot(*delay_sigma_ns));
                    Standing { pairing, stand, time_sigma_ns, rate: Some(rate), delay_ns: Some(*delay_ns) }
                }))
            }
        }
    }
}

/// What is at rest must be at rest for this time before the exposure, and for this time after it or until the
/// picture arrived; ns.
const AROUND: u64 = 20_000_000;

struct Standing {
    pairing: Option<Pairing>,
    stand: Option<Stand>,
    time_sigma_ns: Option<f64>,
    rate: Option<Slip>,
    delay_ns: Option<f64>,
}

/// The middle of a picture's exposure by the host's clock: from the device's clock if it has one, else from the
/// arrival.
pub fn middle(picture: &Picture, clock: &ClockMap) -> Moment {
    let half = 0.5 * picture.exposure_ns.unwrap_or(0) as f64;
    match picture.device_ns.and_then(|ns| clock.host(ns)) {
        Some(begun) => Moment { ns: begun.ns + half, ..begun },
        None => Moment { ns: picture.host_ns as f64 - half, sigma_ns: ARRIVAL },
    }
}
