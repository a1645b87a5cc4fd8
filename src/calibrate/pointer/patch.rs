//! In: a picture with a spot, the positions of bad pixels, and (on a board) the picture in room light. Out: the
//! region around the brightest spot, and the start shape of the fit.
//! Frame and unit: px, grey levels (docs/math.md, Pointer (1), (2)).

use crate::fault::{Fault, Result};
use crate::raster::Image;
use std::ops::Range;

/// The part of a picture that the fit uses.
pub(super) struct Patch {
    x0: usize,
    y0: usize,
    width: usize,
    pub grey: Vec<f64>,
    /// Pixels that are used.
    good: Vec<bool>,
    /// Reflectance relative to the white of the print near the spot.
    pub reflectance: Vec<f64>,
    /// Full scale, and the noise around the spot, grey levels.
    pub full: f64,
    pub noise: f64,
}

/// u v, ln amplitude, ln width, two shape parameters, background.
pub(super) type Shape = [f64; 7];

/// Value and derivatives of the spot's intensity by u v lnA lnS e1 e2 at an offset. The spot is an elliptical
/// Gaussian whose inverse square root is exp(−lnS) times [[exp(e1), 0], [e2, exp(−e1)]].
pub(super) fn profile(s: &Shape, dx: f64, dy: f64) -> (f64, [f64; 6]) {
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
    pub fn each(&self, mut f: impl FnMut(usize, f64, f64)) {
        for i in 0..self.grey.len() {
            if self.good[i] {
                f(i, (self.x0 + i % self.width) as f64, (self.y0 + i / self.width) as f64);
            }
        }
    }
    pub fn model(&self, s: &Shape, i: usize, x: f64, y: f64) -> f64 {
        self.reflectance[i] * (s[6] + profile(s, x - s[0], y - s[1]).0)
    }
    /// Speckle is multiplicative, so the faint flanks carry as much information about the centre as the peak.
    pub fn sigmas(&self, s: &Shape, speckle: f64) -> Vec<f64> {
        let mut out = vec![1.0; self.grey.len()];
        self.each(|i, x, y| {
            let light = self.reflectance[i] * profile(s, x - s[0], y - s[1]).0;
            out[i] = ((speckle * light).powi(2) + self.noise * self.noise).sqrt();
        });
        out
    }
    /// Sets the reflectance of the print under the spot from the picture in room light.
    fn lit_by(&mut self, ambient: &Image) {
        for (i, r) in self.reflectance.iter_mut().enumerate() {
            let (x, y) = (self.x0 + i % self.width, self.y0 + i / self.width);
            *r = f64::from(ambient.get(x as u32, y as u32));
        }
        // White of the print: the third quartile of the window.
        let mut sorted = self.reflectance.clone();
        sorted.sort_by(f64::total_cmp);
        let white = sorted[sorted.len() * 3 / 4].max(1.0);
        self.reflectance.iter_mut().for_each(|r| *r = (*r / white).clamp(0.01, 2.0));
    }
}

/// The brightest spot of a picture.
pub(super) struct Brightest {
    pub patch: Patch,
    /// Start values of the fit.
    pub shape: Shape,
    /// Intensity of the brightest other spot relative to this one.
    pub rival: f64,
}

/// Finds the brightest spot and the start values of its shape.
pub(super) fn locate(laser: &Image, ambient: Option<&Image>, hot: &[bool], max_width_px: f64) -> Result<Brightest> {
    let (w, h) = (laser.width as usize, laser.height as usize);
    if w < 16 || h < 16 {
        return Err(Fault::input(format!("{w}x{h} is too small for a spot, at least 16x16"))
            .next("give pictures of the whole sensor"));
    }
    let grey = laser.to_f32().iter().map(|&g| f64::from(g)).collect();
    let picture = Picture { grey, full: f64::from(laser.full_scale()), hot, w, h };
    let blurred = picture.blurred();
    let (background, noise) = picture.surroundings(blurred.at);
    let top = blurred.best - background;
    if !(top > 0.0) {
        return Err(Fault::refused("no spot stands out")
            .cause("the pointer was off, the exposure far too short, or room light hides it")
            .next("take this picture again, or exclude it"));
    }
    let peak = picture.peak(blurred.at, background);
    let width = picture.width(blurred.at, background, peak, max_width_px);
    let rival = blurred.rival((6.0 * width).max(8.0), background) / top;
    let half = (4.5 * width + 3.0).ceil() as usize;
    let mut patch = picture.cut(blurred.at, half, noise);
    if let Some(ambient) = ambient {
        patch.lit_by(ambient);
    }
    let (x, y) = blurred.at;
    let shape = [x as f64, y as f64, peak.max(1.0).ln(), width.ln(), 0.0, 0.0, background];
    Ok(Brightest { patch, shape, rival })
}

struct Picture<'a> {
    grey: Vec<f64>,
    full: f64,
    /// See [`super::spot::hot_pixels`]; empty for a sensor without hot pixels.
    hot: &'a [bool],
    w: usize,
    h: usize,
}

/// Intensity summed over the 5x5 pixels around each position.
struct Blurred {
    light: Vec<f64>,
    w: usize,
    /// The largest value, and its position.
    best: f64,
    at: (usize, usize),
}

impl Picture<'_> {
    fn good(&self, k: usize) -> bool {
        !self.hot.get(k).copied().unwrap_or(false)
    }

    /// Ranges of columns and rows within `reach` of a position.
    fn window(&self, (x, y): (usize, usize), reach: usize) -> (Range<usize>, Range<usize>) {
        let (x1, y1) = ((x + reach + 1).min(self.w), (y + reach + 1).min(self.h));
        (x.saturating_sub(reach)..x1, y.saturating_sub(reach)..y1)
    }

    /// The bad pixels and the brightest pixel of each 5x5 are excluded, so that no single pixel can win.
    fn blurred(&self) -> Blurred {
        let (w, h) = (self.w, self.h);
        let mut out = Blurred { light: vec![0.0; w * h], w, best: 0.0, at: (0, 0) };
        for y in 2..h - 2 {
            for x in 2..w - 2 {
                let (mut sum, mut top, mut n) = (0.0, 0.0f64, 0.0);
                for j in y - 2..=y + 2 {
                    for i in x - 2..=x + 2 {
                        let k = j * w + i;
                        if self.good(k) {
                            sum += self.grey[k];
                            top = top.max(self.grey[k]);
                            n += 1.0;
                        }
                    }
                }
                let value = (sum - top) / f64::max(n - 1.0, 1.0);
                out.light[y * w + x] = value;
                if value > out.best {
                    (out.best, out.at) = (value, (x, y));
                }
            }
        }
        out
    }

    /// Median and noise of a ring around the spot, grey levels.
    fn surroundings(&self, (x, y): (usize, usize)) -> (f64, f64) {
        let mut ring = Vec::new();
        let (columns, rows) = self.window((x, y), 24);
        for j in rows {
            for i in columns.clone() {
                if i.abs_diff(x).max(j.abs_diff(y)) > 12 {
                    ring.push(self.grey[j * self.w + i]);
                }
            }
        }
        ring.sort_by(f64::total_cmp);
        let median = ring[ring.len() / 2];
        let mut off: Vec<f64> = ring.iter().map(|g| (g - median).abs()).collect();
        // Grey levels are integers: rounding alone has a sigma of 0.29.
        (median, crate::solve::robust_scale(&mut off, 1).max(0.29).hypot(0.29))
    }

    /// Intensity of the spot's brightest good pixel above the background, grey levels.
    fn peak(&self, at: (usize, usize), background: f64) -> f64 {
        let (columns, rows) = self.window(at, 2);
        let mut peak = 0.0f64;
        for y in rows {
            for k in columns.clone().map(|x| y * self.w + x).filter(|&k| self.good(k)) {
                peak = peak.max(self.grey[k] - background);
            }
        }
        peak
    }

    /// Start value of the width, from the area above half of the peak: 2 π ln 2 s² for a Gaussian.
    fn width(&self, at: (usize, usize), background: f64, peak: f64, most: f64) -> f64 {
        let (columns, rows) = self.window(at, (most * 2.0).ceil() as usize);
        let lit = |&k: &usize| self.grey[k] - background > 0.5 * peak && self.good(k);
        let area: usize = rows.map(|y| columns.clone().map(|x| y * self.w + x).filter(lit).count()).sum();
        (area as f64 / (std::f64::consts::TAU * std::f64::consts::LN_2)).sqrt().clamp(0.7, most)
    }

    /// The window around the spot, with the same reflectance everywhere.
    fn cut(&self, at: (usize, usize), half: usize, noise: f64) -> Patch {
        let (columns, rows) = self.window(at, half);
        let row = |y: usize| columns.clone().map(move |x| y * self.w + x);
        let places: Vec<usize> = rows.clone().flat_map(row).collect();
        Patch {
            x0: columns.start,
            y0: rows.start,
            width: columns.len(),
            grey: places.iter().map(|&k| self.grey[k]).collect(),
            good: places.iter().map(|&k| self.good(k)).collect(),
            reflectance: vec![1.0; places.len()],
            full: self.full,
            noise,
        }
    }
}

impl Blurred {
    /// Intensity of the brightest position more than `reach` px from the spot, above the background.
    fn rival(&self, reach: f64, background: f64) -> f64 {
        let mut best = 0.0f64;
        for (k, light) in self.light.iter().enumerate() {
            let (x, y) = (k % self.w, k / self.w);
            let d = (x as f64 - self.at.0 as f64).hypot(y as f64 - self.at.1 as f64);
            if d > reach {
                best = best.max(light - background);
            }
        }
        best
    }
}
