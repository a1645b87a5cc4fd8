//! In: the times of a scan's pictures as its recording states them, or nothing. Out: the time of every shot, and the
//! origin of the times in words.
//! Frame and unit: ns since 1970 (UTC).

use super::messages::Stamp;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::Taken;
use std::collections::BTreeMap;

/// Origin of the messages' times, for programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, strum::Display)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Source {
    /// Start of the exposure, by the camera's clock.
    Exposure,
    /// Arrival of the picture, minus its exposure time.
    Arrival,
    /// Artificial: no time is stated.
    Synthetic,
}

/// The times of a scan's shots.
#[derive(Clone, Debug)]
pub struct Clock {
    /// Origin of the times.
    pub source: Source,
    /// The origin in words, with the numbers that it depends on.
    pub words: String,
    taken: BTreeMap<u32, u64>,
    start: u64,
    step_ns: f64,
}

/// Latest time, ns: seconds of a message are an `int32`.
const LATEST: u64 = i32::MAX as u64 * 1_000_000_000;

impl Clock {
    /// An artificial clock: shot 0 at `created` (RFC 3339), `rate_hz` shots a second. `why` states the reason in
    /// words.
    ///
    /// # Errors
    /// A rate outside 0.001 to 100,000 per second; a text that is not a time.
    pub fn synthetic(created: &str, rate_hz: f64, why: &str) -> Result<Clock> {
        if !(1e-3..=1e5).contains(&rate_hz) {
            return Err(Fault::usage(format!("a rate of {rate_hz} shots per second, 0.001 to 100000 are possible"))
                .cause("a period was given for a rate")
                .next("give the rate at which the shots were taken: --rate 25"));
        }
        let ns = created.parse::<jiff::Timestamp>().ok().and_then(|t| u64::try_from(t.as_nanosecond()).ok());
        let start = ns.ok_or_else(|| {
            Fault::input(format!("scan.json was created at '{created}', which is not a time after 1970"))
                .cause("edited by hand, or written by a machine whose clock was not set")
                .next("scan again")
        })?;
        let words =
            format!("synthetic: {why}; shot 0 at {created}, when scan.json was written, {rate_hz} shots a second");
        let step_ns = 1e9 / rate_hz;
        Ok(Clock { source: Source::Synthetic, words, taken: BTreeMap::new(), start, step_ns })
    }

    /// The times that a recording states for shots, each given with its index.
    ///
    /// # Errors
    /// There are no shots.
    pub fn recorded<'a>(shots: impl Iterator<Item = (u32, &'a Taken)> + Clone) -> Result<Clock> {
        let exposed = |t: &Taken| t.exposure_ns.unwrap_or(0);
        // Upper bound of the lead of the host's clock over the camera's: no picture arrives before its exposure
        // ends.
        let ahead = |t: &Taken| Some(i128::from(t.host_ns) - i128::from(t.device_ns? + exposed(t)));
        let least =
            shots.clone().map(|(_, t)| ahead(t)).collect::<Option<Vec<_>>>().and_then(|all| all.into_iter().min());
        let at = |t: &Taken| match (least, t.device_ns) {
            (Some(least), Some(device)) => (i128::from(device) + least).max(0) as u64,
            _ => t.host_ns.saturating_sub(exposed(t)),
        };
        let taken: BTreeMap<u32, u64> = shots.map(|(shot, t)| (shot, at(t))).collect();
        let start = taken.values().min().copied().ok_or_else(|| {
            Fault::input("the recording states the time of no shot")
                .cause("it has no laser pictures")
                .next("scan again")
        })?;
        let (source, words) = match least {
            Some(least) => (
                Source::Exposure,
                format!(
                    "exposure: begin of the exposure by the camera's clock, {least} ns added so that the quickest \
                     picture arrives when its exposure ends; its readout and transfer, and the clocks' drift, remain"
                ),
            ),
            None => (
                Source::Arrival,
                "arrival: the host's time of a picture's last byte, less the exposure where one is stated; readout and \
                 transfer remain"
                    .to_owned(),
            ),
        };
        Ok(Clock { source, words, taken, start, step_ns: 0.0 })
    }

    /// Time of a shot.
    ///
    /// # Errors
    /// A time after January 2038, which the messages cannot hold; a shot without a time in the recording.
    pub fn at(&self, shot: u32) -> Result<Stamp> {
        let ns = match self.source {
            Source::Synthetic => self.start.saturating_add((f64::from(shot) * self.step_ns).round() as u64),
            _ => *self.taken.get(&shot).ok_or_else(|| {
                Fault::input(format!("shot {shot} is not in the recording"))
                    .cause("the recording of another scan was given")
                    .next("give the recording that was scanned")
            })?,
        };
        if ns > LATEST {
            return Err(Fault::input(format!(
                "shot {shot} was taken {ns} ns after 1970, at most {LATEST} fit a message"
            ))
            .cause("a clock that was not set, or a rate far too low")
            .next("exclude the recording, or give a higher --rate"));
        }
        Ok(Stamp(ns))
    }
}

/// The clock of a running camera: the time of each picture as it comes. The quickest picture so far sets the camera's
/// clock against the host's.
#[derive(Clone, Debug, Default)]
pub struct Running {
    /// Lead of the host's clock over the camera's, and the camera's time at which it was found, ns.
    set: Option<(i128, u64)>,
}

/// Largest drift of two clocks, as a share. A lead that was found earlier grows by it, so that it does not stay behind.
const DRIFT: i128 = 10_000;
/// A clock that leaps by more was set anew, ns.
const LEAP: i128 = 1_000_000_000;

impl Running {
    /// Time of a picture: the start of its exposure by the camera's clock, else its arrival less the exposure. All in
    /// ns; the latest time that a message can hold is the limit.
    pub fn at(&mut self, device_ns: Option<u64>, host_ns: u64, exposure_ns: Option<u64>) -> Stamp {
        let exposed = exposure_ns.unwrap_or(0);
        let Some(device) = device_ns else { return Stamp(host_ns.saturating_sub(exposed).min(LATEST)) };
        let lead = i128::from(host_ns) - i128::from(device) - i128::from(exposed);
        let lead = match self.set {
            Some((before, then)) if then <= device => {
                let grown = before + i128::from(device - then) / DRIFT;
                if lead - grown > LEAP { lead } else { lead.min(grown) }
            }
            _ => lead,
        };
        self.set = Some((lead, device));
        Stamp((i128::from(device) + lead).clamp(0, i128::from(LATEST)) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_camera_is_dated_by_its_quickest_picture() {
        let (mut clock, ms) = (Running::default(), 1_000_000);
        let at = |c: &mut Running, device: u64, host: u64| c.at(Some(device), host, Some(2 * ms)).0;
        // 10, 4 and 9 ms from the end of the exposure to the arrival.
        assert_eq!(at(&mut clock, 0, 1_012 * ms), 1_010 * ms);
        assert_eq!(at(&mut clock, 100 * ms, 1_106 * ms), 1_104 * ms);
        assert_eq!(at(&mut clock, 200 * ms, 1_211 * ms), 1_204 * ms + 10_000);
        // The camera's clock starts again.
        assert_eq!(at(&mut clock, 5 * ms, 1_400 * ms), 1_398 * ms);
        // It leaps back by an hour as seen from the host, which is later than any transfer.
        assert_eq!(at(&mut clock, 6 * ms, 3_600_000 * ms), 3_599_998 * ms);
        assert_eq!(Running::default().at(None, 50 * ms, Some(ms)).0, 49 * ms);
        assert_eq!(Running::default().at(None, u64::MAX, None).0, LATEST);
    }

    fn taken(device_ns: Option<u64>, host_ns: u64) -> Taken {
        let text = serde_json::json!({"id": 1, "device_ns": device_ns, "host_ns": host_ns, "exposure_ns": 1000});
        serde_json::from_value(text).unwrap()
    }

    #[test]
    fn the_quickest_picture_sets_the_cameras_clock() {
        let shots = [
            (0, taken(Some(5_000), 1_000_000)),
            (2, taken(Some(25_000), 1_030_000)),
            (3, taken(Some(35_000), 1_031_000)),
        ];
        let clock = Clock::recorded(shots.iter().map(|(s, t)| (*s, t))).unwrap();
        // From the end of its exposure by the other clock, shot 0 took 994,000 ns to arrive, shot 2 1,004,000, shot
        // 3 995,000.
        assert_eq!(clock.source, Source::Exposure);
        assert_eq!([0, 2, 3].map(|s| clock.at(s).unwrap().0), [999_000, 1_019_000, 1_029_000]);
        assert!(clock.words.contains("994000 ns"), "{}", clock.words);
        assert!(clock.at(1).unwrap_err().what.contains("shot 1"));
        let late = [(0, taken(None, 1_000_000)), (1, taken(Some(3), 1_010_000))];
        let clock = Clock::recorded(late.iter().map(|(s, t)| (*s, t))).unwrap();
        assert_eq!((clock.source, clock.at(1).unwrap().0), (Source::Arrival, 1_009_000));
    }

    #[test]
    fn a_clock_that_nobody_had_says_so() {
        let clock = Clock::synthetic("1970-01-01T00:00:02Z", 4.0, "no recording was given").unwrap();
        assert_eq!(clock.at(6).unwrap().0, 3_500_000_000);
        assert!(
            clock.words.starts_with("synthetic: no recording was given") && clock.words.contains("4 shots a second")
        );
        for rate in [0.0, -1.0, f64::NAN, 1e6] {
            assert!(Clock::synthetic("2026-01-01T00:00:00Z", rate, "").is_err(), "{rate}");
        }
        assert!(Clock::synthetic("yesterday", 1.0, "").unwrap_err().what.contains("yesterday"));
        let slow = Clock::synthetic("2037-12-31T00:00:00Z", 0.001, "").unwrap();
        assert!(slow.at(100_000).unwrap_err().what.contains("shot 100000"));
    }
}
