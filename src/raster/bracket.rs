//! In: pictures of one pose with different exposure times. Out: one picture with levels proportional to the light, in
//! which the shortest exposure sets full scale; the shares of its pixels that each exposure gave; what a level of it
//! scatters. Frame and unit: grey levels; exposure times in microseconds. docs/math.md, Several exposures (1) to (4).

use super::{Image, Pixels};
use crate::fault::{Fault, Result};

/// Most exposures of a bracket.
pub const MOST_EXPOSURES: usize = 4;
/// Least ratio of two neighbouring exposures.
const LEAST_RATIO: f64 = 1.2;
/// Largest ratio of the last exposure to the first: beyond it a level of 8 bits in the longest is less than one of the
/// merged picture's 16.
pub const MOST_RATIO: f64 = 256.0;
/// Exposure times, us.
const TIMES_US: [f64; 2] = [0.1, 1e8];
/// Depth of a merged picture, bits.
pub const MERGED_BITS: u8 = 16;
/// Level of a pixel that is saturated in every exposure.
const SATURATED: u32 = 0xffff;
/// A longer exposure is not used from this share of full scale below its limit on, 1 / 32: a sensor bends there, and
/// a level beside the limit may be a clipped one with its noise.
const NEAR_LIMIT: u32 = 32;
/// Binary places of the weights.
const PLACES: u32 = 16;
/// A pixel is lit, for the shares, from this share of the longest exposure's full scale on, 1 / 16.
const LIT: f64 = 16.0;
/// Two neighbouring exposures are compared where the shorter one should have at least this share of full scale (1 / 16)
/// and the longer one at least this (1 / 4): there noise is a small part of the level.
const READABLE: f64 = 16.0;
const CLEAR: f64 = 4.0;
/// Least number of such pixels.
const COMPARED: u64 = 100;
/// Largest difference of their light, as a share: of all of it, and of what is left pixel by pixel beyond noise. A
/// camera's exposure is off by some microseconds. Where it moved, speckle differs by 0.15 and more.
const OTHER_LIGHT: f64 = 0.25;
const OTHER_PLACE: f64 = 0.08;
/// Standard deviations of a dark pixel that a mean difference may have from noise: shot noise adds to it.
const NOISE: f64 = 2.0;
/// Least standard deviation, levels: rounding.
const ROUNDING: f64 = 0.3;
/// Every how many pixels one is taken for the noise of dark ones.
const SAMPLED: usize = 37;

/// Levels of a picture in terms of one exposure's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// Light at full scale over that of the longest exposure; 1 for a picture of one exposure.
    pub span: f32,
}

impl Default for Levels {
    fn default() -> Levels {
        Levels { span: 1.0 }
    }
}

/// What became of the pixels of merged pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shares {
    /// Lit pixels by the longest exposure that was used, from the shortest on.
    pub by_exposure: [u64; MOST_EXPOSURES],
    /// Lit pixels that are saturated in every exposure.
    pub saturated: u64,
}

impl Shares {
    /// Adds those of another picture.
    pub fn add(&mut self, other: &Shares) {
        self.by_exposure.iter_mut().zip(other.by_exposure).for_each(|(a, b)| *a += b);
        self.saturated += other.saturated;
    }

    /// Lit pixels.
    pub fn lit(&self) -> u64 {
        self.by_exposure.iter().sum::<u64>() + self.saturated
    }
}

/// Exposures that are merged, and the weights for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Bracket {
    /// Exposure times, us, ascending.
    exposures_us: Vec<f64>,
    /// Level without light.
    black: f64,
    /// Full scale of one picture.
    full: u32,
    /// Levels of the merged picture in one of the longest exposure.
    unit: f64,
    /// Weights of the levels where the first 1, 2, .. exposures are used, in units of 2^-16.
    weights: [[u32; MOST_EXPOSURES]; MOST_EXPOSURES],
    /// What the black level adds to the weighted sums beyond the merged picture's own black level.
    drops: [u32; MOST_EXPOSURES],
}

impl Bracket {
    /// For linear pictures of `bits` with a level without light of `black_level`, 0 to a quarter of full scale.
    ///
    /// # Errors
    /// Fewer than two exposures or more than four, not ascending, too close, too far apart; a black level out of range.
    pub fn new(exposures_us: &[f64], bits: u8, black_level: f64) -> Result<Bracket> {
        let wrong = |what: String, next: &str| {
            Err(Fault::input(what).cause("exposures_us states the exposure times of a frame's pictures").next(next))
        };
        let n = exposures_us.len();
        if !(2..=MOST_EXPOSURES).contains(&n) {
            return wrong(
                format!("a bracket has {n} exposures, 2 to {MOST_EXPOSURES} are merged"),
                "take fewer or more",
            );
        }
        if let Some(odd) = exposures_us.iter().find(|t| !(TIMES_US[0]..=TIMES_US[1]).contains(*t)) {
            let [least, most] = TIMES_US;
            return wrong(format!("an exposure of {odd} us, {least} to {most:e} are possible"), "state microseconds");
        }
        if let Some(pair) = exposures_us.windows(2).find(|p| p[1] < LEAST_RATIO * p[0]) {
            return wrong(
                format!("an exposure of {} us after one of {} us", pair[1], pair[0]),
                "state them from the shortest to the longest, each at least 1.2 times the one before, 'laser' first",
            );
        }
        let ratio = exposures_us[n - 1] / exposures_us[0];
        if ratio > MOST_RATIO {
            let what = format!("the longest exposure is {ratio:.0} times the shortest, limit {MOST_RATIO}");
            return wrong(what, "choose exposures closer together");
        }
        let full = (1u32 << bits) - 1;
        if !(0.0..=0.25 * f64::from(full)).contains(&black_level) {
            let what = format!("the black level is {black_level}, 0 to {} is possible", full / 4);
            return wrong(what, "state the mean level of a picture with the lens covered");
        }
        let unit = f64::from(SATURATED) / ((f64::from(full) - black_level) * ratio + black_level);
        let mut bracket = Bracket {
            exposures_us: exposures_us.to_vec(),
            black: black_level,
            full,
            unit,
            weights: [[0; MOST_EXPOSURES]; MOST_EXPOSURES],
            drops: [0; MOST_EXPOSURES],
        };
        let one = f64::from(1u32 << PLACES);
        for k in 0..n {
            let squares = bracket.power(k, 2);
            let mut all = 0.0;
            for (i, t) in exposures_us[..=k].iter().enumerate() {
                let weight = (one * unit * exposures_us[n - 1] * t / squares).round();
                bracket.weights[k][i] = weight as u32;
                all += weight;
            }
            bracket.drops[k] = (black_level * (all - one * unit)).round().max(0.0) as u32;
        }
        Ok(bracket)
    }

    /// Exposure times, us, ascending.
    pub fn exposures_us(&self) -> &[f64] {
        &self.exposures_us
    }

    /// Sum of the first `k` + 1 exposures to this power.
    fn power(&self, k: usize, power: i32) -> f64 {
        self.exposures_us[..=k].iter().map(|t| t.powi(power)).sum()
    }

    /// Level from which on a longer exposure is not used.
    fn limit(&self) -> u32 {
        self.full - self.full / NEAR_LIMIT
    }

    /// The merged picture's levels.
    pub fn levels(&self) -> Levels {
        Levels { span: (f64::from(SATURATED) / (self.unit * f64::from(self.full))) as f32 }
    }

    /// One picture from those of a pose, one for each exposure, in order.
    ///
    /// # Errors
    /// Another number of pictures, sizes or depths that differ, light that lies elsewhere in two of them or is not in
    /// the ratio of their exposures.
    pub fn merge(&self, pictures: &[Image]) -> Result<(Image, Shares)> {
        let n = self.exposures_us.len();
        if pictures.len() != n {
            return Err(Fault::input(format!("{} pictures of {n} exposures", pictures.len()))
                .cause("an exposure is missing")
                .next("give one picture for each exposure, the shortest first"));
        }
        let first = &pictures[0];
        if let Some(other) =
            pictures.iter().find(|p| (p.width, p.height, p.bits) != (first.width, first.height, first.bits))
        {
            let words = |p: &Image| format!("{}x{} with {} bits", p.width, p.height, p.bits);
            return Err(Fault::input(format!("pictures of one pose are {} and {}", words(first), words(other)))
                .cause("another region or pixel format was set between two exposures")
                .next("take all exposures with one setting"));
        }
        if (1u32 << first.bits) - 1 != self.full {
            return Err(Fault::input(format!(
                "pictures of {} bits, the bracket is of level {}",
                first.bits, self.full
            ))
            .next("make the bracket for the pictures' depth"));
        }
        Ok(match n {
            2 => self.merged::<2>(pictures)?,
            3 => self.merged::<3>(pictures)?,
            _ => self.merged::<4>(pictures)?,
        })
    }

    fn merged<const N: usize>(&self, pictures: &[Image]) -> Result<(Image, Shares)> {
        let mut out = vec![0; pictures[0].pixel_count()];
        let bytes: Option<Vec<&[u8]>> =
            pictures.iter().map(|p| if let Pixels::U8(p) = &p.pixels { Some(&p[..]) } else { None }).collect();
        let words: Option<Vec<&[u16]>> =
            pictures.iter().map(|p| if let Pixels::U16(p) = &p.pixels { Some(&p[..]) } else { None }).collect();
        let shares = match (bytes, words) {
            (Some(all), _) => self.pixels::<N, u8>(std::array::from_fn(|i| all[i]), &mut out)?,
            (_, Some(all)) => self.pixels::<N, u16>(std::array::from_fn(|i| all[i]), &mut out)?,
            _ => unreachable!("the depths are equal"),
        };
        Ok((Image::from_u16(pictures[0].width, pictures[0].height, MERGED_BITS, out), shares))
    }

    /// The merged levels of all pixels.
    fn pixels<const N: usize, T: Copy + Into<u32>>(&self, from: [&[T]; N], out: &mut [u16]) -> Result<Shares> {
        let (full, limit) = (self.full, self.limit());
        let lit = (self.unit * f64::from(full) / LIT) as u32;
        let mut shares = Shares::default();
        let mut pairs: [Agreement; N] = std::array::from_fn(|i| {
            Agreement::new(self, i, dark_noise(from[i], (full as f64 / READABLE + self.black) as u32))
        });
        for (p, out) in out.iter_mut().enumerate() {
            let levels: [u32; N] = std::array::from_fn(|i| from[i][p].into());
            let (k, level) = merge_pixel(&levels, full, limit, &self.weights, &self.drops);
            *out = level as u16;
            if level < lit {
                continue;
            }
            match k {
                0 => shares.saturated += 1,
                k => shares.by_exposure[k - 1] += 1,
            }
            for i in 0..N - 1 {
                pairs[i].compare(levels[i], levels[i + 1], limit);
            }
        }
        pairs[..N - 1].iter().enumerate().try_for_each(|(i, pair)| pair.check(self, i))?;
        Ok(shares)
    }
}

/// The number of exposures that a pixel uses, 0 if it is saturated in all of them, and its merged level: the sum of the
/// levels times their exposures over the sum of the squared exposures, which is the least uncertain one in read noise.
/// Only the exposures before the first one near its limit are used; the shortest is used up to its limit.
#[inline(always)]
fn merge_pixel<const N: usize>(
    levels: &[u32; N],
    full: u32,
    limit: u32,
    weights: &[[u32; MOST_EXPOSURES]; MOST_EXPOSURES],
    drops: &[u32; MOST_EXPOSURES],
) -> (usize, u32) {
    let (mut used, mut clear) = (0, true);
    for level in &levels[1..] {
        clear &= *level < limit;
        used += usize::from(clear);
    }
    if levels[0] >= full {
        return (0, SATURATED);
    }
    let sum: u64 = levels.iter().zip(&weights[used]).map(|(l, w)| u64::from(*l) * u64::from(*w)).sum();
    let level = (sum + (1 << (PLACES - 1))).saturating_sub(u64::from(drops[used])) >> PLACES;
    (used + 1, level.min(u64::from(SATURATED) - 1) as u32)
}

/// Standard deviation of the pixels below a level, from their differences to the pixel after the next.
fn dark_noise<T: Copy + Into<u32>>(levels: &[T], below: u32) -> f64 {
    let pairs = (2..levels.len()).step_by(SAMPLED).map(|p| (levels[p].into(), levels[p - 2].into()));
    let (n, sum) = pairs
        .filter(|(a, b)| *a < below && *b < below)
        .fold((0u32, 0u64), |(n, sum), (a, b)| (n + 1, sum + u64::from(a.abs_diff(b))));
    // The mean difference of two normal numbers is 2 / sqrt(pi) of their sigma.
    let sigma = 0.5 * std::f64::consts::PI.sqrt() * sum as f64 / f64::from(n.max(1));
    sigma.max(ROUNDING)
}

/// Comparison of two neighbouring exposures where both are readable.
struct Agreement {
    /// Exposure over the next longer one.
    ratio: f32,
    black: f32,
    least: u32,
    /// Standard deviation of a dark pixel of the shorter one.
    noise: f64,
    pixels: u64,
    expected: f64,
    apart: f64,
    light: f64,
}

impl Agreement {
    fn new(of: &Bracket, i: usize, noise: f64) -> Agreement {
        let ratio = of.exposures_us.get(i + 1).map_or(1.0, |next| of.exposures_us[i] / next);
        let full = f64::from(of.full);
        let least = ((full / CLEAR).max(full / READABLE / ratio) + of.black) as u32;
        let (ratio, black) = (ratio as f32, of.black as f32);
        Agreement { ratio, black, least, noise, pixels: 0, expected: 0.0, apart: 0.0, light: 0.0 }
    }

    #[inline(always)]
    fn compare(&mut self, shorter: u32, longer: u32, limit: u32) {
        if longer >= self.least && longer < limit {
            let (is, expected) = (shorter as f32 - self.black, (longer as f32 - self.black) * self.ratio);
            self.pixels += 1;
            self.expected += f64::from(expected);
            self.light += f64::from(is);
            self.apart += f64::from((is - expected).abs());
        }
    }

    fn check(&self, of: &Bracket, i: usize) -> Result<()> {
        if self.pixels < COMPARED {
            return Ok(());
        }
        let light = (self.light - self.expected).abs();
        let (place, noise) = (self.apart - light, NOISE * self.noise * self.pixels as f64);
        let [a, b] = [of.exposures_us[i], of.exposures_us[i + 1]];
        let share = |x: f64| 100.0 * x / self.expected;
        // What moved also has another light where the longer exposure is readable.
        if place > OTHER_PLACE * self.expected + noise {
            return Err(Fault::input(format!(
                "the pictures of {a} and {b} us disagree by {:.0} % of their light from pixel to pixel, limit {:.0} % \
                 for their noise",
                share(place),
                share(OTHER_PLACE * self.expected + noise)
            ))
            .cause("camera or part moved between the exposures, or pictures of two poses are in one frame")
            .next("stand still for all exposures of a frame"));
        }
        if light > OTHER_LIGHT * self.expected + noise {
            return Err(Fault::input(format!(
                "the picture of {a} us has {:.2} times the light that the one of {b} us leads to expect in {} pixels; \
                 {:.0} % more or less are possible",
                self.light / self.expected,
                self.pixels,
                100.0 * OTHER_LIGHT
            ))
            .cause(
                "exposures_us or black_level are not the camera's, its levels are not linear, its gain is automatic, \
                 or something moved",
            )
            .next("compare exposures_us and image.response with the camera"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Approximately normal numbers, the same on every machine.
    struct Noise(u64);

    impl Noise {
        fn normal(&mut self) -> f64 {
            let mut next = || {
                self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (self.0 >> 33) as f64 / (1u64 << 31) as f64
            };
            (0..12).map(|_| next()).sum::<f64>() - 6.0
        }
    }

    fn flat(bits: u8, level: u32, n: u32) -> Image {
        if bits == 8 {
            Image::from_u8(n, 1, vec![level as u8; n as usize])
        } else {
            Image::from_u16(n, 1, bits, vec![level as u16; n as usize])
        }
    }

    #[test]
    fn light_is_the_same_whatever_exposure_shows_it() {
        for (bits, black, times) in [
            (8u8, 0.0, vec![1.0, 4.0, 16.0]),
            (12, 64.0, vec![10.0, 80.0]),
            (10, 0.0, vec![1.0, 2.0, 5.0, 30.0]),
            (8, 60.0, vec![1.0, 1.2]),
        ] {
            let bracket = Bracket::new(&times, bits, black).unwrap();
            let (full, last) = (f64::from((1u32 << bits) - 1), times[times.len() - 1]);
            // Light in levels of the longest exposure.
            for share in [0.02, 0.1, 0.4, 0.9, 1.3, 3.0, 9.0, 14.0] {
                let light = share * full;
                let level = |t: &f64| (black + light * t / last).min(full).round() as u32;
                let pictures: Vec<Image> = times.iter().map(|t| flat(bits, level(t), 4)).collect();
                let (merged, shares) = bracket.merge(&pictures).unwrap();
                let is = (f64::from(merged.get(2, 0)) / bracket.unit) - black;
                let used = shares.by_exposure.iter().rposition(|n| *n > 0);
                if level(&times[0]) >= full as u32 {
                    assert_eq!((merged.get(0, 0), shares.saturated), (65535, 4), "{bits} {share}");
                    continue;
                }
                // Half a level of the longest exposure that is not saturated.
                let step = last / times[used.unwrap_or(times.len() - 1)];
                assert!((is - light).abs() <= 0.7 * step, "{bits} bits, {times:?}: {is} of {light}, step {step}");
            }
        }
    }

    /// 248 of 255 is near the limit of a longer exposure; the shortest is used up to 254.
    #[test]
    fn levels_near_the_limit_of_a_longer_exposure_are_not_used() {
        let bracket = Bracket::new(&[1.0, 4.0], 8, 0.0).unwrap();
        let light = |levels: [u32; 2]| {
            let merged = bracket.merge(&levels.map(|l| flat(8, l, 1))).unwrap().0;
            (f64::from(merged.get(0, 0)) / bracket.unit * 10.0).round() / 10.0
        };
        assert_eq!((light([60, 248]), light([254, 255])), (240.0, 4.0 * 254.0));
        // (60 + 4 x 247) 4 / 17.
        assert_eq!(light([60, 247]), 246.6);
    }

    /// Read noise and shot noise of merged pixels are those of docs/math.md, Several exposures (3), whatever is left.
    #[test]
    fn merged_pixels_scatter_as_the_formula_says() {
        let (times, read, gain, black) = ([1.0, 4.0, 16.0], 3.0, 0.4, 200.0);
        let bracket = Bracket::new(&times, 12, black).unwrap();
        let mut noise = Noise(11);
        for (light, left) in [(0.0, 3), (100.0, 3), (1500.0, 3), (3500.0, 3), (5000.0, 2), (13000.0, 2), (20000.0, 1)] {
            let n = 40_000;
            let mut picture = |t: f64| {
                let level = light * t / 16.0;
                let sigma = (read * read + gain * level).sqrt();
                let one = |_| (black + level + sigma * noise.normal()).round().clamp(0.0, 4095.0) as u16;
                Image::from_u16(n, 1, 12, (0..n).map(one).collect())
            };
            let merged = bracket.merge(&times.map(&mut picture)).unwrap().0.to_f32();
            let (n, unit) = (f64::from(n), bracket.unit);
            let mean = merged.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
            let variance = merged.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / n;
            assert!((mean / unit - black - light).abs() < 0.01 * light + 0.5, "{light}: {mean}");
            let power = |p| bracket.power(left - 1, p);
            let told = 256.0 / power(2) * (read * read + 1.0 / 12.0)
                + 16.0 * power(3) / power(2).powi(2) * gain * light
                + 1.0 / 12.0 / (unit * unit);
            let seen = variance / (unit * unit);
            assert!((seen / told - 1.0).abs() < 0.05, "light {light}: variance {seen}, told {told}");
        }
    }

    #[test]
    fn what_is_no_bracket_is_refused() {
        let refused = |times: &[f64], black| Bracket::new(times, 8, black).unwrap_err().what;
        assert!(refused(&[5.0], 0.0).contains("1 exposures, 2 to 4"));
        assert!(refused(&[5.0, 1.0], 0.0).contains("1 us after one of 5 us"));
        assert!(refused(&[5.0, 5.5], 0.0).contains("5.5 us after"));
        assert!(refused(&[1.0, 16.0, 300.0], 0.0).contains("300 times the shortest"));
        assert!(refused(&[0.0, 1.0], 0.0).contains("0 us"));
        assert!(refused(&[f64::NAN, 1.0], 0.0).contains("NaN us"));
        assert!(refused(&[1.0, 2.0], 64.0).contains("black level is 64"));
        let bracket = Bracket::new(&[1.0, 4.0], 8, 0.0).unwrap();
        assert!(bracket.merge(&[flat(8, 3, 4)]).unwrap_err().what.contains("1 pictures of 2"));
        assert!(bracket.merge(&[flat(8, 3, 4), flat(8, 12, 5)]).unwrap_err().what.contains("4x1 with 8 bits and 5x1"));
        assert!(bracket.merge(&[flat(8, 3, 4), flat(12, 12, 4)]).unwrap_err().what.contains("12 bits"));
    }

    #[test]
    fn pictures_that_moved_or_are_not_in_the_stated_ratio_are_refused() {
        let stripe = |at: f64, times: f64| {
            let level = |i: u32| {
                let d = (f64::from(i / 200) - at) / 1.5;
                (120.0 * times * (-0.5 * d * d).exp()).min(255.0).round() as u8
            };
            Image::from_u8(200, 40, (0..200 * 40).map(level).collect())
        };
        let merge = |times: [f64; 2], moved: f64| {
            Bracket::new(&[100.0, 400.0], 8, 0.0)
                .unwrap()
                .merge(&[stripe(20.0, times[0]), stripe(20.0 + moved, times[1])])
        };
        assert!(merge([1.0, 4.0], 0.0).is_ok() && merge([1.0, 4.0], 0.02).is_ok() && merge([1.0, 4.4], 0.0).is_ok());
        for moved in [0.3, 1.5] {
            let fault = merge([1.0, 4.0], moved).unwrap_err();
            assert!(fault.what.contains("100 and 400 us disagree") && fault.cause.contains("moved"), "{fault:?}");
        }
        let fault = merge([1.0, 2.0], 0.0).unwrap_err();
        assert!(fault.what.contains("2.0") && fault.cause.contains("exposures_us"), "{fault:?}");
    }
}
