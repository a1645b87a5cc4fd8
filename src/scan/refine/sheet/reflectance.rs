//! In: the light that several shots show at one place along the stripe, and the distances of their sheets from a point
//! there. Out: how far the reflectance shifts the middle of the point's light from the sheet's middle, with its
//! standard deviation.
//! Frame and unit: standard deviations of the sheet, along its normal; light relative to the point's own.
//! docs/math.md, Sheets that are thick (2) to (4).

use nalgebra::{SMatrix, SVector};
use std::sync::LazyLock;

/// Distance between two places where the reflectance may change.
const APART: f64 = 0.5;
/// Such places lie up to this far beyond the outermost sheet, and nowhere farther away than `FARTHEST`.
const BEYOND: f64 = 1.0;
pub(super) const FARTHEST: f64 = 8.0;
/// Sum of the variances of all changes before any light is seen, and variance of the level beside them.
const CHANGES: f64 = 1.0;
const LEVEL: f64 = 100.0;
/// The variances are computed this many times from the changes before. Each time the reflectance has fewer and larger
/// changes, as print and edges have.
const ROUNDS: usize = 8;
/// A change of this size, divided by the root of their number, keeps a variance, so that it can grow again.
const LEAST: f64 = 0.05;
/// No light is less than this share of the point's own: the model would let it become 0 or negative.
const DARK: f64 = 0.05;
/// Largest shift. A sheet of which only a sliver beyond two standard deviations is reflected gives no point.
const MOST: f64 = 1.5;

/// Light of one shot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Light {
    /// Distance of the shot's sheet from the point.
    pub at: f64,
    /// Light, relative to that of the point, and its standard deviation.
    pub light: f64,
    pub sigma: f64,
}

/// Lights within half of this are one: closer steps tell no finer reflectance.
const CELL: f64 = 0.5;
/// Most lights after that; the nearest count. Few of them take less time.
const FEW: usize = 5;
const LIGHTS: usize = 13;
const UNKNOWN: Light = Light { at: 0.0, light: 0.0, sigma: 1e4 };

/// Shift of the light's middle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shift {
    pub by: f64,
    pub sigma: f64,
}

/// Steps of the table of the normal distribution in one standard deviation, and its end.
const STEPS: f64 = 64.0;
const END: f64 = 8.0;

/// The normal distribution's integral; linear between the table's entries, 2e-5 off at most.
static INTEGRAL: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let entries = (2.0 * END * STEPS) as usize + 2;
    (0..entries).map(|i| 0.5 * libm::erfc((END - i as f64 / STEPS) * std::f64::consts::FRAC_1_SQRT_2)).collect()
});

fn integral(z: f64) -> f64 {
    let place = (z + END).clamp(0.0, 2.0 * END) * STEPS;
    let i = place as usize;
    INTEGRAL[i] + (place - i as f64) * (INTEGRAL[i + 1] - INTEGRAL[i])
}

fn density(z: f64) -> f64 {
    (-0.5 * z * z).exp() * 0.398_942_280_401_432_7
}

/// The shift of a point whose own light is one of `lights`, in the order of their distances.
///
/// A sheet shows the reflectance r averaged over its bell, I(y) = integral of r(x) phi(x - y), and the middle of its
/// light lies I'(y) / I(y) from its own. r is a level and changes at places half a deviation apart. Their most likely
/// sizes are those of Gaussian variances, each computed anew from its change: few changes remain, as large as the
/// lights require.
pub(super) fn shift(lights: &[Light]) -> Shift {
    let mut lights: Vec<Light> =
        lights.chunk_by(|a, b| (a.at / CELL).round() == (b.at / CELL).round()).map(mean).collect();
    if lights.len() > LIGHTS {
        lights.sort_by(|a, b| a.at.abs().total_cmp(&b.at.abs()));
        lights.truncate(LIGHTS);
    }
    if lights.len() <= FEW { told_by::<FEW>(&lights) } else { told_by::<LIGHTS>(&lights) }
}

/// Lights of one cell, weighted by what is known of them.
fn mean(lights: &[Light]) -> Light {
    let (mut at, mut light, mut sure) = (0.0, 0.0, 0.0);
    for l in lights {
        let weight = l.sigma.powi(-2);
        at += weight * l.at;
        light += weight * l.light;
        sure += weight;
    }
    Light { at: at / sure, light: light / sure, sigma: sure.powf(-0.5) }
}

/// The same with matrices of N lights; those that are missing are not known.
fn told_by<const N: usize>(lights: &[Light]) -> Shift {
    let far = lights.iter().fold(0.0_f64, |far, l| far.max(l.at.abs()));
    let reach = ((far + BEYOND).min(FARTHEST) / APART).round() * APART;
    let places: Vec<f64> = (0..=(2.0 * reach / APART) as usize).map(|i| i as f64 * APART - reach).collect();
    let known = |i: usize| lights.get(i).copied().unwrap_or(UNKNOWN);
    let light = SVector::<f64, N>::from_fn(|i, _| known(i).light);
    let noise = SVector::<f64, N>::from_fn(|i, _| known(i).sigma.powi(2));
    // Share of each change that each shot sees.
    let seen: Vec<SVector<f64, N>> =
        places.iter().map(|x| SVector::from_fn(|i, _| integral(known(i).at - x))).collect();
    let mut variances = vec![CHANGES / places.len() as f64; places.len()];
    let least = LEAST * LEAST / places.len() as f64;
    for round in 1.. {
        let mut covariance = SMatrix::<f64, N, N>::from_diagonal(&noise).add_scalar(LEVEL);
        for (a, v) in seen.iter().zip(&variances) {
            covariance.syger(*v, a, a, 1.0);
        }
        // It has read the lower triangle only.
        let Some(factors) = covariance.cholesky() else { return Shift::default() };
        let weights = factors.solve(&light);
        let changes = seen.iter().zip(&variances).map(|(a, v)| v * a.dot(&weights));
        if round < ROUNDS {
            let next: Vec<f64> = changes.map(|c| sparse(c * c + least)).collect();
            variances = next;
            continue;
        }
        let (mut here, mut slope, mut before) = (LEVEL * weights.sum(), 0.0, 0.0);
        let mut told = SVector::<f64, N>::zeros();
        for (((x, change), a), v) in places.iter().zip(changes).zip(&seen).zip(&variances) {
            let steep = density(*x);
            here += change * integral(-x);
            slope += change * steep;
            before += v * steep * steep;
            told += a * (v * steep);
        }
        let here = here.max(DARK);
        let variance = (before - told.dot(&factors.solve(&told))).max(0.0);
        return Shift { by: (slope / here).clamp(-MOST, MOST), sigma: (variance.sqrt() / here).min(MOST) };
    }
    unreachable!("the last round returns")
}

/// The next variance of a change of this square: its 3/4th power. Its first would keep only the largest changes, its
/// half many small ones.
fn sparse(square: f64) -> f64 {
    let root = square.sqrt();
    root * root.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::noise::Noise;

    /// Light over bars of reflectance 1 with others of 0.25 between them, and its slope.
    fn bars(y: f64, wide: f64) -> (f64, f64) {
        (0..200).map(|i| (y - wide * f64::from(i), if i % 2 == 0 { 0.75 } else { -0.75 })).fold(
            (0.25, 0.0),
            |(light, slope), (z, change)| {
                (light + change * 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2), slope + change * density(z))
            },
        )
    }

    /// Root mean squares of the shifts and of what remains of them, and the share that is beyond three deviations,
    /// over many places of the bars.
    fn left(wide: f64, step: f64, noise: f64) -> [f64; 3] {
        const PLACES: u32 = 400;
        let mut random = Noise(5);
        let reach = (3.5 / step).ceil().max(2.0) as i32;
        let (mut all, mut left, mut beyond) = (0.0, 0.0, 0.0);
        for place in 0..PLACES {
            let y = 40.0 + 0.237 * f64::from(place);
            let (own, slope) = bars(y, wide);
            let truth = slope / own;
            let seen = |j: i32, random: &mut Noise| {
                let at = f64::from(j) * step;
                (at, bars(y + at, wide).0 * (noise * random.normal()).exp())
            };
            let lights: Vec<(f64, f64)> = (-reach..=reach).map(|j| seen(j, &mut random)).collect();
            let here = lights[reach as usize].1;
            let relative = lights.iter().map(|(at, light)| (*at, light / here));
            let lights: Vec<Light> =
                relative.map(|(at, light)| Light { at, light, sigma: noise * light + 0.01 }).collect();
            let Shift { by, sigma } = shift(&lights);
            all += truth * truth;
            left += (by - truth).powi(2);
            beyond += f64::from((by - truth).abs() > 3.0 * sigma.max(0.02));
        }
        [(all / f64::from(PLACES)).sqrt(), (left / f64::from(PLACES)).sqrt(), beyond / f64::from(PLACES)]
    }

    /// What remains of the pull of print, in deviations of the sheet. Bars narrower than the steps are not told.
    #[test]
    fn bars_are_told_from_few_lights() {
        for (wide, step, most) in [
            (2.0, 0.25, 0.03),
            (4.0, 0.25, 0.025),
            (8.0, 0.25, 0.02),
            (2.0, 1.0, 0.04),
            (4.0, 1.0, 0.035),
            (8.0, 1.0, 0.025),
            (4.0, 2.6, 0.12),
            (8.0, 2.6, 0.06),
            (16.0, 2.6, 0.035),
            (8.0, 5.0, 0.15),
            (16.0, 5.0, 0.09),
        ] {
            let [all, rest, beyond] = left(wide, step, 0.03);
            println!("bars of {wide}, steps of {step}: {all:.3} -> {rest:.3}; {:.1} % beyond 3 sigma", 100.0 * beyond);
            assert!(rest < most, "bars of {wide}, steps of {step}: {all} -> {rest}");
        }
    }

    /// A surface that ends: the light beyond is none.
    #[test]
    fn an_end_pulls_back() {
        for end in [-1.0, -0.5, 0.0, 0.5, 1.5, 4.0] {
            let light = |at: f64| 1.0 - integral(at - end);
            let lights: Vec<Light> = (-2..=2)
                .map(|j| 2.6 * f64::from(j))
                .map(|at| Light { at, light: light(at) / light(0.0), sigma: 0.03 })
                .collect();
            let truth = -density(end) / light(0.0);
            let Shift { by, sigma } = shift(&lights);
            println!("end at {end}: {truth:.3}, told {by:.3} +- {sigma:.3}");
            assert!((by - truth).abs() < 0.1, "end at {end}: {truth}, told {by}");
        }
    }
}
