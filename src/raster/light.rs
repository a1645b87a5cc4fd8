//! In: a picture in which no stripe was found. Out: a description of its light for a message: levels, saturation,
//! position and shape of the brightest light.
//! Frame and unit: pixels, grey levels.

use super::Image;
use crate::fault::Fault;
use std::fmt;

/// A description of a picture's light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Darkest, median and brightest level.
    pub levels: [u16; 3],
    /// Grey level of saturation.
    pub full_scale: u16,
    /// Share of the pixels at the largest level.
    pub saturated: f64,
    /// The pixels brighter than midway between median and brightest; `None` where hardly anything stands out.
    pub bright: Option<Bright>,
}

/// Light that stands out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bright {
    /// Its middle, px, and its share of the picture.
    pub centre: [f64; 2],
    pub share: f64,
    /// A stripe along the rows or the columns; `None` if the light has no such shape.
    pub stripe: Option<Stripe>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stripe {
    pub upright: bool,
    pub thickness_px: f64,
    /// Distance from its middle to the nearest border that it runs along, px.
    pub to_border_px: f64,
}

/// Levels (of 255) by which light must stand out from the median to count.
const OUT: f64 = 10.0;
/// A stripe crosses more than this share of the rows or columns, and is more than this many times longer than thick.
const CROSSES: f64 = 0.3;
const SLENDER: f64 = 3.0;

/// A picture whose brightest pixel is below this share of full scale is dark.
const DARK: f64 = 0.06;
/// A picture is white if more than the first share of its pixels is saturated. It is also white if its median lies
/// above the second share of full scale and its darkest level above the third: black print on white paper is not white.
const WHITE: f64 = 0.2;
const BRIGHT: f64 = 0.9;
const NO_DARK: f64 = 0.5;

impl Light {
    /// Examines every pixel of a picture.
    pub fn of(image: &Image) -> Light {
        let full = image.full_scale();
        let mut counts = vec![0u64; usize::from(full) + 1];
        let at = |i: usize| image.get((i % image.width as usize) as u32, (i / image.width as usize) as u32);
        (0..image.pixel_count()).for_each(|i| counts[usize::from(at(i).min(full))] += 1);
        let all = image.pixel_count().max(1) as u64;
        let reached = |wanted: u64| {
            let mut sum = 0;
            let level = counts.iter().position(|n| {
                sum += n;
                sum > wanted
            });
            level.unwrap_or(0) as u16
        };
        let levels = [reached(0), reached(all / 2), reached(all - 1)];
        let stands_out = f64::from(levels[2] - levels[1]) > OUT / 255.0 * f64::from(full);
        Light {
            width: image.width,
            height: image.height,
            levels,
            full_scale: full,
            saturated: counts[usize::from(full)] as f64 / all as f64,
            bright: stands_out
                .then(|| Bright::of(image, (u32::from(levels[1]) + u32::from(levels[2])).div_ceil(2) as u16)),
        }
    }
}

impl Light {
    /// Likely cause and next step if the light is at fault: hardly any, or far too much. `None` otherwise.
    pub fn why(&self) -> Option<(&'static str, &'static str)> {
        let full = f64::from(self.full_scale);
        if f64::from(self.levels[2]) < DARK * full {
            let why = "the picture is dark: its light was off, the exposure far too short, or the lens is covered";
            return Some((why, "switch the light on, or expose longer"));
        }
        let washed_out = f64::from(self.levels[0]) > NO_DARK * full && f64::from(self.levels[1]) > BRIGHT * full;
        let white = self.saturated > WHITE || washed_out;
        let why = "the picture is white: room light or exposure is far too strong";
        white.then_some((why, "expose shorter, or shade it"))
    }

    /// Adds to a fault what the picture `name` shows; if its light is at fault, that becomes the cause.
    pub fn explain(&self, name: &str, mut fault: Fault) -> Fault {
        fault.what = format!("{}; {name}: {self}", fault.what);
        match self.why() {
            Some((cause, next)) => fault.cause(cause).next(next),
            None => fault,
        }
    }
}

impl Bright {
    fn of(image: &Image, limit: u16) -> Bright {
        let (w, h) = (image.width as usize, image.height as usize);
        let (mut columns, mut rows) = (vec![0u32; w], vec![0u32; h]);
        for y in 0..h {
            for x in (0..w).filter(|x| image.get(*x as u32, y as u32) >= limit) {
                columns[x] += 1;
                rows[y] += 1;
            }
        }
        let lit: u64 = rows.iter().map(|n| u64::from(*n)).sum();
        let middle = |counts: &[u32]| {
            counts.iter().enumerate().map(|(i, n)| i as f64 * f64::from(*n)).sum::<f64>() / lit.max(1) as f64
        };
        let centre = [middle(&columns), middle(&rows)];
        let crossed = |counts: &[u32]| counts.iter().filter(|n| **n > 0).count() as f64;
        let (along_x, along_y) = (crossed(&columns), crossed(&rows));
        // Upright if it crosses a larger share of the rows than of the columns.
        let upright = along_y / h as f64 > along_x / w as f64;
        let (length, size, centre_across, across) =
            if upright { (along_y, h, centre[0], w) } else { (along_x, w, centre[1], h) };
        let thickness_px = lit as f64 / length.max(1.0);
        let slender = length > CROSSES * size as f64 && length > SLENDER * thickness_px;
        let to_border_px = centre_across.min(across as f64 - 1.0 - centre_across);
        let stripe = slender.then_some(Stripe { upright, thickness_px, to_border_px });
        Bright { centre, share: lit as f64 / (w * h).max(1) as f64, stripe }
    }
}

impl fmt::Display for Light {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, middle, high] = self.levels;
        write!(
            f,
            "{}x{} px, levels {low} to {high} of {} (median {middle})",
            self.width, self.height, self.full_scale
        )?;
        if self.saturated > 0.0 {
            write!(f, ", {:.1} % saturated", 100.0 * self.saturated)?;
        }
        match self.bright {
            None => write!(f, "; nothing stands out"),
            Some(Bright { centre: [x, y], share, stripe: None }) => {
                write!(f, "; {:.1} % of it stands out, about ({x:.0}, {y:.0}), and is not a stripe", 100.0 * share)
            }
            Some(Bright { centre: [x, y], stripe: Some(s), .. }) => {
                let (way, place) = if s.upright { ("upright", x) } else { ("lying", y) };
                let line = if s.upright { "column" } else { "row" };
                write!(f, "; a stripe, {way}, {:.0} px thick, about {line} {place:.0}", s.thickness_px)?;
                let near = s.to_border_px < s.thickness_px.max(4.0);
                if near { write!(f, ", at the picture's border") } else { Ok(()) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(level: impl Fn(u32, u32) -> f64) -> String {
        let (w, h) = (320, 240);
        let pixels = (0..w * h).map(|i| level(i % w, i / w).clamp(0.0, 255.0) as u8).collect();
        Light::of(&Image::from_u8(w, h, pixels)).to_string()
    }

    #[test]
    fn every_sort_of_light_is_named() {
        let stripe =
            |at: f64, half: f64, top: f64| move |p: u32| if (f64::from(p) - at).abs() <= half { top } else { 3.0 };
        for (text, wants) in [
            (told(|_, _| 2.0), &["levels 2 to 2 of 255", "nothing stands out"][..]),
            (told(|_, _| 255.0), &["100.0 % saturated", "nothing stands out"]),
            (told(|x, y| f64::from((x * 7 + y * 13) % 6)), &["nothing stands out"]),
            (told(|_, y| stripe(120.0, 2.0, 200.0)(y)), &["lying, 5 px thick, about row 120"]),
            (
                told(|x, _| stripe(100.0, 30.0, 255.0)(x)),
                &["upright, 61 px thick, about column 100", "19.1 % saturated"],
            ),
            (told(|_, y| stripe(1.0, 1.0, 200.0)(y)), &["about row 1", "at the picture's border"]),
            (told(|x, y| if x < 100 && y < 100 { 200.0 } else { 3.0 }), &["is not a stripe", "(50, 50)"]),
        ] {
            assert!(wants.iter().all(|w| text.contains(w)), "{text} {wants:?}");
        }
        let flat = |level: u8| Light::of(&Image::from_u8(8, 8, vec![level; 64])).why().map(|(cause, _)| cause);
        assert!(flat(3).unwrap().contains("dark") && flat(255).unwrap().contains("white") && flat(120).is_none());
        let deep = Light::of(&Image::from_u16(4, 1, 12, vec![0, 5, 9, 4095])).to_string();
        assert!(deep.contains("of 4095") && deep.contains("25.0 % saturated"), "{deep}");
        assert!(Light::of(&Image::from_u8(1, 1, vec![9])).to_string().contains("1x1 px"));
    }
}
