//! In: pictures as they come, a way to pair. Out: each with where things stood, in order, or left out with the reason.
//! Frame and unit: base_from_flange, mm, or counts; times in ns.

use super::count::Counting;
use super::feed::PoseFeed;
use super::step::Still;
use crate::capture::clock::{ClockMap, Moment, now_ns};
use crate::capture::picture::{Numbering, Picture};
use crate::recording::{Pairing, Slip, Stand, Taken};
use std::collections::VecDeque;

/// How pictures and what moves are brought together.
pub enum Way {
    /// Nothing moves, or nobody wants to know.
    Nothing,
    /// The source says.
    Given,
    /// Everything stands still at a picture.
    Step(PoseFeed, Still),
    /// By number.
    Count(Counting),
    /// By time. The pictures' times are late by `delay_ns`, known to `delay_sigma_ns`.
    Clock {
        /// Where poses come from.
        poses: PoseFeed,
        /// Of the calibration of the latency; 0 where there is none.
        delay_ns: f64,
        /// 1 sigma.
        delay_sigma_ns: f64,
    },
}

/// A picture and where things stood.
#[derive(Debug)]
pub struct Paired {
    /// The picture.
    pub picture: Box<Picture>,
    /// Where what moves stood; none where nothing moves.
    pub stand: Option<Stand>,
    /// Numbers, clocks, pairing, uncertainty.
    pub taken: Taken,
}

/// A picture of which nobody knows where things stood.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LeftOut {
    /// The device's number of it.
    pub id: u64,
    /// When it was here, ns.
    pub host_ns: u64,
    /// Why.
    pub why: String,
}

/// What comes of a picture.
pub type Outcome = Result<Paired, LeftOut>;

/// A pose that does not come within this time, ns, does not come.
const PATIENCE: u64 = 1_000_000_000;
/// Scatter of arrivals of a device without a clock of its own, 1 sigma, ns: what a system's scheduler makes of them.
const ARRIVAL: f64 = 1e6;

/// Holds pictures until it is known where things stood.
pub struct Pairer {
    way: Way,
    waiting: VecDeque<(Box<Picture>, Numbering)>,
}

impl Pairer {
    /// Pairs in one way.
    pub fn new(way: Way) -> Pairer {
        Pairer { way, waiting: VecDeque::new() }
    }

    /// Takes in the next picture.
    pub fn push(&mut self, picture: Box<Picture>, numbering: Numbering) {
        self.waiting.push_back((picture, numbering));
    }

    /// What happened since it was asked last.
    pub fn news(&mut self) -> Vec<String> {
        if let Way::Count(counting) = &mut self.way { counting.news() } else { Vec::new() }
    }

    /// Pictures that wait for a pose.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// Where poses come from while it runs.
    pub fn poses(&self) -> Option<&PoseFeed> {
        match &self.way {
            Way::Step(poses, _) | Way::Clock { poses, .. } => Some(poses),
            _ => None,
        }
    }

    /// The next outcome, in the order of the pictures; `None` where it is too early to say. With `all` nothing is
    /// waited for.
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
                // A picture may be long under way: where the device has a clock, its exposure was when that says.
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
                    // Its clock is read again soon.
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

/// Something that stands still stood still this long before the picture too, and after it, or until it was here; ns.
const AROUND: u64 = 20_000_000;

struct Standing {
    pairing: Option<Pairing>,
    stand: Option<Stand>,
    time_sigma_ns: Option<f64>,
    rate: Option<Slip>,
    delay_ns: Option<f64>,
}

/// The middle of a picture's exposure by the host's clock: by the device's where it has one, else by the arrival.
pub fn middle(picture: &Picture, clock: &ClockMap) -> Moment {
    let half = 0.5 * picture.exposure_ns.unwrap_or(0) as f64;
    match picture.device_ns.and_then(|ns| clock.host(ns)) {
        Some(begun) => Moment { ns: begun.ns + half, ..begun },
        None => Moment { ns: picture.host_ns as f64 - half, sigma_ns: ARRIVAL },
    }
}
