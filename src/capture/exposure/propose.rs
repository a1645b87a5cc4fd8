//! In: a camera whose pictures show a stripe. Out: whether one exposure holds the scene; if not, the exposures that do,
//! with the levels that were measured.
//! Frame and unit: exposure in us; grey levels; shares of full scale and of the stripe's lines.

use super::fresh::Fresh;
use super::setting::Setting;
use super::tune::PATIENCE;
use crate::capture::look::{Crossing, MOST_SATURATED, WANTED, crossings, look};
use crate::capture::picture::PictureSource;
use crate::fault::Result;
use crate::raster::{Image, MOST_EXPOSURES, MOST_RATIO};

/// Ratio of the exposures at which the stripe is measured.
const RUNG: f64 = 4.0;
/// Most of them in each direction.
const RUNGS: usize = 8;
/// The stripe's lines by their light: the darkest twentieth, and all but the share that may saturate.
const DARKEST: f64 = 0.05;
const BRIGHTEST: f64 = 1.0 - MOST_SATURATED;
/// From this many times the noise on a stripe counts as measurable; from four times on it gives points at all.
const MEASURABLE: f64 = 10.0;
/// The longest exposure lifts the darkest twentieth to this share of full scale.
const LIFTED: f64 = 0.2;
/// The longest exposure lets room light rise to this share of full scale.
const ROOM: f64 = 0.25;
/// Largest ratio of two neighbouring exposures that are proposed, and least ratio of the last to the first.
const APART: f64 = 8.0;
const WORTH: f64 = 2.0;
/// A level of a line counts below this share of full scale: a sensor bends near its limit.
const UNBENT: f64 = 31.0 / 32.0;
/// Least width of a stripe, px: a narrower peak is a hot pixel.
const NARROWEST: usize = 2;
/// The noise is measured in pixels whose two levels add up to this, if there are enough of them.
const FAINT: u32 = 6;
const ENOUGH: u64 = 100;
/// Least standard deviation, levels: rounding.
const ROUNDING: f64 = 0.3;

/// Exposures for a scene that one exposure cannot hold.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Proposal {
    /// Exposures, us, ascending.
    pub exposures_us: Vec<f64>,
    /// Exposure at which the darkest twentieth of the stripe is just measurable, us.
    pub measurable_us: f64,
    /// Share of the stripe that is saturated at that exposure.
    pub saturated: f64,
    /// Level of the darkest twentieth over the ground at the shortest of the exposures.
    pub darkest: f64,
    /// Standard deviation of a dark pixel, levels.
    pub noise: f64,
    /// Share of the lines of the picture that show no stripe at any exposure.
    pub without: f64,
}

impl Proposal {
    /// The exposures as the option of `record` takes them.
    pub fn option(&self) -> String {
        let all: Vec<String> = self.exposures_us.iter().map(f64::to_string).collect();
        format!("--exposures {}", all.join(","))
    }
}

impl std::fmt::Display for Proposal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Proposal { exposures_us, measurable_us, saturated, darkest, noise, without } = self;
        write!(
            f,
            "one exposure cannot hold this scene: at {measurable_us:.0} us, where the darkest twentieth of the stripe \
             is {MEASURABLE:.0} times the noise of {noise:.1} levels, {:.1} % of the stripe is saturated; at {:.0} us \
             that twentieth stands at {darkest:.1} levels",
            100.0 * saturated,
            exposures_us[0]
        )?;
        if *without > 0.0 {
            write!(f, "; {:.1} % of the lines show no stripe at any exposure", 100.0 * without)?;
        }
        write!(f, "\ntake several exposures of each pose: sheetlight record {} ...", self.option())
    }
}

/// What a picture shows at an exposure.
struct Rung {
    us: f64,
    /// The stripe in each line, where it stands out.
    lines: Vec<Option<Crossing>>,
    /// Whether each line is saturated. A stripe that is far too bright fills its line and does not stand out.
    saturated: Vec<bool>,
    full: f64,
    ground: f64,
}

impl Rung {
    fn take(source: &mut dyn PictureSource, setting: &Setting, us: f64, lying: bool) -> Result<(Rung, Image)> {
        let us = setting.set(source, us)?;
        let image = Fresh::now(source, PATIENCE).next()?;
        Ok((Rung::of(&image, us, lying), image))
    }

    fn of(image: &Image, us: f64, lying: bool) -> Rung {
        let full = image.full_scale();
        let wide = |c: Option<Crossing>| c.filter(|c| c.width >= NARROWEST);
        let lines: Vec<_> = crossings(image, lying).into_iter().map(wide).collect();
        let across = if lying { image.height } else { image.width };
        let level = |k: u32, i: u32| if lying { image.get(k, i) } else { image.get(i, k) };
        let saturated = (0..lines.len() as u32)
            .map(|k| (0..across).filter(|i| level(k, *i) >= full).take(NARROWEST).count() == NARROWEST)
            .collect();
        Rung { us, lines, saturated, full: f64::from(full), ground: f64::from(look(image).levels[1]) }
    }

    /// Number of lines that are saturated.
    fn over(&self) -> usize {
        self.saturated.iter().filter(|s| **s).count()
    }

    /// Share of the lines that show the stripe in which it is saturated.
    fn saturated(&self) -> f64 {
        let shown = self.lines.iter().zip(&self.saturated).filter(|(c, s)| c.is_some() || **s).count();
        self.over() as f64 / shown.max(1) as f64
    }
}

/// Whether the scene needs several exposures, and which. The camera's exposure is set back.
///
/// # Errors
/// A source without ExposureTime; a camera that is lost or does not set what it offers.
pub fn propose(source: &mut dyn PictureSource, mut tried: impl FnMut(f64, f64)) -> Result<Option<Proposal>> {
    let setting = Setting::of(source)?;
    let Some(former) = setting.us else { return Ok(None) };
    let found = measured(source, &setting, former, &mut tried);
    source.set(&setting.name, &format!("{former}"))?;
    found
}

/// Measures the stripe at exposures shorter and longer than the present one; `tried` hears each and the share of the
/// stripe that it saturates.
fn measured(
    source: &mut dyn PictureSource,
    setting: &Setting,
    former: f64,
    tried: &mut dyn FnMut(f64, f64),
) -> Result<Option<Proposal>> {
    let [low, high] = setting.range;
    let first = Fresh::now(source, PATIENCE).next()?;
    let Some(lying) = look(&first).stripe.map(|s| s.lying) else { return Ok(None) };
    let mut rungs = vec![Rung::of(&first, former, lying)];
    let mut picture = first;
    for _ in 0..RUNGS {
        let last = rungs.last().expect("has one");
        tried(last.us, last.saturated());
        let next = (last.us / RUNG).max(low);
        if last.saturated() <= MOST_SATURATED || next >= last.us {
            break;
        }
        let rung;
        (rung, picture) = Rung::take(source, setting, next, lying)?;
        rungs.push(rung);
    }
    // Two pictures of the shortest exposure differ by noise alone.
    let noise = noise(&picture, &Fresh::now(source, PATIENCE).next()?);
    rungs.reverse();
    let full = rungs[0].full;
    let Some(bright) = light_of(&lights(&rungs).0, BRIGHTEST) else { return Ok(None) };
    let mut most = high.min(MOST_RATIO * full / bright);
    for _ in 0..RUNGS {
        let last = rungs.last().expect("has one");
        let next = (RUNG * last.us).min(most);
        if next < 1.01 * last.us {
            break;
        }
        let (rung, _) = Rung::take(source, setting, next, lying)?;
        tried(rung.us, rung.saturated());
        if rung.ground > ROOM * full {
            most = ROOM * full / rung.ground * rung.us;
            break;
        }
        rungs.push(rung);
    }
    let (lights, without) = lights(&rungs);
    let [Some(dark), Some(bright)] = [DARKEST, BRIGHTEST].map(|share| light_of(&lights, share)) else {
        return Ok(None);
    };
    let short = (WANTED[1] * full / bright).clamp(low, high);
    let long = (LIFTED * full / dark).min(most).min(MOST_RATIO * short);
    let measurable = MEASURABLE * noise / dark;
    if measurable <= short || long < WORTH * short {
        return Ok(None);
    }
    let (at, _) = Rung::take(source, setting, measurable.min(long), lying)?;
    let saturated = at.over() as f64 / lights.len() as f64;
    tried(at.us, saturated);
    if saturated <= MOST_SATURATED {
        return Ok(None);
    }
    let ratio = long / short;
    let n = (2..MOST_EXPOSURES).find(|n| ratio <= APART.powi(*n as i32 - 1)).unwrap_or(MOST_EXPOSURES);
    let exposures_us: Vec<f64> =
        (0..n).map(|k| rounded(short * ratio.powf(k as f64 / (n - 1) as f64)).clamp(low, high)).collect();
    let darkest = dark * exposures_us[0];
    Ok(Some(Proposal { exposures_us, measurable_us: at.us, saturated, darkest, noise, without }))
}

/// Light of each line, levels per us, ascending, from the longest exposure that shows it unsaturated; the share of
/// lines without a stripe.
fn lights(rungs: &[Rung]) -> (Vec<f64>, f64) {
    let lines = rungs[0].lines.len();
    let light = |k: usize| {
        let seen = rungs.iter().rev().filter_map(|r| Some((r, r.lines[k].as_ref()?)));
        let mut bright = None;
        for (rung, c) in seen {
            let light = (f64::from(c.top) - c.ground) / rung.us;
            if f64::from(c.top) < UNBENT * rung.full {
                return Some(light);
            }
            bright = Some(light);
        }
        bright
    };
    let mut lights: Vec<f64> = (0..lines).filter_map(light).collect();
    lights.sort_by(f64::total_cmp);
    let without = 1.0 - lights.len() as f64 / lines.max(1) as f64;
    (lights, without)
}

/// The light that this share of the lines does not exceed.
fn light_of(lights: &[f64], share: f64) -> Option<f64> {
    lights.get((share * lights.len().checked_sub(1)? as f64) as usize).copied()
}

/// Standard deviation of a dark pixel, levels, from two pictures of the same light. Most dark pixels are cut off at
/// level 0, so those with a little light are taken where there are enough.
fn noise(a: &Image, b: &Image) -> f64 {
    let full = u32::from(a.full_scale());
    // The sum of both levels: a mean of 3 to a sixteenth of full scale, or below.
    let (mut lit, mut all) = ((0u64, 0u64), (0u64, 0u64));
    for (x, y) in (0..a.height).flat_map(|y| (0..a.width).map(move |x| (x, y))) {
        let (p, q) = (a.get(x, y), b.get(x, y));
        let sum = u32::from(p) + u32::from(q);
        if sum < full / 8 {
            let apart = u64::from(p.abs_diff(q));
            all = (all.0 + 1, all.1 + apart);
            if sum >= FAINT {
                lit = (lit.0 + 1, lit.1 + apart);
            }
        }
    }
    let (n, sum) = if lit.0 >= ENOUGH { lit } else { all };
    // The mean difference of two normal numbers is 2 / sqrt(pi) of their sigma.
    (0.5 * std::f64::consts::PI.sqrt() * sum as f64 / n.max(1) as f64).max(ROUNDING)
}

/// Three digits.
fn rounded(us: f64) -> f64 {
    let unit = 10f64.powf(us.log10().floor() - 2.0);
    // Powers of ten below one are not exact: 1.58 instead of 1.5800000000000002.
    let digits = (us / unit).round();
    if unit < 1.0 { digits / (1.0 / unit).round() } else { digits * unit }
}
