//! In: a picture of a laser pointer's spot, the positions of bad pixels, and (on a board) the picture in room light.
//! Out: the spot's centre with covariance.
//! Frame and unit: px, grey levels (docs/math.md, Pointer (1), (2)).

use super::patch::{Brightest, Patch, Shape, locate, profile};
use crate::fault::{Fault, Result};
use crate::geometry::Vec2;
use crate::raster::Image;
use crate::solve::{End, LmOptions, Loss, Problem, Residuals, lm};
use nalgebra::Matrix2;

/// Settings of [`find_spots`].
#[derive(Clone, Debug)]
pub struct SpotOptions {
    /// Contrast of the laser's speckle per pixel; `None`: estimated from all spots together. 0.005..=1.
    pub speckle: Option<f64>,
    /// Smallest height of a spot's peak above its surroundings, in noise sigmas; 4..=100.
    pub min_snr: f64,
    /// Smallest sigma of a spot's profile, px; anything sharper than the lens is a bad pixel; 0.2..=5.
    pub min_width_px: f64,
    /// Largest sigma of a spot's profile, px; 1..=200.
    pub max_width_px: f64,
    /// A second spot with this share of the first one's intensity makes the choice ambiguous; 0.05..=1.
    pub rival: f64,
}

impl Default for SpotOptions {
    fn default() -> Self {
        SpotOptions { speckle: None, min_snr: 8.0, min_width_px: 0.45, max_width_px: 30.0, rival: 0.5 }
    }
}

impl SpotOptions {
    /// Refuses values outside the ranges stated at the fields.
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

/// The measured centre of a spot.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Centre, px.
    pub pixel: Vec2,
    /// Covariance of the centre, px².
    pub covariance: Matrix2<f64>,
    /// Sigma of the profile (geometric mean of the ellipse's axes), px.
    pub width_px: f64,
    /// Peak above the background, grey levels; above full scale if the spot saturates.
    pub amplitude: f64,
    /// Number of pixels of its window that are at full scale.
    pub saturated_pixels: usize,
    /// Intensity of the brightest other spot relative to this one.
    pub rival: f64,
}

/// Bad pixels: those whose median over the pictures of a recording is far brighter than the neighbours' medians. With
/// fewer than three pictures, no pixel counts as bad.
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
            // Brighter than nearly all neighbours by more than the local contrast of the scene.
            hot[y * w + x] = at(x, y) > high + 2.0 * (high - middle) + 0.015 * full;
        }
    }
    hot
}

struct SpotProblem<'a> {
    patch: &'a Patch,
    /// Sigma of each pixel, constant during one solve.
    sigma: Vec<f64>,
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
            // A saturated pixel states only a lower limit of the intensity; a black one only an upper limit.
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

/// A picture in which a spot is searched for.
#[derive(Clone, Copy)]
pub struct SpotPicture<'a> {
    /// Name in messages.
    pub name: &'a str,
    /// The picture with the laser on.
    pub laser: &'a Image,
    /// The same view in room light, if the spot lies on a printed board: the print modulates the spot's intensity.
    pub ambient: Option<&'a Image>,
}

/// Finds one spot in each picture. All pictures come from the same camera and laser and share the speckle contrast.
/// `hot` comes from [`hot_pixels`]; empty for a sensor without hot pixels.
pub fn find_spots(pictures: &[SpotPicture<'_>], hot: &[bool], o: &SpotOptions) -> Result<Vec<Result<Spot>>> {
    o.check()?;
    let mut speckle = o.speckle.unwrap_or(0.15);
    let mut found: Vec<Result<Brightest>> =
        pictures.iter().map(|p| locate(p.laser, p.ambient, hot, o.max_width_px)).collect();
    for _ in 0..if o.speckle.is_some() { 1 } else { 3 } {
        let mut scatter = Vec::new();
        for Brightest { patch, shape, .. } in found.iter_mut().flatten() {
            *shape = refine(patch, shape, speckle).0;
            collect_scatter(patch, shape, &mut scatter);
        }
        if o.speckle.is_none() && scatter.len() >= 10 {
            // The fit takes five degrees of freedom from the few bright pixels of each spot.
            let spots = found.iter().flatten().count() as f64;
            let n = scatter.len() as f64;
            let robust = crate::solve::robust_scale(&mut scatter, 1);
            speckle = (robust * (n / f64::max(n - 5.0 * spots, 0.3 * n)).sqrt()).clamp(0.005, 1.0);
        }
    }
    Ok(found.into_iter().map(|f| measured(&f?, speckle, o)).collect())
}

/// Measures the brightest spot; refuses a picture without a spot or with two similar ones.
fn measured(found: &Brightest, speckle: f64, o: &SpotOptions) -> Result<Spot> {
    let Brightest { patch, shape, rival } = found;
    let (s, covariance) = refine(patch, shape, speckle);
    let width = s[3].exp();
    let noise = patch.noise.hypot(0.0);
    let missing = |what: String| {
        Err(Fault::refused(what)
            .cause("the pointer was off, out of view, or drowned by room light")
            .next("take this picture again, or exclude it"))
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
    if *rival > o.rival {
        return Err(Fault::refused(format!(
            "two spots, the second with {:.0} % of the first one's light (limit {:.0} %)",
            rival * 100.0,
            o.rival * 100.0
        ))
        .cause("a glint or a second reflection of the beam")
        .next("cover the shiny place and take this picture again"));
    }
    // A centre with a sigma larger than the spot's width is no measurement: the fit diverged from the spot.
    let known = |c: &Matrix2<f64>| c.symmetric_eigenvalues().max().sqrt() <= width;
    let covariance = covariance.filter(known).ok_or_else(|| {
        Fault::refused("the spot's centre is not determined")
            .cause("an edge or a print cuts the spot, or it is drowned by other light")
            .next("take the picture again with a smaller or darker spot, or from another place")
    })?;
    let mut saturated = 0;
    patch.each(|i, _, _| saturated += usize::from(patch.grey[i] >= patch.full));
    Ok(Spot {
        pixel: Vec2::new(s[0], s[1]),
        covariance,
        width_px: width,
        amplitude: s[2].exp(),
        saturated_pixels: saturated,
        rival: *rival,
    })
}

fn refine(patch: &Patch, start: &Shape, speckle: f64) -> (Shape, Option<Matrix2<f64>>) {
    let mut shape = *start;
    let mut covariance = None;
    for _ in 0..4 {
        let problem = SpotProblem { patch, sigma: patch.sigmas(&shape, speckle) };
        let o = LmOptions { loss: Loss::Huber(2.5), max_iterations: 60, tolerance: 1e-10, ..LmOptions::default() };
        let Some((s, end)) = lm(&problem, shape, &o).ended() else { return (shape, None) };
        let step = Vec2::new(s.state[0] - shape[0], s.state[1] - shape[1]).norm();
        shape = s.state;
        covariance = s.covariance.filter(|_| end == End::Minimum).map(|c| {
            let scale = s.sigma0.max(1.0).powi(2);
            Matrix2::new(c[(0, 0)], c[(0, 1)], c[(1, 0)], c[(1, 1)]) * scale
        });
        if step < 1e-4 {
            break;
        }
    }
    (shape, covariance)
}

/// Collects |grey − model| / spot intensity of the pixels where the spot dominates. Their spread is the speckle
/// contrast.
fn collect_scatter(patch: &Patch, s: &Shape, out: &mut Vec<f64>) {
    patch.each(|i, x, y| {
        let light = patch.reflectance[i] * profile(s, x - s[0], y - s[1]).0;
        if light > (0.1 * s[2].exp()).max(10.0 * patch.noise) && patch.grey[i] < patch.full {
            out.push((patch.grey[i] - patch.model(s, i, x, y)).abs() / light);
        }
    });
}
