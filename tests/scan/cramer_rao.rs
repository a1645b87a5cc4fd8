//! In: simulated Gaussian stripes with shot and read noise. Out: noise and bias of the found centres against the
//! Cramer-Rao bound, as a table. Frame and unit: pixels across the stripe; grey levels of an 8-bit picture.

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use sheetlight::raster::Image;
use sheetlight::stages::peak::params::Method;
use sheetlight::stages::peak::params::PeakParams;
use sheetlight::stages::peak::peaks;
use sheetlight::stages::peak::{CLEAR, measure};
use sheetlight::stages::stripe::{skeleton, thin, threshold};
use sheetlight::stages::{Thinning, ThresholdParams};

/// Sensor of the simulation: read noise, grey levels per photo-electron, dark level; rounding adds 1/12.
const READ: f64 = 0.64;
const GAIN: f64 = 0.05;
const DARK: f64 = 4.0;
const WIDTH: u32 = 1600;
const HEIGHT: u32 = 120;
/// The stripe moves along the columns with depth.
const ACROSS: glam::Vec2 = glam::Vec2::from_array([0.0, 1.0]);

/// A straight stripe: its centre is v = 60 + slope (u - 800) + phase.
#[derive(Clone, Copy)]
struct Stripe {
    sigma: f64,
    peak: f64,
    slope: f64,
}

impl Stripe {
    /// Signed distance of a place from the line.
    fn across(&self, u: f64, v: f64, phase: f64) -> f64 {
        (v - 60.0 - self.slope * (u - 800.0) - phase) / (1.0 + self.slope * self.slope).sqrt()
    }
    fn light(&self, d: f64) -> f64 {
        self.peak * (-0.5 * (d / self.sigma).powi(2)).exp()
    }
    fn variance(&self, light: f64) -> f64 {
        READ * READ + 1.0 / 12.0 + GAIN * (light + DARK)
    }
    fn picture(&self, phase: f64, rng: &mut rand_pcg::Pcg64) -> Image {
        let normal = Normal::new(0.0, 1.0).unwrap();
        let mut pixels = Vec::with_capacity((WIDTH * HEIGHT) as usize);
        for v in 0..HEIGHT {
            for u in 0..WIDTH {
                let level = self.light(self.across(f64::from(u), f64::from(v), phase)) + DARK;
                let noise = (READ * READ + GAIN * level).sqrt() * normal.sample(rng);
                pixels.push((level + noise).round().clamp(0.0, 255.0) as u8);
            }
        }
        Image::from_u8(WIDTH, HEIGHT, pixels)
    }
    /// Least standard deviation of an unbiased centre whose light is weighted along the stripe by `weight(t)`:
    /// sum(w² F) / sum(w F)², F the Fisher information of a pixel; for one line of pixels, w = 1, the
    /// Cramer-Rao bound itself. Amplitude and width are even, the centre is odd: not knowing them costs nothing.
    fn bound(&self, phase: f64, weight: impl Fn(i32, f64) -> f64) -> f64 {
        let l = (1.0 + self.slope * self.slope).sqrt();
        let (mut top, mut bottom) = (0.0, 0.0);
        for i in -40..=40i32 {
            for j in -50..=50i32 {
                let d = (f64::from(j) - self.slope * f64::from(i) - phase) / l;
                let w = weight(i, (f64::from(i) + self.slope * f64::from(j)) / l);
                let light = self.light(d);
                let fisher = (light * d / (self.sigma * self.sigma)).powi(2) / self.variance(light);
                top += w * w * fisher;
                bottom += w * fisher;
            }
        }
        top.sqrt() / bottom
    }
}

/// Standard deviation and mean of the error across the stripe, over the columns of some pictures.
fn errors(stripe: &Stripe, method: Method, along: f32, pictures: u64) -> (f64, f64) {
    let (mut n, mut sum, mut square) = (0.0, 0.0, 0.0);
    for k in 0..pictures {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(k);
        let phase = k as f64 / pictures as f64;
        let image = stripe.picture(phase, &mut rng);
        let size = ((24.0 * stripe.sigma) as u32 | 1).clamp(31, 101);
        let lit = threshold::twin(&image, &ThresholdParams { size, ..Default::default() });
        let list = skeleton::twin(&thin::twin(&lit, Thinning::ZhangSuen));
        let start = PeakParams { method, along, read_noise: 0.7, gain: GAIN as f32, ..PeakParams::default() };
        let found = measure(&image, &list, &start, ACROSS, CLEAR).expect("a clean stripe is measured");
        for p in peaks(&image, &list, 0, &start.with(&found), ACROSS) {
            let (u, v) = (f64::from(p.u), f64::from(p.v));
            let d = stripe.across(u, v, phase);
            // Ends of the stripe, and specks of noise that passed the threshold.
            if (40.0..f64::from(WIDTH) - 40.0).contains(&u) && d.abs() < 2.0 * stripe.sigma {
                n += 1.0;
                sum += d;
                square += d * d;
            }
        }
    }
    assert!(n > 0.9 * pictures as f64 * f64::from(WIDTH - 80), "{n} peaks");
    let mean = sum / n;
    ((square / n - mean * mean).sqrt(), mean)
}

const SIGMAS: [f64; 5] = [1.5, 2.0, 2.5, 3.0, 4.0];
const PEAKS: [f64; 4] = [30.0, 60.0, 120.0, 240.0];

#[test]
fn centres_are_as_good_as_the_light_allows() {
    println!("stripe centre, sd / bound (bias px); one line, then averaged along the stripe, then two other methods");
    println!("sigma px  peak grey  bound px  one line         along           centroid  derivative");
    let mut faults = Vec::new();
    for sigma in SIGMAS {
        for peak in PEAKS {
            let stripe = Stripe { sigma, peak, slope: 0.03 };
            let one = stripe.bound(0.3, |i, _| f64::from(u8::from(i == 0)));
            let radius = 2.4 * sigma;
            let wide = stripe.bound(0.3, |_, t| (1.0 - (t / radius).powi(2)).max(0.0).powi(2));
            let (sd_one, bias_one) = errors(&stripe, Method::Gaussian, 0.0, 3);
            let (sd_wide, bias_wide) = errors(&stripe, Method::Gaussian, 1.0, 3);
            let centroid = errors(&stripe, Method::Centroid, 0.0, 1).0 / one;
            let derivative = errors(&stripe, Method::Derivative, 0.0, 1).0 / one;
            println!(
                "{sigma:8.1} {peak:10.0} {one:9.4}  {:5.3} ({bias_one:+.4})  {:5.3} ({bias_wide:+.4})  \
                 {centroid:8.2} {derivative:11.2}",
                sd_one / one,
                sd_wide / wide
            );
            for (what, ratio, bias) in [("one line", sd_one / one, bias_one), ("along", sd_wide / wide, bias_wide)] {
                if !(0.9..=1.10).contains(&ratio) || bias.abs() > 0.01 {
                    faults.push(format!("sigma {sigma}, peak {peak}, {what}: sd {ratio:.3} bounds, bias {bias:.4} px"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_sloping_stripe_is_as_good() {
    for slope in [0.4, 1.0] {
        let stripe = Stripe { sigma: 2.0, peak: 120.0, slope };
        let one = stripe.bound(0.3, |i, _| f64::from(u8::from(i == 0)));
        // Only the part inside the picture; one line is a column here, which cuts the stripe at an angle.
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let image = stripe.picture(0.3, &mut rng);
        let lit = threshold::twin(&image, &ThresholdParams { size: 49, ..Default::default() });
        let list = skeleton::twin(&thin::twin(&lit, Thinning::ZhangSuen));
        let start = PeakParams { along: 0.0, gain: GAIN as f32, ..PeakParams::default() };
        let found = measure(&image, &list, &start, ACROSS, CLEAR).expect("a clean stripe is measured");
        let d: Vec<f64> = peaks(&image, &list, 0, &start.with(&found), ACROSS)
            .iter()
            .filter(|p| (12.0..108.0).contains(&p.v))
            .map(|p| stripe.across(f64::from(p.u), f64::from(p.v), 0.3))
            .filter(|d| d.abs() < 2.0)
            .collect();
        let mean = d.iter().sum::<f64>() / d.len() as f64;
        let sd = (d.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / d.len() as f64).sqrt();
        println!("slope {slope}: {} peaks, sd {:.3} bounds, bias {mean:+.4} px", d.len(), sd / one);
        // Few columns fit: the estimate of sd itself is good to 1 / sqrt(2 n).
        let spread = 3.0 / (2.0 * d.len() as f64).sqrt();
        assert!(d.len() > 60 && sd / one < 1.10 + spread && mean.abs() < 3.0 * one / (d.len() as f64).sqrt() + 0.01);
    }
}

#[test]
fn the_stated_standard_deviation_is_the_true_one() {
    for (sigma, peak) in [(1.5, 60.0), (3.0, 120.0)] {
        let stripe = Stripe { sigma, peak, slope: 0.03 };
        let mut rng = rand_pcg::Pcg64::seed_from_u64(9);
        let image = stripe.picture(0.6, &mut rng);
        let size = ((24.0 * sigma) as u32 | 1).max(31);
        let lit = threshold::twin(&image, &ThresholdParams { size, ..Default::default() });
        let list = skeleton::twin(&thin::twin(&lit, Thinning::ZhangSuen));
        let start = PeakParams { gain: GAIN as f32, ..PeakParams::default() };
        let found = measure(&image, &list, &start, ACROSS, CLEAR).unwrap();
        let pulls: Vec<f64> = peaks(&image, &list, 0, &start.with(&found), ACROSS)
            .iter()
            .filter(|p| (40.0..f64::from(WIDTH) - 40.0).contains(&f64::from(p.u)) && p.snr > 10.0)
            .map(|p| stripe.across(f64::from(p.u), f64::from(p.v), 0.6) / f64::from(p.sigma_px))
            .collect();
        let rms = (pulls.iter().map(|p| p * p).sum::<f64>() / pulls.len() as f64).sqrt();
        println!("sigma {sigma} px, peak {peak}: error over stated sigma {rms:.3} rms");
        assert!((0.85..1.15).contains(&rms), "{rms}");
    }
}

/// Spread of the lens, px: what it has blurred along the stripe no method brings back.
const LENS: f64 = 0.7;
/// Grooves along the stripe, px.
const PERIODS: [f64; 10] = [2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0];
/// Half depth of the grooves in the picture, px; 0 is a flat stripe.
const DEPTH: f64 = 0.4;

/// A stripe whose centre follows a comb of grooves, blurred by the lens along the stripe as it is across.
fn comb(stripe: &Stripe, period: f64, depth: f64, seed: u64) -> Image {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1.0).unwrap();
    // The lens along u, in quarter pixels out to four of its widths.
    let reach = (16.0 * LENS).ceil() as i32;
    let lens: Vec<(f64, f64)> =
        (-reach..=reach).map(|k| 0.25 * f64::from(k)).map(|d| (d, (-0.5 * (d / LENS).powi(2)).exp())).collect();
    let all: f64 = lens.iter().map(|l| l.1).sum();
    let columns: Vec<Vec<(f64, f64)>> = (0..WIDTH)
        .map(|u| lens.iter().map(|&(d, w)| (groove(f64::from(u) + d, period, depth), w / all)).collect())
        .collect();
    let mut pixels = Vec::with_capacity((WIDTH * HEIGHT) as usize);
    for v in 0..HEIGHT {
        for column in &columns {
            let light: f64 = if (f64::from(v) - 60.0).abs() < 8.0 + 6.0 * stripe.sigma {
                column.iter().map(|&(centre, w)| w * stripe.light(f64::from(v) - centre)).sum()
            } else {
                0.0
            };
            let level = light + DARK;
            let noise = (READ * READ + GAIN * level).sqrt() * normal.sample(&mut rng);
            pixels.push((level + noise).round().clamp(0.0, 255.0) as u8);
        }
    }
    Image::from_u8(WIDTH, HEIGHT, pixels)
}

fn groove(u: f64, period: f64, depth: f64) -> f64 {
    slope(u) + depth * wave(u, period)
}

/// The stripe passes every place within a pixel.
fn slope(u: f64) -> f64 {
    60.0 + 0.01 * (u - 800.0)
}

/// Not zero on every pixel of a period of two.
fn wave(u: f64, period: f64) -> f64 {
    (std::f64::consts::TAU * u / period + 0.8).sin()
}

/// Share of the grooves' depth that a method sees, and the standard deviation of its centres.
fn response(stripe: &Stripe, method: Method, along: f32, period: f64, depth: f64) -> (f64, f64) {
    let image = comb(stripe, period, depth, 31);
    let lit = threshold::twin(&image, &ThresholdParams { size: 49, ..Default::default() });
    let list = skeleton::twin(&thin::twin(&lit, Thinning::ZhangSuen));
    let start = PeakParams { method, along, width_px: stripe.sigma as f32, speckle: 0.0, ..PeakParams::default() };
    let found: Vec<(f64, f64)> = peaks(&image, &list, 0, &PeakParams { gain: GAIN as f32, ..start }, ACROSS)
        .iter()
        .map(|p| (f64::from(p.u), f64::from(p.v) - slope(f64::from(p.u))))
        .filter(|(u, d)| (40.0..f64::from(WIDTH) - 40.0).contains(u) && d.abs() < 2.0 * stripe.sigma)
        .collect();
    assert!(found.len() > 1400, "{} peaks", found.len());
    let n = found.len() as f64;
    let mean = found.iter().map(|f| f.1).sum::<f64>() / n;
    let power: f64 = found.iter().map(|f| wave(f.0, period).powi(2)).sum();
    let seen = found.iter().map(|f| (f.1 - mean) * wave(f.0, period)).sum::<f64>() / power;
    let rest = found.iter().map(|f| (f.1 - mean - seen * wave(f.0, period)).powi(2)).sum::<f64>() / n;
    (seen / depth.max(1e-9), rest.sqrt())
}

/// How fine a structure along the stripe is seen, beside the noise that is paid for it. A centre of gravity that is
/// averaged along the stripe, with the same nearly Gaussian weight, until it is as quiet as the fit has lost more of
/// the grooves.
#[test]
fn the_fit_keeps_more_detail_than_a_centroid_of_the_same_noise() {
    let mut faults = Vec::new();
    println!(
        "share of the grooves' depth by their period, px; half depth {DEPTH} px, lens {LENS} px; noise of a flat stripe"
    );
    println!("sigma px  method    along  noise px  {}", PERIODS.map(|p| format!("{p:5.0}")).join(" "));
    for sigma in [1.5, 2.5] {
        let stripe = Stripe { sigma, peak: 120.0, slope: 0.0 };
        let noise = |method, along| response(&stripe, method, along, 20.0, 0.0).1;
        let row = |name: &str, method, along| {
            let shares = PERIODS.map(|p| response(&stripe, method, along, p, DEPTH).0);
            let noise = noise(method, along);
            let shown = shares.map(|s| format!("{s:5.2}")).join(" ");
            println!("{sigma:8.1}  {name:8}  {along:5.2}  {noise:8.4}  {shown}");
            shares
        };
        let fit = row("fit", Method::Gaussian, 1.0);
        // The least averaging that brings the centroid to the fit's noise.
        let quiet = noise(Method::Gaussian, 1.0);
        let (mut low, mut high) = (0.0f32, 4.0f32);
        for _ in 0..6 {
            let middle = 0.5 * (low + high);
            if noise(Method::Centroid, middle) > quiet { low = middle } else { high = middle }
        }
        let centroid = row("centroid", Method::Centroid, high);
        row("centroid", Method::Centroid, 1.0);
        row("pixel", Method::Pixel, 0.0);
        for (k, period) in PERIODS.into_iter().enumerate() {
            // What a Gaussian average over one sigma along the stripe leaves of what the lens has left.
            let blur2 = sigma * sigma + LENS * LENS;
            let left = (-0.5 * blur2 * (std::f64::consts::TAU / period).powi(2)).exp();
            // Grooves that neither sees are noise.
            if fit[k] < centroid[k] && centroid[k] > 0.02 || left > 0.05 && fit[k] < left - 0.03 {
                let seen = format!("fit {:.3}, centroid {:.3}, one sigma {left:.3}", fit[k], centroid[k]);
                faults.push(format!("{sigma} px, period {period}: {seen}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
