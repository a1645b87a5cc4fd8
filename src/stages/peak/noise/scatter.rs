//! In: squared residuals of pixels whose light is known. Out: the read noise, shot noise and speckle that caused them.
//! Frame and unit: grey levels of the picture's depth inside, of an 8-bit picture in [`Scatter`]. docs/math.md, Stripe
//! peak (6).

use crate::stages::peak::params::PeakParams;
use nalgebra::{Matrix3, Vector3};

/// The three sources of noise of a pixel, in the units of [`PeakParams`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Scatter {
    pub read_noise: f32,
    pub gain: f32,
    pub speckle: f32,
}

/// Least read noise in steps of the picture's levels: rounding alone has a variance of a twelfth of a squared step.
const ROUNDING: f32 = 0.3;
/// The settings count like this many pixels: if the light is the same everywhere, shot noise and speckle cannot be
/// distinguished.
const BELIEF: f64 = 10.0;

/// A sum of squares that exceeds its mean by more than this many standard deviations is not noise alone.
const SURE: f64 = 3.0;
/// The lower quarter of a normal distribution ends this many standard deviations below its mean.
const QUARTILE: f64 = 0.674;

/// Largest misfit that noise alone can explain, over the upper end of the lower quarter of misfits. A sum of `free`
/// squares has a relative standard deviation of sqrt(2 / free).
pub(in super::super) fn most(free: f64) -> f64 {
    let scatter = (2.0 / free.max(1.0)).sqrt().min(1.0);
    (1.0 + SURE * scatter) / (1.0 - QUARTILE * scatter)
}

/// Sums for least squares of e² against left (r² + k level + c² light²) over some pixels, each in units of its expected
/// variance.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super) struct Sums {
    normal: Matrix3<f64>,
    right: Vector3<f64>,
    squares: f64,
    expected: f64,
    expected2: f64,
}

impl Sums {
    /// Adds a pixel of this `weight`. `left` holds the shares of its variance and of its speckle's variance that remain
    /// in the residual of a fit. `variance` is the assumed one.
    pub fn add(
        &mut self,
        weight: f32,
        left: (f32, f32),
        residual: f32,
        (light, background): (f32, f32),
        variance: f32,
    ) {
        let [weight, left, grained, residual, light, background, variance] =
            [weight, left.0, left.1, residual, light, background, variance].map(f64::from);
        let row = Vector3::new(left, left * (light + background), grained * (light * light)) / variance;
        let seen = residual * residual / variance;
        self.normal += row * row.transpose() * weight;
        self.right += row * (weight * seen);
        self.squares += weight * seen;
        self.expected += weight * left;
        self.expected2 += (weight * left).powi(2);
    }
    /// Sum of the squares over its expected value.
    pub fn misfit(&self) -> f64 {
        self.squares / self.expected.max(1e-9)
    }
    /// Effective number of squares: that many of equal weight would scatter like these.
    pub fn freedom(&self) -> f64 {
        self.expected.powi(2) / self.expected2.max(1e-9)
    }
}

impl Scatter {
    pub fn of(p: &PeakParams) -> Scatter {
        Scatter { read_noise: p.read_noise, gain: p.gain, speckle: p.speckle }
    }

    /// Fits all sums. No result is negative: one that would be is held at its least value, and the others are solved
    /// again.
    pub fn fit(all: &[Sums], assumed: &Scatter, full_scale: f32) -> Scatter {
        let scale = f64::from(full_scale) / 255.0;
        let [r, k, c] = [assumed.read_noise, assumed.gain, assumed.speckle].map(f64::from);
        let before = Vector3::new((r * scale).powi(2), k * scale, c * c);
        let least = Vector3::new(f64::from(ROUNDING).powi(2).max((0.1 * scale).powi(2)), 0.0, 0.0);
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for s in all {
            normal += s.normal;
            right += s.right;
        }
        for i in 0..3 {
            let belief = BELIEF / before[i].max(1e-6).powi(2);
            normal[(i, i)] += belief;
            right[i] += belief * before[i];
        }
        let mut held = [false; 3];
        let mut found = before;
        for _ in 0..3 {
            let (mut n, mut v) = (normal, right);
            for i in (0..3).filter(|&i| held[i]) {
                v -= normal.column(i) * least[i];
                n.row_mut(i).fill(0.0);
                n.column_mut(i).fill(0.0);
                n[(i, i)] = 1.0;
            }
            (0..3).filter(|&i| held[i]).for_each(|i| v[i] = least[i]);
            found = n.lu().solve(&v).unwrap_or(before);
            let Some(low) = (0..3).find(|&i| found[i] < least[i]) else { break };
            held[low] = true;
        }
        let [r2, k, c2] = [0, 1, 2].map(|i| found[i].max(least[i]));
        Scatter {
            read_noise: ((r2.sqrt() / scale) as f32).clamp(0.1, 20.0),
            gain: ((k / scale) as f32).clamp(0.0, 5.0),
            speckle: (c2.sqrt() as f32).clamp(0.0, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::noise::Noise;

    /// Pixels of all levels, scattered with the noise to be found, in pictures of 8 and of 12 bits.
    #[test]
    fn read_shot_and_speckle_noise_are_told_apart() {
        for (bits, truth) in [
            (8, Scatter { read_noise: 0.5, gain: 0.02, speckle: 0.1 }),
            (8, Scatter { read_noise: 2.0, gain: 0.2, speckle: 0.0 }),
            (12, Scatter { read_noise: 0.2, gain: 0.01, speckle: 0.3 }),
        ] {
            let full = ((1u32 << bits) - 1) as f32;
            let scale = full / 255.0;
            let variance = |s: &Scatter, light: f32, base: f32| {
                (s.read_noise * scale).powi(2) + s.gain * scale * (light + base) + (s.speckle * light).powi(2)
            };
            let assumed = Scatter::of(&PeakParams::default());
            let mut noise = Noise(3);
            let sums: Vec<Sums> = (0..400)
                .map(|_| {
                    let mut s = Sums::default();
                    for i in 0..30 {
                        let (light, base) = (full * 0.8 * (-0.01 * (i * i) as f32).exp(), 0.02 * full);
                        let e = noise.normal() as f32 * variance(&truth, light, base).sqrt();
                        s.add(1.0, (1.0, 1.0), e, (light, base), variance(&assumed, light, base));
                    }
                    s
                })
                .collect();
            let found = Scatter::fit(&sums, &assumed, full);
            let off = |a: f32, b: f32, least: f32| (a - b).abs() / b.max(least);
            assert!(off(found.speckle, truth.speckle, 0.1) < 0.15, "{found:?}, {truth:?}");
            // The variance of a pixel in the dark, on the flank and on the crest determines the fit's weights. If
            // speckle exceeds the other two sources, they cannot be distinguished, and need not be.
            for light in [0.0, 0.1, 0.4, 0.8].map(|share| share * full) {
                let [seen, true_one] = [&found, &truth].map(|s| variance(s, light, 0.02 * full));
                assert!(off(seen, true_one, 0.0) < 0.15, "light {light}: {seen} of {true_one}; {found:?}, {truth:?}");
            }
            if truth.speckle < 0.2 {
                assert!(off(found.read_noise, truth.read_noise, 0.3) < 0.15, "{found:?}, {truth:?}");
                assert!(off(found.gain, truth.gain, 0.03) < 0.3, "{found:?}, {truth:?}");
            }
        }
    }
}
