//! In: a picture, its lit pixels and their skeleton. Out: the skeleton with its ends carried to the edge of the surface.
//! Frame and unit: pixels; brightness is compared with the stripe's own, so no grey level is set here.

use crate::fault::{Fault, Result};
use crate::raster::{Image, Mask};

/// Thinning eats a lit streak from its ends as it does from its sides, so a skeleton stops short of the edge by half
/// of the streak's thickness. The edge itself is where a blurred step has half of its height: an end is carried on
/// while the picture there has at least `share` of the brightness at the end and was lit in the threshold.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LengthenParams {
    /// Most pixels added to one end, in stripe widths (sigma), 0..=6; 0 is off. Thinning eats about two.
    pub reach: f32,
    /// Share of the end's brightness, 0.2..=1; 0.5 is the physical edge, less reaches into the blur beyond it.
    pub share: f32,
}

impl Default for LengthenParams {
    fn default() -> Self {
        LengthenParams { reach: 2.5, share: 0.45 }
    }
}

impl LengthenParams {
    pub fn check(&self) -> Result<()> {
        if !(0.0..=6.0).contains(&self.reach) || !(0.2..=1.0).contains(&self.share) {
            return Err(Fault::usage(format!(
                "lengthen reach is {} and share is {}; they must be in 0..=6 widths and 0.2..=1",
                self.reach, self.share
            )));
        }
        Ok(())
    }
    /// Most pixels added to an end of a stripe this wide.
    pub fn pixels(&self, width_px: f32) -> i32 {
        (self.reach * width_px).round() as i32
    }
}

/// CPU twin.
pub fn twin(image: &Image, lit: &Mask, skeleton: &Mask, width_px: f32, p: &LengthenParams) -> Mask {
    let (w, h) = (image.width as i32, image.height as i32);
    let reach = p.pixels(width_px);
    let mut out = skeleton.clone();
    let words = skeleton.words_per_row();
    for (k, &word) in skeleton.words.iter().enumerate() {
        let mut bits = word;
        while bits != 0 {
            let x = 32 * (k % words) as i32 + bits.trailing_zeros() as i32;
            let y = (k / words) as i32;
            bits &= bits - 1;
            if x < 3 || y < 3 || x >= w - 3 || y >= h - 3 {
                continue;
            }
            let Some((ax, ay)) = outward(skeleton, x, y) else { continue };
            let limit = p.share * nine(image, x, y);
            for t in 1..=reach {
                let a = x + (t as f32 * ax + 0.5).floor() as i32;
                let b = y + (t as f32 * ay + 0.5).floor() as i32;
                let inside = a >= 1 && b >= 1 && a < w - 1 && b < h - 1;
                if !inside || !lit.get(a as u32, b as u32) || nine(image, a, b) < limit {
                    break;
                }
                out.set(a as u32, b as u32);
            }
        }
    }
    out
}

/// The direction off the end of a line, of unit length; `None` where the pixel is no end. An end has its one or two
/// neighbours on one side.
fn outward(skeleton: &Mask, x: i32, y: i32) -> Option<(f32, f32)> {
    let lit = |i: i32, j: i32| i32::from(skeleton.get((x + i) as u32, (y + j) as u32));
    let (mut n, mut sx, mut sy) = (0, 0, 0);
    for j in -1..=1 {
        for i in -1..=1 {
            let l = lit(i, j) * i32::from(i != 0 || j != 0);
            n += l;
            sx += l * i;
            sy += l * j;
        }
    }
    if n == 0 || n > 2 || (n == 2 && sx.abs() + sy.abs() < 2) {
        return None;
    }
    let (mut ax, mut ay) = (0i32, 0i32);
    for j in -3..=3 {
        for i in -3..=3 {
            let l = lit(i, j);
            ax -= l * i;
            ay -= l * j;
        }
    }
    let (ax, ay) = (ax as f32, ay as f32);
    let length = (ax * ax + ay * ay).sqrt();
    (length > 0.0).then(|| (ax / length, ay / length))
}

/// Sum of the 3x3 pixels around one.
fn nine(image: &Image, x: i32, y: i32) -> f32 {
    let mut sum = 0u32;
    for j in -1..=1 {
        for i in -1..=1 {
            sum += u32::from(image.get((x + i) as u32, (y + j) as u32));
        }
    }
    sum as f32
}
