//! In: a picture of a laser pointer's spot, the places of bad pixels, and (on a board) the picture in
//! room light. Out: the spot's centre with covariance.
//! Frame and unit: px, grey levels (docs/math.md, Pointer (1), (2)).

use crate::fault::{Fault, Result};
use crate::geometry::Vec2;
use crate::raster::Image;
use crate::solve::{LmOptions, Loss, Problem, Residuals, Stop, lm};
use nalgebra::Matrix2;

/// Settings of [`find_spots`].
#[derive(Clone, Debug)]
pub struct SpotOptions {
    /// Contrast of the laser's speckle per pixel; `None`: estimated from all spots together. 0.005..=1.
    pub speckle: Option<f64>,
    /// A spot's peak must rise this many noise sigmas over its surroundings; 4..=100.
    pub min_snr: f64,
    /// Smallest sigma of a spot's profile, px: anything sharper than the lens is a bad pixel; 0.2..=5.
    pub min_width_px: f64,
    /// Largest sigma of a spot's profile, px; 1..=200.
    pub max_width_px: f64,
    /// A second spot with this share of the first one's light makes the choice ambiguous; 0.05..=1.
    pub rival: f64,
}

impl Default for SpotOptions {
    fn default() -> Self {
        SpotOptions { speckle: None, min_snr: 8.0, min_width_px: 0.45, max_width_px: 30.0, rival: 0.5 }
    }
}

impl SpotOptions {
    /// Refuses values out of the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("speckle", self.speckle.unwrap_or(0.1), 0.005, 1.0),
            ("min_snr", self.min_snr, 4.0, 100.0),
            ("min_width_px", self.min_width_px, 0.2, 5.0),
            ("max_width_px", self.max_width_px, 1.0, 200.0),
            ("rival", self.rival, 0.05, 1.0),
        ];
        match ranges.iter().find(|(_, v, low, high)| !(low..=high).contains(&v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("{name} is {v}, {low} to {high} is allowed"))
                    .next("choose a value in that range"))
            }
            None => Ok(()),
        }
    }
}

/// A spot's centre.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Its centre, px.
    pub pixel: Vec2,
    /// px².
    pub covariance: Matrix2<f64>,
    /// Sigma of the profile (geometric mean of the ellipse's axes), px.
    pub width_px: f64,
    /// Peak above the background, grey levels; beyond full scale where it saturates.
    pub amplitude: f64,
    /// How many pixels of its window are at full scale.
    pub saturated_pixels: usize,
    /// Light of the brightest other spot over this one's.
    pub rival: f64,
}

/// Pixels that are bright in every picture of a recording whatever is in view: at least three
/// pictures are needed, else none is called bad.
pub fn hot_pixels(pictures: &[&Image]) -> Vec<bool> {
    let Some(first) = pictures.first() else { return Vec::new() };
    let (w, h) = (first.width as usize, first.height as usize);
    if pictures.len() < 3 {
        return vec![false; w * h];
    }
    let greys: Vec<Vec<f32>> = pictures.iter().map(|p| p.to_f32()).collect();
    let mut column = vec![0.0f32; pictures.len()];
    let median: Vec<f32> = (0..w * h)
        .map(|i| {
            column.iter_mut().zip(&greys).for_each(|(c, g)| *c = g[i]);
            *column.select_nth_unstable_by(pictures.len() / 2, f32::total_cmp).1
        })
        .collect();
    let full = f32::from(first.full_scale());
    let at = |x: usize, y: usize| median[y * w + x];
    let mut hot = vec![false; w * h];
    for y in 0..h {
        for x in 0..w {
            let mut around = Vec::with_capacity(24);
            for j in y.saturating_sub(2)..(y + 3).min(h) {
                for i in x.saturating_sub(2)..(x + 3).min(w) {
                    if (i, j) != (x, y) {
                        around.push(at(i, j));
                    }
                }
            }
            around.sort_by(f32::total_cmp);
            let (middle, high) = (around[around.len() / 2], around[around.len() * 9 / 10]);
            // Brighter than nearly all neighbours by more than the scene's own contrast there.
            hot[y * w + x] = at(x, y) > high + 2.0 * (high - middle) + 0.015 * full;
        }
    }
    hot
}

/// One picture as the fit sees it.
struct Patch {
    x0: usize,
    y0: usize,
    width: usize,
    grey: Vec<f64>,
    /// Pixels that count.
    good: Vec<bool>,
    /// Reflectance relative to the brightest place near the spot.
    reflectance: Vec<f64>,
    full: f64,
    background: f64,
    noise: f64,
}

/// u v, ln amplitude, ln width, two of shape, background.
type Shape = [f64; 7];

struct SpotProblem<'a> {
    patch: &'a Patch,
    /// Per pixel; frozen during one solve.
    sigma: Vec<f64>,
}

/// Value and derivatives of the spot's light by u v lnA lnS e1 e2 at an offset: an elliptical Gaussian
/// whose inverse square root is exp(−lnS) times [[exp(e1), 0], [e2, exp(−e1)]].
fn profile(s: &Shape, dx: f64, dy: f64) -> (f64, [f64; 6]) {
    let (k, e) = ((-s[3]).exp(), s[4].exp());
    let p = k * e * dx;
    let q = k * (s[5] * dx + dy / e);
    let g = (s[2] - 0.5 * (p * p + q * q)).exp();
    let by_dx = -(p * k * e + q * k * s[5]);
    let by_dy = -(q * k / e);
    let by_e1 = -(p * p - q * k * dy / e);
    (g, [-by_dx * g, -by_dy * g, g, (p * p + q * q) * g, by_e1 * g, -q * k * dx * g])
}

impl Patch {
    fn each(&self, mut f: impl FnMut(usize, f64, f64)) {
        for i in 0..self.grey.len() {
            if self.good[i] {
                f(i, (self.x0 + i % self.width) as f64, (self.y0 + i / self.width) as f64);
            }
        }
    }
    fn model(&self, s: &Shape, i: usize, x: f64, y: f64) -> f64 {
        self.reflectance[i] * (s[6] + profile(s, x - s[0], y - s[1]).0)
    }
    /// Speckle is multiplicative, so the faint flanks say as much about the centre as the peak does.
    fn sigmas(&self, s: &Shape, speckle: f64) -> Vec<f64> {
        let mut out = vec![1.0; self.grey.len()];
        self.each(|i, x, y| {
            let light = self.reflectance[i] * profile(s, x - s[0], y - s[1]).0;
            out[i] = ((speckle * light).powi(2) + self.noise * self.noise).sqrt();
        });
        out
    }
}

impl Problem for SpotProblem<'_> {
    type State = Shape;
    fn width(&self) -> usize {
        7
    }
    fn moved(&self, s: &Shape, d: &[f64]) -> Shape {
        std::array::from_fn(|i| s[i] + d[i])
    }
    fn residuals(&self, s: &Shape, out: &mut Residuals) -> Option<()> {
        if s.iter().any(|x| !x.is_finite()) || !(-3.0..6.0).contains(&s[3]) || s[2] > 20.0 || s[4].abs() > 1.5 {
            return None;
        }
        let patch = self.patch;
        patch.each(|i, x, y| {
            let (g, d) = profile(s, x - s[0], y - s[1]);
            let (rho, sigma) = (patch.reflectance[i], self.sigma[i]);
            let model = rho * (s[6] + g);
            // A saturated pixel says only that the light was at least that; a black one the reverse.
            let clipped = (patch.grey[i] >= patch.full && model > patch.full) || (patch.grey[i] <= 0.0 && model < 0.0);
            if !clipped {
                let k = rho / sigma;
                let j = [d[0] * k, d[1] * k, d[2] * k, d[3] * k, d[4] * k, d[5] * k, k];
                out.group(&[(model - patch.grey[i]) / sigma], &[0, 1, 2, 3, 4, 5, 6], &j);
            }
        });
        Some(())
    }
}

/// What a spot is looked for in.
#[derive(Clone, Copy)]
pub struct SpotPicture<'a> {
    /// As messages call it.
    pub name: &'a str,
    /// The picture with the laser on.
    pub laser: &'a Image,
    /// The same view in room light, where the spot lies on a printed board: its print modulates the spot.
    pub ambient: Option<&'a Image>,
}

/// Finds one spot in each picture. All pictures come from one camera and laser: they share the
/// speckle contrast. `hot` comes from [`hot_pixels`]; empty for none.
pub fn find_spots(pictures: &[SpotPicture<'_>], hot: &[bool], o: &SpotOptions) -> Result<Vec<Result<Spot>>> {
    o.check()?;
    let mut speckle = o.speckle.unwrap_or(0.15);
    let mut patches: Vec<Result<(Patch, Shape, f64)>> = pictures.iter().map(|p| locate(p, hot, o)).collect();
    for _ in 0..if o.speckle.is_some() { 1 } else { 3 } {
        let mut scatter = Vec::new();
        for (patch, shape, _) in patches.iter_mut().flatten() {
            *shape = refine(patch, shape, speckle).0;
            collect_scatter(patch, shape, &mut scatter);
        }
        if o.speckle.is_none() && scatter.len() >= 10 {
            // Six numbers were fitted to the few bright pixels of each spot.
            let spots = patches.iter().flatten().count() as f64;
            let n = scatter.len() as f64;
            let robust = crate::solve::robust_scale(&mut scatter, 1);
            speckle = (robust * (n / f64::max(n - 5.0 * spots, 0.3 * n)).sqrt()).clamp(0.005, 1.0);
        }
    }
    let finish = |found: Result<(Patch, Shape, f64)>| {
        let (patch, shape, rival) = found?;
        let (s, covariance) = refine(&patch, &shape, speckle);
        let width = s[3].exp();
        let noise = patch.noise.hypot(0.0);
        let missing = |what: String| {
            Err(Fault::refused(what)
                .cause("the pointer was off, out of view, or drowned by room light")
                .next("take this picture again, or leave it out"))
        };
        if !(o.min_width_px..=o.max_width_px).contains(&width) {
            return missing(format!(
                "the brightest place is {width:.2} px wide (sigma), {} to {} is a spot",
                o.min_width_px, o.max_width_px
            ));
        }
        if s[2].exp() < o.min_snr * noise {
            return missing(format!("the spot rises {:.1} grey levels over a noise of {noise:.1}", s[2].exp()));
        }
        if rival > o.rival {
            return Err(Fault::refused(format!(
                "two spots, the second with {:.0} % of the first one's light (limit {:.0} %)",
                rival * 100.0,
                o.rival * 100.0
            ))
            .cause("a glint or a second reflection of the beam")
            .next("cover the shiny place and take this picture again"));
        }
        let covariance = covariance.ok_or_else(|| {
            Fault::refused("the spot's centre is not determined")
                .next("take the picture again with a smaller or darker spot")
        })?;
        let mut saturated = 0;
        patch.each(|i, _, _| saturated += usize::from(patch.grey[i] >= patch.full));
        Ok(Spot {
            pixel: Vec2::new(s[0], s[1]),
            covariance,
            width_px: width,
            amplitude: s[2].exp(),
            saturated_pixels: saturated,
            rival,
        })
    };
    Ok(patches.into_iter().map(finish).collect())
}

fn refine(patch: &Patch, start: &Shape, speckle: f64) -> (Shape, Option<Matrix2<f64>>) {
    let mut shape = *start;
    let mut covariance = None;
    for _ in 0..4 {
        let problem = SpotProblem { patch, sigma: patch.sigmas(&shape, speckle) };
        let o = LmOptions { loss: Loss::Huber(2.5), max_iterations: 60, tolerance: 1e-10, ..LmOptions::default() };
        let s = lm(&problem, shape, &o);
        if s.stop == Stop::BadStart {
            return (shape, None);
        }
        let step = Vec2::new(s.state[0] - shape[0], s.state[1] - shape[1]).norm();
        shape = s.state;
        covariance = s.covariance.map(|c| {
            let scale = s.sigma0.max(1.0).powi(2);
            Matrix2::new(c[(0, 0)], c[(0, 1)], c[(1, 0)], c[(1, 1)]) * scale
        });
        if step < 1e-4 {
            break;
        }
    }
    (shape, covariance)
}

/// |grey − model| / light of the pixels where light dominates: their spread is the speckle's contrast.
fn collect_scatter(patch: &Patch, s: &Shape, out: &mut Vec<f64>) {
    patch.each(|i, x, y| {
        let light = patch.reflectance[i] * profile(s, x - s[0], y - s[1]).0;
        if light > (0.1 * s[2].exp()).max(10.0 * patch.noise) && patch.grey[i] < patch.full {
            out.push((patch.grey[i] - patch.model(s, i, x, y)).abs() / light);
        }
    });
}

/// Finds the brightest spot and its first shape.
fn locate(p: &SpotPicture<'_>, hot: &[bool], o: &SpotOptions) -> Result<(Patch, Shape, f64)> {
    let (w, h) = (p.laser.width as usize, p.laser.height as usize);
    if w < 16 || h < 16 {
        return Err(Fault::input(format!("{w}x{h} is too small for a spot, at least 16x16"))
            .next("give pictures of the whole sensor"));
    }
    let full = f64::from(p.laser.full_scale());
    let grey: Vec<f64> = p.laser.to_f32().iter().map(|&g| f64::from(g)).collect();
    let is_hot = |i: usize| hot.get(i).copied().unwrap_or(false);
    // Light of 5x5 pixels with the bad ones and the brightest of each left out: no single pixel wins.
    let mut best = (0.0, 0, 0);
    let mut blurred = vec![0.0; w * h];
    for y in 2..h - 2 {
        for x in 2..w - 2 {
            let (mut sum, mut top, mut n) = (0.0, 0.0f64, 0.0);
            for j in y - 2..=y + 2 {
                for i in x - 2..=x + 2 {
                    let k = j * w + i;
                    if !is_hot(k) {
                        sum += grey[k];
                        top = top.max(grey[k]);
                        n += 1.0;
                    }
                }
            }
            let value = (sum - top) / f64::max(n - 1.0, 1.0);
            blurred[y * w + x] = value;
            if value > best.0 {
                best = (value, x, y);
            }
        }
    }
    let (_, bx, by) = best;
    let (background, noise) = surroundings(&grey, w, h, bx, by);
    let top = best.0 - background;
    if !(top > 0.0) {
        return Err(Fault::refused("no spot stands out")
            .cause("the pointer was off, the exposure far too short, or room light hides it")
            .next("take this picture again, or leave it out"));
    }
    // Area above half of the peak gives the first width: π 2 ln 2 s² for a Gaussian.
    let reach = (o.max_width_px * 2.0).ceil() as usize;
    let (x_low, x_high) = (bx.saturating_sub(reach), (bx + reach + 1).min(w));
    let (y_low, y_high) = (by.saturating_sub(reach), (by + reach + 1).min(h));
    let mut peak = 0.0f64;
    for y in by.saturating_sub(2)..(by + 3).min(h) {
        for x in bx.saturating_sub(2)..(bx + 3).min(w) {
            if !is_hot(y * w + x) {
                peak = peak.max(grey[y * w + x] - background);
            }
        }
    }
    let mut area = 0.0;
    for y in y_low..y_high {
        for x in x_low..x_high {
            area += f64::from(u8::from(grey[y * w + x] - background > 0.5 * peak && !is_hot(y * w + x)));
        }
    }
    let width = (area / (std::f64::consts::TAU * std::f64::consts::LN_2)).sqrt().clamp(0.7, o.max_width_px);
    let rival = rival(&blurred, w, h, (bx, by), (6.0 * width).max(8.0), background) / top;
    let half = (4.5 * width + 3.0).ceil() as usize;
    let (x0, y0) = (bx.saturating_sub(half), by.saturating_sub(half));
    let (x1, y1) = ((bx + half + 1).min(w), (by + half + 1).min(h));
    let mut patch = Patch {
        x0,
        y0,
        width: x1 - x0,
        grey: Vec::new(),
        good: Vec::new(),
        reflectance: Vec::new(),
        full,
        background,
        noise,
    };
    for y in y0..y1 {
        for x in x0..x1 {
            patch.grey.push(grey[y * w + x]);
            patch.good.push(!is_hot(y * w + x));
            patch.reflectance.push(p.ambient.map_or(1.0, |a| f64::from(a.get(x as u32, y as u32))));
        }
    }
    if p.ambient.is_some() {
        // The print's white: the third quartile of what the spot covers.
        let mut sorted = patch.reflectance.clone();
        sorted.sort_by(f64::total_cmp);
        let white = sorted[sorted.len() * 3 / 4].max(1.0);
        patch.reflectance.iter_mut().for_each(|r| *r = (*r / white).clamp(0.01, 2.0));
    }
    let shape = [bx as f64, by as f64, peak.max(1.0).ln(), width.ln(), 0.0, 0.0, patch.background];
    Ok((patch, shape, rival))
}

/// Median and noise of a ring around the spot.
fn surroundings(grey: &[f64], w: usize, h: usize, x: usize, y: usize) -> (f64, f64) {
    let mut ring = Vec::new();
    let r = 24usize;
    for j in y.saturating_sub(r)..(y + r + 1).min(h) {
        for i in x.saturating_sub(r)..(x + r + 1).min(w) {
            if i.abs_diff(x).max(j.abs_diff(y)) > 12 {
                ring.push(grey[j * w + i]);
            }
        }
    }
    ring.sort_by(f64::total_cmp);
    let median = ring[ring.len() / 2];
    let mut off: Vec<f64> = ring.iter().map(|g| (g - median).abs()).collect();
    // Grey levels are whole numbers: their rounding alone has a sigma of 0.29.
    (median, crate::solve::robust_scale(&mut off, 1).max(0.29).hypot(0.29))
}

/// Light of the brightest place outside `reach` px of the spot, above the background.
fn rival(blurred: &[f64], w: usize, h: usize, spot: (usize, usize), reach: f64, background: f64) -> f64 {
    let mut best = 0.0f64;
    for y in 0..h {
        for x in 0..w {
            let d = (x as f64 - spot.0 as f64).hypot(y as f64 - spot.1 as f64);
            if d > reach {
                best = best.max(blurred[y * w + x] - background);
            }
        }
    }
    best
}
