//! In: light of a stripe, column by column along it, and the pixels of a fit. Out: the size of its speckle's grains,
//! and their effect on the fit: how much more a centre scatters than if the speckle of pixels were independent. Frame
//! and unit: sigma of the blur that makes the grains, px. docs/math.md, Stripe peak (6).

use super::scatter::most;
use nalgebra::{Matrix3, Vector3};

/// Largest distance between two columns that are compared.
const LAGS: usize = 12;
/// Least number of columns on both sides of a peak, so that the end of a narrow stripe's grains is visible.
const FEWEST: i32 = 4;
/// Step of the search for the grains' size, and the largest size, px.
const FINE: f32 = 0.05;
const LARGEST: f32 = 6.0;
/// Share of the squared differences that grains must explain before they are accepted.
const TELLING: f64 = 0.03;

/// Correlation of the speckle of two pixels at this squared distance, px². Light through a blur of sigma s has
/// intensities correlated as exp(-d² / (4 s²)).
fn correlation(apart2: f32, grain: f32) -> f32 {
    (-0.25 * apart2 / (grain * grain)).exp()
}

/// Squared second differences of the centres of a stripe's columns, for every distance along it. They contain neither a
/// slope of the line nor what the surface does to all of a column's light, as at edges between dark and bright.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super) struct Grains {
    squares: [f64; LAGS],
    white: [f64; LAGS],
    n: [f64; LAGS],
}

impl Grains {
    /// Number of columns used on both sides of a peak whose window extends `window` columns along the stripe.
    pub fn reach(window: i32) -> i32 {
        window.clamp(FEWEST, 2 * LAGS as i32)
    }
    /// From neighbouring columns: their centre, and its variance without that of speckle; in any unit of length.
    pub fn new(columns: &[(f32, f32)]) -> Grains {
        let mut grains = Grains::default();
        for k in 1..=LAGS.min((columns.len() - 1) / 2) {
            for i in k..columns.len() - k {
                let [a, b, c] = [columns[i - k], columns[i], columns[i + k]];
                grains.squares[k - 1] += f64::from((a.0 - 2.0 * b.0 + c.0).powi(2) / 6.0);
                grains.white[k - 1] += f64::from((a.1 + 4.0 * b.1 + c.1) / 6.0);
                grains.n[k - 1] += 1.0;
            }
        }
        grains
    }
    /// Sum of the mean squares over all distances.
    fn whole(&self) -> f64 {
        (0..LAGS).filter(|&k| self.n[k] > 0.0).map(|k| self.squares[k] / self.n[k]).sum()
    }
    /// Sigma of the grains, px; 0 if pixels scatter independently or the grains are not visible. A square is v (1 - (4
    /// r(k) - r(2k)) / 3) on average, r the correlation k columns apart. The result is least squares over v and the
    /// grains' size. The squares of a line's bend grow as k⁴. Peaks whose columns scatter more than noise does, with
    /// grains of size `before`, lie over an edge and are excluded.
    pub fn sigma(mut all: Vec<Grains>, before: f32) -> f32 {
        all.retain(|g| g.n[0] > 0.0);
        all.sort_by(|a, b| a.whole().total_cmp(&b.whole()));
        let Some(usual) = all.get(all.len() / 4).map(Grains::whole) else { return 0.0 };
        let mut sum = Grains::default();
        let free = |g: &Grains| (g.n[0] + 2.0) / columns_of_a_grain(before);
        for g in all.iter().filter(|g| g.whole() <= usual * most(0.7 * free(g))) {
            for k in 0..LAGS {
                sum.squares[k] += g.squares[k];
                sum.white[k] += g.white[k];
                sum.n[k] += g.n[k];
            }
        }
        let lags: Vec<usize> = (0..LAGS).filter(|&k| sum.n[k] > 0.0).collect();
        let whole: f64 = lags.iter().map(|&k| sum.squares[k].powi(2) / sum.n[k]).sum();
        let product = |a: &dyn Fn(f64) -> f64, b: &dyn Fn(f64) -> f64| -> f64 {
            lags.iter().map(|&k| sum.n[k] * a((k + 1) as f64) * b((k + 1) as f64)).sum()
        };
        // Projection of the squares without those of white noise.
        let along = |shape: &dyn Fn(f64) -> f64| -> f64 {
            lags.iter().map(|&k| shape((k + 1) as f64) * (sum.squares[k] - sum.white[k])).sum()
        };
        // Share of all squares that one shape over the distance explains; and the share that two explain together.
        let explained = |shape: &dyn Fn(f64) -> f64| along(shape).max(0.0).powi(2) / (product(shape, shape) * whole);
        let together = |a: &dyn Fn(f64) -> f64, b: &dyn Fn(f64) -> f64| {
            let (of_a, of_b, aa, ab, bb) = (along(a), along(b), product(a, a), product(a, b), product(b, b));
            let (by_a, by_b) = (of_a * bb - of_b * ab, of_b * aa - of_a * ab);
            let one = explained(a).max(explained(b));
            // Neither of the two may have a negative share.
            if by_a > 0.0 && by_b > 0.0 { (by_a * of_a + by_b * of_b) / ((aa * bb - ab * ab) * whole) } else { one }
        };
        let grained = |s: f32| {
            move |k: f64| {
                1.0 - f64::from(4.0 * correlation((k * k) as f32, s) - correlation((4.0 * k * k) as f32, s)) / 3.0
            }
        };
        let (white, bend) = (|_: f64| 1.0, |k: f64| k.powi(4));
        let sizes = (1..=(LARGEST / FINE) as u32).map(|i| i as f32 * FINE);
        let best = sizes.map(|s| (s, explained(&grained(s)))).max_by(|a, b| a.1.total_cmp(&b.1));
        // A bend of the line moves columns that are far apart in the same way, as large grains do.
        let told = |&(_, by): &(f32, f64)| by - explained(&white) > TELLING && by > together(&white, &bend);
        best.filter(told).map_or(0.0, |b| b.0)
    }
}

/// Number of columns that together give as much information as one independent column: the squares of noise with such
/// grains are correlated by r². For pixels it is the square of that.
pub(in super::super) fn columns_of_a_grain(grain: f32) -> f64 {
    // Sum of exp(-d² / (2 s²)).
    (std::f64::consts::TAU.sqrt() * f64::from(grain)).max(1.0)
}

/// A pixel of a fit: its column and row, the derivatives of its model by the three fitted parameters, its light, and
/// its certainty, which is weight over variance.
pub(in super::super) struct Cell {
    pub at: [i32; 2],
    pub j: Vector3<f32>,
    pub light: f32,
    pub certainty: f32,
}

/// Every how many columns and rows a pixel is used, for grains of this size.
pub(in super::super) fn stride(grain: f32) -> i32 {
    (grain as i32).max(1)
}

/// Speckle of pixels farther apart than this, in sigmas of the blur, is taken as independent.
const FAR: f32 = 4.5;

/// Number of pairs of pixels that [`grained`] visits for a fit with `pixels` pixels in `columns` columns.
pub(in super::super) fn pairs(pixels: usize, columns: usize, grain: f32) -> usize {
    let stride = stride(grain) as usize;
    let near = (2.0 * FAR * grain).ceil() as usize;
    (pixels / (stride * stride)) * (pixels * near.min(columns) / columns / (stride * stride)).max(1)
}

/// Effect of speckle with grains on a fit: the share of each pixel's square that remains as residual, and the centre's
/// variance over that with independent pixels. The cells are those of every [`stride`], in order of their columns.
/// `inverse` is the fit's (Jᵀ W J)⁻¹; its estimate is that times Jᵀ W e.
pub(in super::super) fn grained(cells: &[&Cell], inverse: &Matrix3<f32>, grain: f32) -> (Vec<f32>, f32) {
    let far = FAR * grain;
    let each = stride(grain).pow(2) as f32;
    let mut first = 0;
    // (Jᵀ W S) of each pixel, S the covariance of the speckle over its squared contrast.
    let mut seen = Vec::with_capacity(cells.len());
    for a in cells {
        while ((a.at[0] - cells[first].at[0]) as f32) > far {
            first += 1;
        }
        let mut sum = Vector3::zeros();
        for b in cells[first..].iter().take_while(|b| ((b.at[0] - a.at[0]) as f32) <= far) {
            let [i, j] = [0, 1].map(|k| (a.at[k] - b.at[k]) as f32);
            if j.abs() <= far {
                sum += b.j * (b.certainty * b.light * correlation(i * i + j * j, grain));
            }
        }
        seen.push(sum * (each * a.light));
    }
    let (mut together, mut alone) = (Matrix3::zeros(), Matrix3::zeros());
    for (c, q) in cells.iter().zip(&seen) {
        together += c.j * q.transpose() * (each * c.certainty);
        alone += c.j * c.j.transpose() * (each * (c.certainty * c.light).powi(2));
    }
    let [together, alone] = [together, alone].map(|m| inverse * m * inverse);
    let left = cells.iter().zip(&seen).map(|(c, q)| {
        let square = (c.light * c.light).max(1e-6);
        let taken = 2.0 * (inverse * c.j).dot(q) - (together * c.j).dot(&c.j);
        (1.0 - taken / square).clamp(0.0, 1.0)
    });
    (left.collect(), together[(1, 1)] / alone[(1, 1)].max(1e-12))
}
