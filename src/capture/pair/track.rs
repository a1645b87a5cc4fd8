//! In: positions with their times, sample by sample. Out: position and speed at a time between two samples, or the
//! reason why they are unknown.
//! Frame and unit: base_from_flange in mm, or counts; the host's time in ns.

use crate::geometry::{Base, Flange, Rigid, exp, log};
use crate::recording::Stand;
use std::collections::VecDeque;

/// A position at a moment.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Host's time, ns.
    pub ns: u64,
    /// Standard deviation of that time, ns.
    pub sigma_ns: f64,
    /// The position.
    pub stand: Stand,
}

/// Position and speed between two samples.
#[derive(Clone, Copy, Debug)]
pub struct Between {
    /// The position.
    pub stand: Stand,
    /// Motion per second: for a flange the motion seen from the base (mm, then rad), for an axis its counts in the
    /// first element.
    pub rate: [f64; 6],
    /// Standard deviation of the samples' times, ns.
    pub sigma_ns: f64,
}

/// Number of stored samples; half a minute at 1000 a second.
const KEPT: usize = 30_000;
/// A gap is longer than this many usual steps, and longer than `SHORTEST_GAP`, ns.
const GAP: f64 = 2.5;
const SHORTEST_GAP: f64 = 20e6;
/// A jump exceeds this many times the usual motion around it, plus the shortest jump (mm or mrad of rotation;
/// counts).
const JUMP: f64 = 3.0;
const SHORTEST_JUMP: f64 = 0.3;
const SHORTEST_COUNTS: f64 = 10.0;

#[derive(Clone, Copy, Debug)]
struct Kept {
    sample: Sample,
    /// Whether time ran backwards, or the stream was interrupted, before it.
    broken: bool,
}

/// A stream of samples.
#[derive(Clone, Debug, Default)]
pub struct Track {
    samples: VecDeque<Kept>,
    broken: bool,
    /// Usual step, ns.
    step: f64,
    ended: bool,
    backwards: u64,
}

impl Track {
    /// Adds a sample. A sample that is not later than the last one breaks the track: nothing is interpolated across
    /// the break.
    pub fn add(&mut self, sample: Sample) {
        if let Some(last) = self.samples.back() {
            if sample.ns <= last.sample.ns {
                self.backwards += 1;
                self.samples.clear();
                self.broken = true;
            } else {
                let step = (sample.ns - last.sample.ns) as f64;
                let usual = if self.step == 0.0 { step } else { self.step };
                self.step = usual + 0.05 * (step - usual).clamp(-0.5 * usual, 0.5 * usual);
            }
        }
        self.samples.push_back(Kept { sample, broken: std::mem::take(&mut self.broken) });
        if self.samples.len() > KEPT {
            self.samples.pop_front();
        }
    }

    /// Marks an interruption of the stream: later samples do not continue the earlier ones.
    pub fn cut(&mut self) {
        self.broken = true;
    }

    /// No more samples will come.
    pub fn end(&mut self) {
        self.ended = true;
    }

    /// Time of the last sample.
    pub fn newest(&self) -> Option<u64> {
        self.samples.back().map(|k| k.sample.ns)
    }

    /// Number of times that time ran backwards.
    pub fn backwards(&self) -> u64 {
        self.backwards
    }

    /// Position at a time. `None`: it is too early to decide. `Err`: the reason why it stays unknown.
    pub fn at(&self, ns: u64) -> Option<Result<Between, String>> {
        let after = self.samples.partition_point(|k| k.sample.ns < ns);
        if after == self.samples.len() {
            let newest =
                self.newest().map_or("no pose came".into(), |n| format!("the last pose is {:.1} ms older", ms(ns, n)));
            return self.ended.then(|| Err(format!("after the last pose: {newest}; nothing is extrapolated")));
        }
        if after == 0 {
            return Some(Err(match self.samples.front() {
                Some(k) if k.broken => {
                    "before the first pose after the clock of the poses jumped or ran backwards".into()
                }
                Some(k) => format!("before the first pose, which is {:.1} ms younger", ms(k.sample.ns, ns)),
                None => "no pose came".into(),
            }));
        }
        // A jump can be recognised only with the sample after it.
        if after + 1 == self.samples.len() && !self.ended && self.samples.len() > 2 {
            return None;
        }
        let (a, b) = (self.samples[after - 1], self.samples[after]);
        if b.broken {
            return Some(Err("the clock of the poses jumped, or their stream was cut, around it".into()));
        }
        let (from, to) = (a.sample, b.sample);
        let dt = (to.ns - from.ns) as f64;
        let limit = (GAP * self.step).max(SHORTEST_GAP);
        if dt > limit {
            return Some(Err(format!(
                "a gap of {:.1} ms in the poses around it, limit {:.1}",
                dt * 1e-6,
                limit * 1e-6
            )));
        }
        if let Some(said) = self.jump(after) {
            return Some(Err(said));
        }
        let share = (ns - from.ns) as f64 / dt;
        let sigma_ns = from.sigma_ns.max(to.sigma_ns);
        Some(between(&from.stand, &to.stand, share, dt * 1e-9).map(|(stand, rate)| Between { stand, rate, sigma_ns }))
    }

    /// Whether the step to a sample exceeds its neighbours by more than any real motion can.
    fn jump(&self, to: usize) -> Option<String> {
        let way = |i: usize| -> Option<[f64; 2]> {
            let (a, b) = (self.samples.get(i.checked_sub(1)?)?, self.samples.get(i)?);
            (!b.broken).then(|| {
                let dt = (b.sample.ns - a.sample.ns) as f64 * 1e-9;
                [distance(&a.sample.stand, &b.sample.stand), dt]
            })
        };
        let [far, dt] = way(to)?;
        let speed = |i: Option<usize>| i.and_then(way).map(|[d, dt]| d / dt);
        let around = [speed(to.checked_sub(1)), speed(Some(to + 1))];
        let fastest = around.iter().flatten().fold(0.0, |m: f64, v| m.max(*v));
        // Without a neighbour there is nothing to compare with.
        around.iter().any(Option::is_some).then_some(())?;
        let shortest =
            if matches!(self.samples[to].sample.stand, Stand::Robot(_)) { SHORTEST_JUMP } else { SHORTEST_COUNTS };
        (far > JUMP * fastest * dt + shortest).then(|| {
            format!("the poses jump by {far:.3} around it, {:.3} is their usual way in that time", fastest * dt)
        })
    }
}

fn ms(a: u64, b: u64) -> f64 {
    (a as f64 - b as f64) * 1e-6
}

/// Distance in mm, mrad of rotation, or counts.
fn distance(a: &Stand, b: &Stand) -> f64 {
    match (a, b) {
        (Stand::Robot(a), Stand::Robot(b)) => {
            let (rad, mm) = a.difference(b);
            mm.max(1e3 * rad)
        }
        (Stand::Count(a), Stand::Count(b)) => (a - b).abs(),
        _ => f64::INFINITY,
    }
}

/// Interpolates on SE(3): the origin moves straight, the flange rotates evenly about one axis, as in an arm's
/// straight motion.
fn between(a: &Stand, b: &Stand, share: f64, seconds: f64) -> Result<(Stand, [f64; 6]), String> {
    match (a, b) {
        (Stand::Robot(a), Stand::Robot(b)) => {
            let turn = log(&(a.rotation.transpose() * b.rotation));
            let shift = b.translation - a.translation;
            let (rotation, translation) = (a.rotation * exp(&(turn * share)), a.translation + shift * share);
            let at: Rigid<Base, Flange> = Rigid::new(rotation, translation);
            let w = a.rotation * turn / seconds;
            let v = shift / seconds - w.cross(&translation);
            Ok((Stand::Robot(at), [v.x, v.y, v.z, w.x, w.y, w.z]))
        }
        (Stand::Count(a), Stand::Count(b)) => {
            let rate = (b - a) / seconds;
            Ok((Stand::Count(a + (b - a) * share), [rate, 0.0, 0.0, 0.0, 0.0, 0.0]))
        }
        _ => Err("poses of a robot and counts of an axis in one stream".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    fn pose(x: f64) -> Stand {
        Stand::Robot(Rigid::from_vectors(&Vec3::new(0.0, 0.0, 0.01 * x), Vec3::new(400.0 + x, 0.0, 300.0)))
    }

    /// Samples 8 ms apart at 20 mm/s; each may be changed or excluded.
    fn track(change: impl Fn(u64, &mut Sample) -> bool) -> Track {
        let mut track = Track::default();
        for k in 0..100u64 {
            let mut s = Sample { ns: 1_000_000_000 + k * 8_000_000, sigma_ns: 1e4, stand: pose(0.16 * k as f64) };
            if change(k, &mut s) {
                track.add(s);
            }
        }
        track.end();
        track
    }

    fn said(track: &Track, k: f64) -> String {
        let told = track.at((1e9 + k * 8e6) as u64).expect("it ended");
        told.err().unwrap_or_default()
    }

    #[test]
    fn between_two_poses_and_never_beyond() {
        let whole = track(|_, _| true);
        let told = whole.at(1_000_000_000 + 404_000_000).unwrap().unwrap();
        let (Stand::Robot(is), Stand::Robot(want)) = (told.stand, pose(0.16 * 50.5)) else { panic!() };
        assert!(is.difference(&want).1 < 1e-9 && is.difference(&want).0 < 1e-9);
        // The flange itself moves at 20 mm/s along x, whatever rotates.
        let v = Vec3::new(told.rate[0], told.rate[1], told.rate[2]);
        let w = Vec3::new(told.rate[3], told.rate[4], told.rate[5]);
        assert!((v + w.cross(&is.translation) - Vec3::new(20.0, 0.0, 0.0)).norm() < 1e-6);
        assert!(said(&whole, 99.5).contains("extrapolated") && said(&whole, -0.5).contains("before the first"));
        let open = {
            let mut t = track(|_, _| true);
            t.ended = false;
            t
        };
        assert!(open.at(1_000_000_000 + 800_000_000).is_none(), "it is too early to say");
    }

    #[test]
    fn gaps_jumps_and_time_that_runs_backwards_are_told() {
        let gap = track(|k, _| !(40..50).contains(&k));
        assert!(said(&gap, 45.0).contains("a gap of 88.0 ms"), "{}", said(&gap, 45.0));
        assert_eq!(said(&gap, 38.5) + &said(&gap, 51.5), "");
        let jump = track(|k, s| {
            if k >= 60 {
                s.stand = pose(0.16 * k as f64 + 5.0);
            }
            true
        });
        assert!(said(&jump, 59.5).contains("jump by"), "{}", said(&jump, 59.5));
        assert_eq!(said(&jump, 58.5) + &said(&jump, 60.5), "");
        let back = track(|k, s| {
            if k >= 70 {
                s.ns -= 100_000_000;
            }
            true
        });
        assert_eq!(back.backwards(), 1);
        assert!(said(&back, 50.0).contains("backwards"), "{}", said(&back, 50.0));
        assert_eq!(said(&back, 80.5 - 12.5), "");
    }
}
