//! In: pictures of a stripe. Out: their levels, and the stripe's brightness, width and gaps along its length.
//! Frame and unit: px; shares of full scale and of the stripe's length.

use crate::raster::Image;

/// Levels of a picture and its stripe.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Look {
    /// Lowest, median, 99th percentile, highest level.
    pub levels: [u16; 4],
    /// Share of saturated pixels.
    pub saturated: f64,
    /// Pixels by level, sixteen ranges of the same width.
    pub histogram: [u64; 16],
    /// The stripe; none if no line of the picture shows one.
    pub stripe: Option<StripeLook>,
}

/// A stripe, examined across, in each line of the picture.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StripeLook {
    /// Whether the stripe is lying, so that it is examined column by column.
    pub lying: bool,
    /// Level exceeded by a twentieth of its peaks, as share of full scale.
    pub peak: f64,
    /// Share of its peaks that are saturated.
    pub saturated: f64,
    /// Full width at half height, px, median.
    pub width_px: f64,
    /// Ratio of its peak to the level beside it, median.
    pub contrast: f64,
    /// Share of the lines without a stripe.
    pub dark: f64,
    /// Peak (share of full scale) in eight parts along the stripe; 0 where dark.
    pub along: [f64; 8],
    /// The same figures in pieces of equal length, from the left or the top.
    pub pieces: Vec<Piece>,
}

/// A piece of the picture along the stripe.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Piece {
    /// Median peak, share of full scale; 0 where dark.
    pub peak: f64,
    /// Full width at half height, px, median; 0 where dark.
    pub width_px: f64,
    /// Ratio of the peak to the level beside it, median; 0 where dark.
    pub contrast: f64,
    /// Share of its lines without a stripe.
    pub dark: f64,
}

/// Number of pieces that a stripe is divided into.
pub const PIECES: usize = 32;

/// Wanted range of the peak, share of full scale.
pub const WANTED: [f64; 2] = [0.70, 0.85];
/// Largest acceptable share of saturated peaks.
pub const MOST_SATURATED: f64 = 0.005;
/// A peak must exceed its line's level by this many times the line's scatter, and by the share `LEAST` of full
/// scale.
const STANDS_OUT: f64 = 8.0;
const LEAST: f64 = 0.03;

/// Examines a picture.
pub fn look(image: &Image) -> Look {
    look_at(std::slice::from_ref(image))
}

/// Examines pictures of the same size and depth as one: with more peaks, shares of a few per mille are more
/// accurate.
///
/// # Panics
/// Without a picture.
pub fn look_at(images: &[Image]) -> Look {
    let full = usize::from(images[0].full_scale());
    let mut counts = vec![0u64; full + 1];
    let mut count = |i: &Image| {
        (0..i.height).for_each(|y| (0..i.width).for_each(|x| counts[usize::from(i.get(x, y)).min(full)] += 1));
    };
    images.iter().for_each(&mut count);
    let total: u64 = counts.iter().sum();
    let level = |share: f64| {
        let mut left = (share * (total - 1) as f64) as u64;
        let at = counts.iter().position(|n| {
            let here = left < *n;
            left = left.saturating_sub(*n);
            here
        });
        at.unwrap_or(0) as u16
    };
    let mut histogram = [0; 16];
    counts.iter().enumerate().for_each(|(l, n)| histogram[l * 16 / counts.len()] += n);
    let saturated = *counts.last().expect("a level") as f64 / total as f64;
    let levels = [level(0.0), level(0.5), level(0.99), level(1.0)];
    let [lying, upright] = [true, false].map(|lying| {
        let mut seen = Across::default();
        images.iter().for_each(|image| seen.add(image, lying));
        seen.stripe(lying)
    });
    // The right direction shows the stripe in more lines, and narrower.
    let score = |s: &Option<StripeLook>| s.as_ref().map_or(0.0, |s| (1.0 - s.dark) / s.width_px.max(1.0));
    let stripe = if score(&lying) >= score(&upright) { lying } else { upright };
    Look { levels, saturated, histogram, stripe }
}

/// What the lines of pictures show across the stripe.
#[derive(Default)]
struct Across {
    lines: usize,
    peaks: Vec<f64>,
    widths: Vec<f64>,
    contrasts: Vec<f64>,
    saturated: u32,
    along: [(f64, u32); 8],
    pieces: Vec<InPiece>,
}

/// What the lines of a piece show: their number, and peaks, widths and contrasts of those with a stripe.
#[derive(Clone, Default)]
struct InPiece {
    lines: usize,
    seen: [Vec<f64>; 3],
}

impl InPiece {
    fn piece(mut self) -> Piece {
        let shown = self.seen[0].len();
        if shown == 0 {
            return Piece { dark: 1.0, ..Piece::default() };
        }
        let [peak, width_px, contrast] = [0, 1, 2].map(|i| share(&mut self.seen[i], 0.5));
        Piece { peak, width_px, contrast, dark: 1.0 - shown as f64 / self.lines as f64 }
    }
}

/// The value that this share of the values does not exceed.
fn share(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(share * (values.len() - 1) as f64) as usize]
}

/// The stripe in one line of a picture across it.
pub(super) struct Crossing {
    /// Highest level.
    pub top: u16,
    /// Level beside the stripe.
    pub ground: f64,
    /// Full width at half height, px.
    pub width: usize,
}

/// The stripe in each line of a picture across it; none in a line that does not show it.
pub(super) fn crossings(image: &Image, lying: bool) -> Vec<Option<Crossing>> {
    let full = f64::from(image.full_scale());
    let (lines, length) = if lying { (image.width, image.height) } else { (image.height, image.width) };
    let mut line = vec![0u16; length as usize];
    (0..lines)
        .map(|k| {
            line.iter_mut().zip(0..).for_each(|(l, i)| *l = if lying { image.get(k, i) } else { image.get(i, k) });
            let (at, top) = line.iter().copied().enumerate().max_by_key(|(_, l)| *l)?;
            let mut sorted = line.clone();
            sorted.sort_unstable();
            let part = |share: f64| f64::from(sorted[(share * (sorted.len() - 1) as f64) as usize]);
            let (ground, scatter) = (part(0.5), (part(0.84) - part(0.5)).max(0.5));
            let rises = f64::from(top) - ground;
            if rises < STANDS_OUT * scatter || rises < LEAST * full {
                return None;
            }
            let half = ground + 0.5 * rises;
            let above = |l: &u16| f64::from(*l) > half;
            let after = line[at..].iter().take_while(|l| above(l)).count();
            let before = line[..at].iter().rev().take_while(|l| above(l)).count();
            Some(Crossing { top, ground, width: after + before })
        })
        .collect()
}

impl Across {
    fn add(&mut self, image: &Image, lying: bool) {
        let full = f64::from(image.full_scale());
        let crossings = crossings(image, lying);
        let lines = crossings.len();
        self.lines += lines;
        self.pieces.resize(PIECES, InPiece::default());
        for (k, crossing) in crossings.into_iter().enumerate() {
            let piece = &mut self.pieces[k * PIECES / lines];
            piece.lines += 1;
            let Some(Crossing { top, ground, width }) = crossing else { continue };
            let seen = [f64::from(top) / full, width as f64, f64::from(top) / ground.max(1.0)];
            piece.seen.iter_mut().zip(seen).for_each(|(all, v)| all.push(v));
            let [peak, width, contrast] = seen;
            self.peaks.push(peak);
            self.widths.push(width);
            self.contrasts.push(contrast);
            self.saturated += u32::from(top == image.full_scale());
            let eighth = &mut self.along[k * 8 / lines];
            *eighth = (eighth.0 + f64::from(top) / full, eighth.1 + 1);
        }
    }

    /// The stripe; none if hardly any line shows one.
    fn stripe(mut self, lying: bool) -> Option<StripeLook> {
        let shown = self.peaks.len();
        if shown == 0 || shown * 50 < self.lines {
            return None;
        }
        Some(StripeLook {
            lying,
            peak: share(&mut self.peaks, 0.95),
            saturated: f64::from(self.saturated) / shown as f64,
            width_px: share(&mut self.widths, 0.5),
            contrast: share(&mut self.contrasts, 0.5),
            dark: 1.0 - shown as f64 / self.lines as f64,
            along: self.along.map(|(sum, n)| if n > 0 { sum / f64::from(n) } else { 0.0 }),
            pieces: self.pieces.into_iter().map(InPiece::piece).collect(),
        })
    }
}

impl Look {
    /// Whether the exposure is within the wanted range.
    pub fn right(&self) -> bool {
        self.stripe.as_ref().is_some_and(|s| (WANTED[0]..=WANTED[1]).contains(&s.peak) && s.saturated <= MOST_SATURATED)
    }
}

impl std::fmt::Display for Look {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, median, p99, high] = self.levels;
        let saturated = 100.0 * self.saturated;
        writeln!(f, "levels: lowest {low}, median {median}, 99 % {p99}, highest {high}; {saturated:.3} % saturated")?;
        let total: u64 = self.histogram.iter().sum();
        let bar = |n: &u64| b" .:-=+*#%@"[(9.0 * (1.0 + *n as f64).ln() / (1.0 + total as f64).ln()) as usize] as char;
        writeln!(f, "histogram, dark to full scale: [{}]", self.histogram.iter().map(bar).collect::<String>())?;
        let Some(s) = &self.stripe else { return write!(f, "no stripe") };
        let along: Vec<String> = s.along.iter().map(|p| format!("{:.0}", 100.0 * p)).collect();
        write!(
            f,
            "stripe ({}): peaks at {:.0} % of full scale, {:.2} % of them saturated, {:.1} px wide, contrast {:.0}, \
             dark {:.1} %; along it {} %",
            if s.lying { "lying" } else { "upright" },
            100.0 * s.peak,
            100.0 * s.saturated,
            s.width_px,
            s.contrast,
            100.0 * s.dark,
            along.join(" ")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(peak: f64, lying: bool) -> Image {
        let (w, h) = (200u32, 160u32);
        let at = |x: u32, y: u32| {
            let (along, across) = if lying { (x, y) } else { (y, x) };
            let middle = 70.0 + 0.1 * f64::from(along);
            let stripe = peak * (-0.5 * ((f64::from(across) - middle) / 2.0).powi(2)).exp();
            // A tenth of the stripe is in shadow.
            let shown = if along < 16 { 0.0 } else { stripe };
            (10.0 + f64::from((x * 7 + y * 13) % 5) + shown).min(255.0) as u8
        };
        Image::from_u8(w, h, (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect())
    }

    #[test]
    fn a_stripe_is_looked_at_across() {
        for lying in [true, false] {
            let seen = look(&picture(190.0, lying));
            let stripe = seen.stripe.as_ref().unwrap();
            assert_eq!(stripe.lying, lying);
            assert!((stripe.width_px - 4.7).abs() < 1.0 && (stripe.peak - 0.79).abs() < 0.03, "{seen}");
            assert!((stripe.dark - 16.0 / if lying { 200.0 } else { 160.0 }).abs() < 0.01 && seen.right(), "{seen}");
            // The shadow is at the beginning only.
            let dark: f64 = stripe.pieces.iter().map(|p| p.dark).sum::<f64>() / stripe.pieces.len() as f64;
            assert!(
                stripe.pieces[0].dark == 1.0 && stripe.pieces[8..].iter().all(|p| p.dark == 0.0),
                "{:?}",
                stripe.pieces
            );
            assert!((dark - stripe.dark).abs() < 0.02, "{dark}");
            assert!(stripe.pieces[8..].iter().all(|p| (p.width_px - 4.7).abs() < 1.4 && (p.peak - 0.79).abs() < 0.05));
        }
        let bright = look(&picture(500.0, true));
        assert!(bright.stripe.as_ref().unwrap().saturated > 0.9 && !bright.right());
        assert!(look(&picture(0.0, true)).stripe.is_none());
    }
}
