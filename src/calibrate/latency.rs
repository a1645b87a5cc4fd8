//! In: points of a part that was scanned back and forth, each with its velocity in the cloud. Out: the delay of the
//! pictures' times against the poses' times at which both passes show the same part.
//! Frame and unit: the cloud's frame, mm; seconds.

use crate::fault::{Fault, Result};
use crate::geometry::Vec3;
use nalgebra::Matrix3;

/// A point, and its displacement in the cloud per second by which the pose of its shot is later.
#[derive(Clone, Copy, Debug)]
pub struct Passing {
    /// Position, mm.
    pub at: Vec3,
    /// Displacement per second, mm/s.
    pub velocity: Vec3,
}

/// The delay that was found.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Delay {
    /// Delay of the pictures' times beyond the delay already applied, s.
    pub seconds: f64,
    /// Standard deviation of the delay, s.
    pub sigma_s: f64,
    /// Difference in height between the passes without and with the delay, mm (robust rms).
    pub apart_mm: [f64; 2],
    /// Speeds of the passes, mm/s; the forward direction is positive.
    pub speeds: Vec<f64>,
}

/// Strips along the motion, each compared separately, and parts of them for the jackknife error.
const STRIPS: usize = 96;
const PARTS: usize = 12;
/// Heights that differ by more than this carry little information about the delay, mm: shadows, reflections.
const SCALE: f64 = 0.5;
/// Lower limit of this scale where the passes nearly agree, mm.
const FINEST: f64 = 0.02;
const ROUNDS: usize = 8;
/// The lowest cost must be below this share of the median cost.
const DISTINCT: f64 = 0.8;
/// Largest delay that is searched for, s.
const FARTHEST: f64 = 0.15;
/// A shot slower than this share of the fastest is at a turning point and is skipped.
const CRUISE: f64 = 0.5;

/// A point in motion coordinates: position along the motion and height, mm; speed along the motion, mm/s.
#[derive(Clone, Copy)]
struct Place {
    u: f64,
    h: f64,
    speed: f64,
}

/// One pass: the places of each strip, in order along the motion.
struct Pass {
    forth: bool,
    strips: Vec<Vec<Place>>,
    speed: f64,
}

/// Finds the delay. `shots`: the points of each shot, in order of time.
///
/// # Errors
/// No motion, or motion in one direction only; too few points; a part without slopes or edges across the motion.
pub fn delay(shots: &[Vec<Passing>], up: &Vec3) -> Result<Delay> {
    let (along, fastest) = main_way(shots)?;
    let across = up.cross(&along).normalize();
    let height = along.cross(&across);
    let passes = split(shots, &along, &across, &height, fastest);
    let pairs: Vec<(&Pass, &Pass)> =
        passes.iter().flat_map(|a| passes.iter().map(move |b| (a, b))).filter(|(a, b)| a.forth && !b.forth).collect();
    if pairs.is_empty() {
        return Err(Fault::refused(format!("{} passes, all in one direction", passes.len()))
            .cause("a delay shifts the part along the motion; only the way back shows the amount")
            .next("record the same part back and forth"));
    }
    let spacing = spacing(&passes);
    // A step that shifts both passes by a quarter of the distance between two shots.
    let step = 0.25 * spacing / (2.0 * fastest);
    let steps = (FARTHEST / step).ceil() as i64;
    let coarse = costs(&pairs, spacing, SCALE, (-steps..=steps).map(|k| k as f64 * step));
    let total = |c: &Cost| c.all().unwrap_or(f64::INFINITY);
    let best = (0..coarse.len()).min_by(|&a, &b| total(&coarse[a].1).total_cmp(&total(&coarse[b].1))).expect("some");
    let mut seconds = coarse[best].0;
    // A part that looks the same everywhere has no distinct minimum, only noise.
    let mut all: Vec<f64> = coarse.iter().map(|(_, c)| total(c)).filter(|c| c.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    if all.is_empty() || total(&coarse[best].1) > DISTINCT * all[all.len() / 2] {
        return Err(flat());
    }
    // Where the passes nearly agree, their scatter is known. Much larger differences (edges, shadows) carry no
    // information about a fraction of a step.
    let scale = (3.0 * scatter(&pairs, spacing, seconds)).clamp(FINEST, SCALE);
    let mut fine = Vec::new();
    for _ in 0..ROUNDS {
        fine = costs(&pairs, spacing, scale, (-8..=8).map(|k| seconds + f64::from(k) * 0.25 * step));
        let next = lowest(&fine, None).filter(|s| s.abs() < FARTHEST).ok_or_else(flat)?;
        let moved = (next - seconds).clamp(-2.0 * step, 2.0 * step);
        seconds += moved;
        if moved.abs() < 0.02 * step {
            break;
        }
    }
    let parts: Vec<f64> = (0..PARTS).filter_map(|p| lowest(&fine, Some(p))).collect();
    let n = parts.len() as f64;
    if parts.len() < PARTS / 2 {
        return Err(flat());
    }
    let mean = parts.iter().sum::<f64>() / n;
    // Jackknife: each estimate excludes one part.
    let sigma_s = ((n - 1.0) / n * parts.iter().map(|d| (d - mean).powi(2)).sum::<f64>()).sqrt();
    let at = |s: f64| costs(&pairs, spacing, SCALE, std::iter::once(s))[0].1.all().unwrap_or(f64::NAN).sqrt();
    let apart_mm = [at(0.0), at(seconds)];
    let speeds = passes.iter().map(|p| if p.forth { p.speed } else { -p.speed }).collect();
    Ok(Delay { seconds, sigma_s, apart_mm, speeds })
}

fn flat() -> Fault {
    Fault::refused("the passes show no delay")
        .cause("a flat part looks the same everywhere, or the passes do not overlap")
        .next("pass over a part with slopes, or with edges slanted to the stripe")
}

/// Direction of the motion and its largest speed.
fn main_way(shots: &[Vec<Passing>]) -> Result<(Vec3, f64)> {
    let of = |shot: &Vec<Passing>| shot.get(shot.len() / 2).map(|p| p.velocity);
    let ways: Vec<Vec3> = shots.iter().filter_map(of).collect();
    let fastest = ways.iter().map(|v| v.norm()).fold(0.0, f64::max);
    if fastest < 1e-3 {
        return Err(Fault::refused(format!(
            "nothing moves: {fastest:.4} mm/s at most, of {} shots with points",
            ways.len()
        ))
        .cause("a recording that was paired standing still, or without poses")
        .next("record with --pair clock while the part is passed back and forth"));
    }
    let spread: Matrix3<f64> = ways.iter().map(|v| v * v.transpose()).sum();
    let eigen = spread.symmetric_eigen();
    Ok((eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned(), fastest))
}

fn split(shots: &[Vec<Passing>], along: &Vec3, across: &Vec3, height: &Vec3, fastest: f64) -> Vec<Pass> {
    let all = || shots.iter().flatten().map(|p| p.at.dot(across));
    let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), w| (l.min(w), h.max(w)));
    let width = ((high - low) / STRIPS as f64).max(1e-9);
    let mut passes: Vec<Pass> = Vec::new();
    for shot in shots {
        let Some(middle) = shot.get(shot.len() / 2) else { continue };
        let speed = middle.velocity.dot(along);
        if speed.abs() < CRUISE * fastest {
            continue;
        }
        let forth = speed > 0.0;
        if passes.last().is_none_or(|p| p.forth != forth) {
            passes.push(Pass { forth, strips: vec![Vec::new(); STRIPS], speed: speed.abs() });
        }
        let pass = passes.last_mut().expect("pushed above");
        let mut sums = vec![[0.0; 4]; STRIPS];
        for p in shot {
            let strip = (((p.at.dot(across) - low) / width) as usize).min(STRIPS - 1);
            let row = [p.at.dot(along), p.at.dot(height), p.velocity.dot(along), 1.0];
            sums[strip].iter_mut().zip(row).for_each(|(s, v)| *s += v);
        }
        for (strip, [u, h, v, n]) in pass.strips.iter_mut().zip(sums) {
            if n > 0.0 {
                strip.push(Place { u: u / n, h: h / n, speed: v / n });
            }
        }
    }
    for strip in passes.iter_mut().flat_map(|p| &mut p.strips) {
        strip.sort_by(|a, b| a.u.total_cmp(&b.u));
    }
    passes
}

/// Median distance between two shots along the motion, mm.
fn spacing(passes: &[Pass]) -> f64 {
    let steps = passes.iter().flat_map(|p| &p.strips).flat_map(|s| s.windows(2).map(|w| w[1].u - w[0].u));
    let mut steps: Vec<f64> = steps.collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0).max(1e-6)
}

/// Per part: cost of the height differences and their number.
struct Cost(Vec<[f64; 2]>);

impl Cost {
    /// Mean over all parts; `None` where too little overlaps.
    fn all(&self) -> Option<f64> {
        self.without(usize::MAX)
    }
    fn without(&self, part: usize) -> Option<f64> {
        let kept = self.0.iter().enumerate().filter(|(p, _)| *p != part).map(|(_, c)| c);
        let [sum, n] = kept.fold([0.0; 2], |[s, n], c| [s + c[0], n + c[1]]);
        (n >= 100.0).then(|| sum / n)
    }
}

fn costs(pairs: &[(&Pass, &Pass)], spacing: f64, scale: f64, delays: impl Iterator<Item = f64>) -> Vec<(f64, Cost)> {
    let at = |delay: f64| {
        let mut cost = vec![[0.0; 2]; PARTS];
        for (a, b) in pairs {
            for (k, (sa, sb)) in a.strips.iter().zip(&b.strips).enumerate() {
                let [sum, n] = &mut cost[k * PARTS / STRIPS];
                compare(sa, sb, delay, spacing, |r| {
                    *sum += r * r / (1.0 + r * r / (scale * scale));
                    *n += 1.0;
                });
            }
        }
        (delay, Cost(cost))
    };
    delays.map(at).collect()
}

/// Usual difference between the heights of two passes, 1 sigma, mm.
fn scatter(pairs: &[(&Pass, &Pass)], spacing: f64, delay: f64) -> f64 {
    let mut all = Vec::new();
    for (a, b) in pairs {
        a.strips.iter().zip(&b.strips).for_each(|(a, b)| compare(a, b, delay, spacing, |r| all.push(r.abs())));
    }
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).map_or(SCALE, |m| 1.4826 * m)
}

/// Height differences of two passes over one strip, at positions four times as dense as the shots.
fn compare(a: &[Place], b: &[Place], delay: f64, spacing: f64, mut take: impl FnMut(f64)) {
    let (mut a, mut b) = (Walk::new(a, delay, spacing), Walk::new(b, delay, spacing));
    let (Some(first), Some(last)) = (a.first().zip(b.first()), a.last().zip(b.last())) else { return };
    let (from, to) = (first.0.max(first.1), last.0.min(last.1));
    let step = 0.25 * spacing;
    // The grid is fixed to the part, not to the passes.
    let mut k = (from / step).ceil();
    while k * step <= to {
        if let (Some(ha), Some(hb)) = (a.height(k * step), b.height(k * step)) {
            take(ha - hb);
        }
        k += 1.0;
    }
}

/// Interpolates heights along a strip whose places are shifted by a delay.
struct Walk<'a> {
    places: &'a [Place],
    delay: f64,
    gap: f64,
    at: usize,
}

impl<'a> Walk<'a> {
    fn new(places: &'a [Place], delay: f64, spacing: f64) -> Walk<'a> {
        Walk { places, delay, gap: 2.5 * spacing, at: 0 }
    }
    fn u(&self, p: &Place) -> f64 {
        p.u - p.speed * self.delay
    }
    fn first(&self) -> Option<f64> {
        self.places.first().map(|p| self.u(p))
    }
    fn last(&self) -> Option<f64> {
        self.places.last().map(|p| self.u(p))
    }
    /// Height at a position that is not before the previous query; `None` in a gap.
    fn height(&mut self, u: f64) -> Option<f64> {
        while self.at + 2 < self.places.len() && self.u(&self.places[self.at + 1]) < u {
            self.at += 1;
        }
        let (a, b) = (self.places.get(self.at)?, self.places.get(self.at + 1)?);
        let (ua, ub) = (self.u(a), self.u(b));
        let inside = ua <= u && u <= ub && ub - ua < self.gap && ub > ua;
        inside.then(|| a.h + (b.h - a.h) * (u - ua) / (ub - ua))
    }
}

/// Minimum of the parabola through the costs, without one part if stated.
fn lowest(costs: &[(f64, Cost)], without: Option<usize>) -> Option<f64> {
    let points: Option<Vec<(f64, f64)>> =
        costs.iter().map(|(d, c)| Some((*d, c.without(without.unwrap_or(usize::MAX))?))).collect();
    let points = points?;
    let centre = points[points.len() / 2].0;
    let width = points.last()?.0 - centre;
    let mut normal = Matrix3::zeros();
    let mut right = Vec3::zeros();
    for (d, c) in &points {
        let x = (d - centre) / width;
        let row = Vec3::new(1.0, x, x * x);
        normal += row * row.transpose();
        right += row * *c;
    }
    let p = normal.try_inverse()? * right;
    (p.z > 0.0).then(|| centre - 0.5 * p.y / p.z * width)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave scanned back and forth at 20 mm/s with pictures `late` seconds late: 0.3 mm between shots, 0.02 mm
    /// height noise.
    fn passed(late: f64, wave: f64) -> Vec<Vec<Passing>> {
        let mut state = 7u64;
        let mut noise = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 0.02 * 12f64.sqrt()
        };
        let surface = |x: f64, w: f64| wave * ((x + 0.2 * w) / 4.0).sin();
        let mut shots = Vec::new();
        for (speed, from) in [(20.0, 0.0), (-20.0, 40.0)] {
            for k in 0..130 {
                let x = from + speed * f64::from(k) * 0.015;
                let velocity = Vec3::new(speed, 0.0, 0.0);
                let point = |j: u32| {
                    let w = 0.25 * f64::from(j);
                    // The true surface when the picture was taken, at the pose of `late` seconds afterwards.
                    Passing { at: Vec3::new(x + speed * late, w, surface(x, w) + noise()), velocity }
                };
                shots.push((0..120).map(point).collect());
            }
        }
        shots
    }

    #[test]
    fn a_delay_is_found_by_what_went_to_and_fro() {
        for late in [0.0, 3.7e-3, -0.02] {
            let found = delay(&passed(late, 1.0), &Vec3::z()).unwrap();
            let error = found.seconds - late;
            assert!(error.abs() < 1e-4 && error.abs() < 4.0 * found.sigma_s + 2e-5, "{late}: {found:?}");
        }
    }

    #[test]
    fn what_shows_no_delay_is_refused() {
        let one_way: Vec<_> = passed(0.0, 1.0).into_iter().take(100).collect();
        assert!(delay(&one_way, &Vec3::z()).unwrap_err().what.contains("one direction"));
        assert!(delay(&[], &Vec3::z()).unwrap_err().what.contains("nothing moves"));
        let flat = delay(&passed(0.0, 0.0), &Vec3::z()).unwrap_err();
        assert!(flat.what.contains("show no delay"), "{flat}");
    }
}
