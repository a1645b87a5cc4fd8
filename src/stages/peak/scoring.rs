//! In: stripe profiles side by side, one in each lane. Out: the maximum-likelihood Gaussian of each: centre, amplitude,
//! width, sigma. Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe peak (3) to
//! (5).

use super::PeakFrame;
use super::lanes::{LANES, Lanes, exponential};
use super::profile::{Profiles, clipped_within, number, share};

/// Grey levels that count as no light. Their square must not be a denormal number, with which a CPU is many times
/// slower.
pub(in crate::stages) const DARK: f32 = 1e-9;
/// Least share of a parameter's information that remains if another parameter explains it: the resolution of f32.
pub(in crate::stages) const LEAST: f32 = 1e-5;
/// Largest uncertainty from sides of different levels, as a share of the amplitude. A larger difference comes from
/// another stripe's light, and the brighter side is not used anyway.
pub(in crate::stages) const UNEVEN: f32 = 0.06;
/// Share of the ceiling over which the weight of clipped pixels falls to 0. If it fell at once, rounding would decide.
pub(in crate::stages) const SOFT: f32 = 0.05;
const ONE: Lanes = Lanes::all(1.0);

/// One Gaussian in each lane.
pub(super) struct Found {
    pub m: Lanes,
    pub a: Lanes,
    /// Width without the profile's blur.
    pub width: Lanes,
    /// Standard deviation of the centre.
    pub sigma: Lanes,
    /// Above 0 if a pixel of the fit is clipped.
    pub clipped: Lanes,
}

/// Amplitude, centre and width, and the squared residuals after the last step.
#[derive(Clone, Copy)]
struct Gaussian {
    a: Lanes,
    m: Lanes,
    w: Lanes,
    /// Variance of the centre from the light alone, for samples of one pixel.
    variance: Lanes,
    squares: Lanes,
    /// Number of samples that had weight.
    believed: Lanes,
}

/// Sums over certainty times model squared times z^0, z^1, .. z^4; certainty times residual times model times z^0, z^1,
/// z^2; the squared residuals; and the weights that counted.
struct Sums {
    e: [Lanes; 5],
    r: [Lanes; 3],
    chi2: Lanes,
    count: Lanes,
}

/// Profiles, and the values that do not change during their fits.
struct Scoring<'a> {
    profiles: &'a Profiles,
    /// The span of samples that take part.
    near: (Lanes, Lanes),
    /// The first guess of the centre; the expected width of the profile.
    m0: Lanes,
    s0: Lanes,
    /// Variance of a pixel: `quiet` + `gain` light + `speckle2` light^2. The uncertainty of the level beside the stripe
    /// is included as noise: on a flank, whose speckle is faint, it would otherwise count as light.
    quiet: Lanes,
    gain: Lanes,
    speckle2: f32,
    /// Light at which a pixel is clipped, and one over the span in which the weight of clipped pixels falls to 0.
    ceiling: Lanes,
    soft: Lanes,
    /// A weak prior that the width is the expected one; with it, two or three lit pixels can be solved.
    prior: Lanes,
}

/// Fisher scoring of amplitude, offset and width in the first `lanes` lanes. Variance of a pixel: read noise squared +
/// gain · level + speckle² · light². A saturated pixel means only "at least this bright".
#[inline(always)]
pub(super) fn gaussians(profiles: &Profiles, lanes: usize, s: &PeakFrame) -> Found {
    let (m0, a0) = profiles.guess(s);
    let s0 = (Lanes::all(s.s0 * s.s0) + profiles.blur2).sqrt();
    let near = profiles.span(m0, 3.0 * s0);
    let ceiling = Lanes::all(s.full_scale) - profiles.base;
    let doubt = UNEVEN * a0;
    let scoring = Scoring {
        profiles,
        near,
        m0,
        s0,
        quiet: (Lanes::all(s.read2) + s.gain * profiles.base) + profiles.uneven2.min(doubt * doubt),
        gain: Lanes::all(s.gain),
        speckle2: s.speckle2,
        ceiling,
        soft: ONE / (SOFT * ceiling).max(ONE),
        prior: 4.0 / (s0 * s0),
    };
    let [variance, squares, believed] = [Lanes::ZERO; 3];
    let mut fit = Gaussian { a: a0, m: m0, w: s0, variance, squares, believed };
    let mut runs: [bool; LANES] = std::array::from_fn(|lane| lane < lanes);
    let mut step = 0;
    while step < s.steps && runs.contains(&true) {
        scoring.step(&mut fit, &mut runs);
        step += 1;
    }
    // A sample is the weighted mean of pixels with independent errors: its variance is a pixel's variance times this.
    let share = profiles.square / profiles.weight;
    // If the noise is larger than the model's, the centre is less certain by the same factor. A few samples show little
    // of the noise, so if it seems smaller, the model counts for `belief` samples.
    let free = (fit.believed - Lanes::all(3.0)).max(ONE);
    let (chi2, belief) = (fit.squares / share, Lanes::all(s.belief));
    let noise = (chi2 / free).max((belief + chi2) / (belief + free));
    Found {
        m: fit.m,
        a: fit.a,
        width: (fit.w * fit.w - profiles.blur2).max(Lanes::all(0.01 * s.s0 * s.s0)).sqrt(),
        sigma: (fit.variance * share * noise).max(Lanes::ZERO).sqrt(),
        clipped: scoring.clipped(),
    }
}

impl Scoring<'_> {
    /// One step of the lanes that still run; lanes that have converged stop.
    #[inline(always)]
    fn step(&self, fit: &mut Gaussian, runs: &mut [bool; LANES]) {
        let (m0, s0, prior) = (self.m0, self.s0, self.prior);
        let Gaussian { a, m, w, .. } = *fit;
        let Sums { e, r, chi2, count } = self.sums(a, m, w);
        // Steps are relative: in parts of amplitude, width and width. A prior of almost nothing keeps dark profiles
        // solvable.
        let tiny = Lanes::all(1e-9);
        let (h00, h01, h02, h11, h12) = (e[0] + tiny, e[1], e[2], e[2] + tiny, e[3]);
        let h22 = e[4] + prior * (w * w);
        let (g0, g1, g2) = (r[0], r[1], r[2] + (prior * w) * (s0 - w));
        // Amplitude and then width are eliminated, the centre is last: d1 is the information about the centre alone. If
        // there is no information, as for a stripe that is clipped everywhere, rounding must not produce a certainty.
        let (l01, l02) = (h01 / h00, h02 / h00);
        let d2 = (h22 - l02 * h02).max(LEAST * h22);
        let s12 = h12 - l02 * h01;
        let l12 = s12 / d2;
        let d1 = (h11 - (l01 * h01 + l12 * s12)).max(LEAST * h11);
        let y2 = g2 - l02 * g0;
        let x1 = (g1 - (l01 * g0 + l12 * y2)) / d1;
        let x2 = y2 / d2 - l12 * x1;
        let x0 = g0 / h00 - (l02 * x2 + l01 * x1);
        // Bounded steps: the model is not linear far from the solution.
        let da = (a * x0).clamp(-0.5 * a, a);
        let dm = (w * x1).clamp(-0.7 * s0, 0.7 * s0);
        let dw = (w * x2).clamp(-0.3 * s0, 0.3 * s0);
        // Decrease of the squares by this step: the squares after the last step are needed.
        let gain = (g0 * (da / a) + g1 * (dm / w)) + g2 * (dw / w);
        let next = Gaussian {
            a: (a + da).max(ONE),
            m: (m + dm).clamp(m0 - 2.0 * s0, m0 + 2.0 * s0),
            w: (w + dw).clamp(0.3 * s0, 3.0 * s0),
            variance: (w * w) / d1,
            squares: (chi2 - gain).max(Lanes::ZERO),
            believed: count / self.profiles.weight,
        };
        fit.take(&next, runs);
        // The next step would be a tenth of this one, in few fits a half. That is far below the noise, and below the
        // difference if only a GPU or only a processor takes the step.
        for (lane, runs) in runs.iter_mut().enumerate() {
            let [da, dm, dw] = [da, dm, dw].map(|d| d.0[lane].abs());
            let s0 = s0.0[lane];
            *runs &= !(dm < 5e-3 * s0 && dw < 1e-2 * s0 && da < 1e-2 * next.a.0[lane]);
        }
    }

    /// The sums for Gaussians with these amplitudes, centres and widths.
    #[inline(always)]
    fn sums(&self, a: Lanes, m: Lanes, w: Lanes) -> Sums {
        let inverse = 1.0 / w;
        let wide = self.profiles.step * inverse;
        let z0 = (self.profiles.offset - m) * inverse;
        let fall = exponential(-(wide * wide));
        let up = self.side(0, a, inverse, (z0, wide), fall);
        let down = self.side(1, a, inverse, (z0 - wide, -wide), fall);
        Sums {
            e: std::array::from_fn(|i| up.e[i] + down.e[i]),
            r: std::array::from_fn(|i| up.r[i] + down.r[i]),
            chi2: up.chi2 + down.chi2,
            count: up.count + down.count,
        }
    }

    /// Sums from the middle to one side, because a model value that has become 0 stays 0. A Gaussian at equal steps:
    /// its ratio from sample to sample falls by a constant factor. The model of a sample includes, to second order,
    /// that it lies off its step or is wider.
    #[inline(always)]
    fn side(&self, side: usize, a: Lanes, inverse: Lanes, (mut z, dz): (Lanes, Lanes), fall: Lanes) -> Sums {
        let p = self.profiles;
        let (mut e, mut r) = ([Lanes::ZERO; 5], [Lanes::ZERO; 3]);
        let (mut chi2, mut count) = (Lanes::ZERO, Lanes::ZERO);
        let mut model = a * exponential(-0.5 * (z * z));
        let mut ratio = exponential(-0.5 * (dz * dz) - dz * z);
        let samples = p.levels[side][..p.half].iter().zip(&p.clipped[side][..p.half]).zip(&p.off[side][..p.half]);
        let inverse2 = Lanes::all(0.5) * (inverse * inverse);
        for (j, (((&level, &lost), &off), &more)) in samples.zip(&p.more[side][..p.half]).enumerate() {
            let all = share(number(side, j), self.near) * p.weight;
            let light = level - p.base;
            // A clipped pixel counts while the model is below it, and has no weight above.
            let above = (self.soft * (model - self.ceiling) + Lanes::all(0.5)).clamp(Lanes::ZERO, ONE);
            let heard = (ONE - above * lost).max(Lanes::all(1e-3));
            let there = model * ((ONE - z * (off * inverse)) + (z * z - ONE) * (more * inverse2));
            let residual = (light - there) + (above * lost) * (model - self.ceiling);
            let weight = all / (heard * (self.quiet + model * (self.gain + self.speckle2 * model)));
            let certainty = (heard * heard) * weight;
            let pull = (heard * weight) * residual;
            let (mut h, mut g) = (certainty * (model * model), pull * model);
            for sum in &mut e {
                *sum = *sum + h;
                h = h * z;
            }
            for sum in &mut r {
                *sum = *sum + g;
                g = g * z;
            }
            chi2 = chi2 + (weight * residual) * residual;
            count = count + all * heard;
            model = (model * ratio).max(Lanes::all(DARK));
            ratio = ratio * fall;
            z = z + dz;
        }
        Sums { e, r, chi2, count }
    }

    /// The largest share of clipped pixels in a sample that takes part.
    #[inline(always)]
    fn clipped(&self) -> Lanes {
        let mut most = Lanes::ZERO;
        for side in 0..2 {
            for (j, &lost) in self.profiles.clipped[side][..self.profiles.half].iter().enumerate() {
                most = most.max(clipped_within(lost, share(number(side, j), self.near)));
            }
        }
        most
    }
}

impl Gaussian {
    /// Takes over the next values in the lanes that run.
    #[inline(always)]
    fn take(&mut self, next: &Gaussian, runs: &[bool; LANES]) {
        let mine = [&mut self.a, &mut self.m, &mut self.w, &mut self.variance, &mut self.squares, &mut self.believed];
        let theirs = [next.a, next.m, next.w, next.variance, next.squares, next.believed];
        for (mine, next) in mine.into_iter().zip(theirs) {
            *mine = next.or(runs, *mine);
        }
    }
}
