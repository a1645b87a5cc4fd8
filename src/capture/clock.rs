//! In: the system's clock. Out: the host's time, which runs evenly while the program runs; the reading of another
//! clock between two host times; the relation of one clock to the other.
//! Frame and unit: ns; the host's time counts from the Unix epoch.

use std::collections::VecDeque;
use std::sync::OnceLock;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The host's time, ns since the Unix epoch. The system's clock is read once; from then on the steady clock counts,
/// so that setting the system's clock does not make the time jump.
pub fn now_ns() -> u64 {
    ns_of(Instant::now())
}

/// A moment of the steady clock as the host's time, ns since the Unix epoch. Order and distances of moments are
/// preserved, whenever they are converted.
pub fn ns_of(moment: Instant) -> u64 {
    static START: OnceLock<(u64, Instant)> = OnceLock::new();
    let (epoch, began) = START.get_or_init(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        (since.as_nanos() as u64, Instant::now())
    });
    match moment.checked_duration_since(*began) {
        Some(after) => epoch + after.as_nanos() as u64,
        None => epoch.saturating_sub(began.duration_since(moment).as_nanos() as u64),
    }
}

/// A reading of another clock between two host times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RoundTrip {
    /// Host's time when the question was sent, ns.
    pub before_ns: u64,
    /// The other clock's answer, ns.
    pub there_ns: u64,
    /// Host's time when the answer arrived, ns.
    pub after_ns: u64,
}

/// The best reading of each interval of this length, ns, is kept, for this many intervals.
const STRETCH: u64 = 2_000_000_000;
const STRETCHES: usize = 32;
/// Assumed largest rate difference of two quartz clocks before it is measured.
const DRIFT: f64 = 100e-6;
/// From this span of readings on, ns, the rate difference is measured instead of bounded.
const SPAN: f64 = 4e9;

/// A moment of the host's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// ns since the Unix epoch.
    pub ns: f64,
    /// Standard deviation, ns.
    pub sigma_ns: f64,
}

#[derive(Clone, Copy, Debug)]
struct Reading {
    there: f64,
    /// Host's time minus the other clock's, ns.
    offset: f64,
    /// Bound of the error, ns. For a one-way reading the excess over the shortest delay is unknown: infinite.
    half: f64,
}

/// Relation of another clock to the host's. It uses the shortest round trips. For a clock that cannot be queried it
/// uses the earliest arrivals; then the shortest transmission delay is part of the offset.
#[derive(Clone, Debug, Default)]
pub struct ClockMap {
    best: VecDeque<Reading>,
    /// Whether readings are one-way: then the scatter of late arrivals is no error, but that of the earliest is.
    one_way: bool,
    /// First reading of both clocks: times are stored relative to it, so that f64 is accurate enough.
    origin: Option<(u64, u64)>,
    /// Host's time of the last reading.
    newest: u64,
    jumps: u32,
    /// Up to this host's time the other clock's readings are unknown, because it jumped.
    unsure_until: u64,
}

/// If readings disagree by more than transmission times and drift explain, plus this tolerance, ns, the clock was
/// set.
const ODD: f64 = 2e5;

impl ClockMap {
    /// Adds a reading by round trip.
    pub fn round_trip(&mut self, trip: RoundTrip) {
        let here = trip.before_ns + (trip.after_ns - trip.before_ns) / 2;
        self.add(trip.there_ns, here, 0.5 * (trip.after_ns - trip.before_ns) as f64);
    }

    /// Adds a reading in one direction: a message stamped `there_ns` arrived at `here_ns`.
    pub fn one_way(&mut self, there_ns: u64, here_ns: u64) {
        self.one_way = true;
        self.add(there_ns, here_ns, f64::INFINITY);
    }

    fn add(&mut self, there_ns: u64, here_ns: u64, half: f64) {
        let reading = self.reading(there_ns, here_ns, half);
        // The clock was set or restarted: earlier readings are useless.
        if self.best.back().is_some_and(|b| !self.agree(b, &reading)) {
            self.begin_anew(here_ns + if half.is_finite() { half as u64 } else { 0 });
            return self.add(there_ns, here_ns, half);
        }
        self.origin.get_or_insert((there_ns, here_ns));
        let there = reading.there;
        self.newest = here_ns;
        let same = |b: &Reading| (b.there / STRETCH as f64).floor() == (there / STRETCH as f64).floor();
        match self.best.back_mut().filter(|b| same(b)) {
            Some(b) => {
                let better = if self.one_way { reading.offset < b.offset } else { reading.half < b.half };
                if better {
                    *b = reading;
                }
            }
            None => self.best.push_back(reading),
        }
        if self.best.len() > STRETCHES {
            self.best.pop_front();
        }
    }

    fn reading(&self, there_ns: u64, here_ns: u64, half: f64) -> Reading {
        let (there0, here0) = self.origin.unwrap_or((there_ns, here_ns));
        let there = there_ns as f64 - there0 as f64;
        Reading { there, offset: (here_ns as f64 - here0 as f64) - there, half }
    }

    /// Whether two readings, the older one first, are of a clock that ran on without a jump.
    fn agree(&self, b: &Reading, reading: &Reading) -> bool {
        let behind = reading.there + 1.0 < b.there - STRETCH as f64;
        let ways = if self.one_way { 0.5e9 } else { reading.half + b.half + ODD };
        !behind && (reading.offset - b.offset).abs() <= ways + DRIFT * (reading.there - b.there).abs()
    }

    /// Whether a round trip shows that the other clock ran on since its last reading: it was not reset and kept its
    /// power.
    pub fn ran_on(&self, trip: RoundTrip) -> bool {
        let here = trip.before_ns + (trip.after_ns - trip.before_ns) / 2;
        let reading = self.reading(trip.there_ns, here, 0.5 * (trip.after_ns - trip.before_ns) as f64);
        !self.one_way && self.best.back().is_some_and(|b| self.agree(b, &reading))
    }

    /// Discards all readings of the other clock. What arrived up to `until_ns` of the host's time can no longer be
    /// converted.
    pub fn begin_anew(&mut self, until_ns: u64) {
        let jumps = self.jumps + 1;
        *self = ClockMap { jumps, unsure_until: until_ns, one_way: self.one_way, ..ClockMap::default() };
    }

    /// Number of times that the other clock jumped or restarted.
    pub fn jumps(&self) -> u32 {
        self.jumps
    }

    /// Converts a time of the other clock, for something that arrived at `here_ns`, to the host's time. `None` if
    /// the clock has not been read since, so that it may have jumped; `Err` if it did.
    pub fn told(&self, there_ns: u64, here_ns: u64) -> Option<Result<Moment, String>> {
        if here_ns <= self.unsure_until {
            return Some(Err("the camera's clock jumped around it".into()));
        }
        if !self.one_way && self.newest < here_ns {
            return None;
        }
        self.host(there_ns).map(Ok)
    }

    /// Converts a time of the other clock to the host's; `None` before the first reading.
    pub fn host(&self, there_ns: u64) -> Option<Moment> {
        let (there0, here0) = self.origin?;
        let there = there_ns as f64 - there0 as f64;
        let (offset, sigma_ns) = self.offset(there)?;
        Some(Moment { ns: here0 as f64 + there + offset, sigma_ns })
    }

    /// Offset at a time of the other clock, with its sigma.
    fn offset(&self, there: f64) -> Option<(f64, f64)> {
        let (first, last) = (self.best.front()?, self.best.back()?);
        // Half of a round trip bounds the error, which is taken as uniform within that bound.
        let sigma = |r: &Reading| if r.half.is_finite() { (r.half / 3f64.sqrt()).max(100.0) } else { 1e5 };
        let nearest = self.best.iter().min_by(|a, b| {
            let cost = |r: &Reading| sigma(r) + DRIFT * (r.there - there).abs();
            cost(a).total_cmp(&cost(b))
        })?;
        if last.there - first.there < SPAN || self.best.len() < 3 {
            return Some((nearest.offset, sigma(nearest) + DRIFT * (nearest.there - there).abs()));
        }
        let weights = self.best.iter().map(|r| 1.0 / sigma(r).powi(2));
        let (mut w, mut wx, mut wy, mut wxx, mut wxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (r, k) in self.best.iter().zip(weights) {
            (w, wx, wy) = (w + k, wx + k * r.there, wy + k * r.offset);
            (wxx, wxy) = (wxx + k * r.there * r.there, wxy + k * r.there * r.offset);
        }
        let (mx, my) = (wx / w, wy / w);
        let spread = wxx / w - mx * mx;
        let rate = (wxy / w - mx * my) / spread;
        let at = |x: f64| my + rate * (x - mx);
        let n = self.best.len() as f64;
        let residual = (self.best.iter().map(|r| (r.offset - at(r.there)).powi(2)).sum::<f64>() / (n - 2.0)).sqrt();
        let stated = (1.0 / w).sqrt() * n.sqrt();
        // Asymmetric transmission times cause errors of one sign: the mean is no better than a single reading.
        let sigma = residual.max(if self.one_way { 0.0 } else { stated });
        Some((at(there), sigma * (1.0 + (there - mx).powi(2) / spread / n).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drifting_clock_is_told_by_its_shortest_round_trips() {
        // 50 ppm fast, 1e15 ns off; transmission times of 0.1 to 5 ms, one direction slower than the other.
        let there = |here: u64| 1_000_000_000_000_000 + here + here / 20_000;
        let mut map = ClockMap::default();
        let mut state = 1u64;
        for k in 0..400u64 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let (out, back) = (50_000 + (state >> 33) % 2_000_000, 50_000 + (state >> 13) % 3_000_000);
            let before_ns = k * 100_000_000;
            map.round_trip(RoundTrip { before_ns, there_ns: there(before_ns + out), after_ns: before_ns + out + back });
        }
        for here in [20_000_000_000u64, 39_900_000_000] {
            let told = map.host(there(here)).unwrap();
            let error = told.ns - here as f64;
            assert!(error.abs() < 4.0 * told.sigma_ns && error.abs() < 1.5e5, "{error} {told:?}");
        }
        assert_eq!(map.jumps(), 0);
        map.round_trip(RoundTrip { before_ns: 41_000_000_000, there_ns: 5, after_ns: 41_000_100_000 });
        assert_eq!(map.jumps(), 1);
        assert!((map.host(5).unwrap().ns - 41_000_050_000.0).abs() < 1.0);
    }

    /// A jump of 30 ms, which transmission times of half a millisecond do not explain: arrivals around it get no
    /// time.
    #[test]
    fn a_small_jump_is_seen_and_what_came_around_it_is_not_told() {
        let mut map = ClockMap::default();
        let read = |map: &mut ClockMap, before_ns: u64, ahead: u64| {
            map.round_trip(RoundTrip {
                before_ns,
                there_ns: before_ns + 250_000 + ahead,
                after_ns: before_ns + 500_000,
            });
        };
        (0..50).for_each(|k| read(&mut map, k * 200_000_000, 0));
        let last = 49 * 200_000_000;
        assert!(map.told(last, last).unwrap().is_ok() && map.told(last + 50_000_000, last + 50_000_000).is_none());
        read(&mut map, last + 200_000_000, 30_000_000);
        assert_eq!(map.jumps(), 1);
        assert!(map.told(last + 50_000_000, last + 50_000_000).unwrap().is_err());
        read(&mut map, last + 400_000_000, 30_000_000);
        let told = map.told(last + 330_000_000, last + 310_000_000).unwrap().unwrap();
        let trip = |before_ns: u64, ahead: u64| RoundTrip {
            before_ns,
            there_ns: before_ns + 250_000 + ahead,
            after_ns: before_ns + 500_000,
        };
        assert!(map.ran_on(trip(last + 9_000_000_000, 30_000_000)), "as it was, ten seconds later");
        assert!(!map.ran_on(trip(last + 9_000_000_000, 0)) && !ClockMap::default().ran_on(trip(last, 0)));
        assert!((told.ns - (last + 300_000_000) as f64).abs() < 1e6, "{told:?}");
    }

    /// The moments are converted in arbitrary order; only their distances matter.
    #[test]
    fn moments_of_the_steady_clock_keep_their_distances_to_the_nanosecond() {
        let first = Instant::now();
        let told = ns_of(first);
        for k in 0..20_000u64 {
            let later = first + std::time::Duration::from_nanos(k * 37);
            assert_eq!(ns_of(later) - told, k * 37);
        }
        assert_eq!(ns_of(first), told);
        assert!(now_ns() >= told);
    }

    #[test]
    fn arrivals_alone_leave_the_shortest_way_in_the_offset() {
        let mut map = ClockMap::default();
        for k in 0..1000u64 {
            map.one_way(k * 20_000_000, 7_000_000_000 + k * 20_000_000 + 900_000 + (k * 7919 % 13) * 100_000);
        }
        let told = map.host(10_000_000_000).unwrap();
        assert!((told.ns - 17_000_900_000.0).abs() < 1e4, "{told:?}");
    }
}
