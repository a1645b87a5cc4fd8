//! In: a few shots of a scan. Out: their appearance: levels, saturation, the area of their light compared with the
//! area that was searched.
//! Frame and unit: pixels; grey levels of the recording's depth.

use crate::camera::Intrinsics;
use crate::geometry::{Camera, Plane, Vec2};
use crate::raster::{Image, Pixels};
use crate::recording::odd::{Odd, odd};

/// Levels of a scan's pictures, from the shots 0, 1, 2, 4, 8, ...
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seen {
    /// Number of shots examined.
    pub pictures: u32,
    /// Median of the pictures' median levels.
    pub median_level: u16,
    /// Level of the brightest pixel in all of them.
    pub brightest_level: u16,
    /// Level of a saturated pixel, from the pictures' depth.
    pub full_scale: u16,
    /// Largest share of saturated pixels in a picture.
    pub saturated: f64,
    /// x0, y0, x1, y1 around all pixels closer to their picture's brightest level than to its median.
    pub light_px: Option<[u32; 4]>,
    /// x0, y0, x1, y1 around the pixels in which the laser plane lies within the working volume.
    pub looked_for_px: Option<[u32; 4]>,
    /// What the first picture seems to be instead of grey levels.
    #[serde(skip)]
    odd: Option<Odd>,
    #[serde(skip)]
    medians: Vec<u16>,
}

/// A picture whose brightest pixel is below this share of full scale counts as dark.
const DARK: f64 = 0.06;
/// A picture with more than this share of saturated pixels counts as white.
const WHITE: f64 = 0.2;

impl Seen {
    /// An empty collection; computes where the laser plane is visible at these depths, mm.
    pub fn new(camera: &Intrinsics, plane: &Plane<Camera>, depth_mm: [f64; 2]) -> Seen {
        const STEPS: u32 = 64;
        let at = |i: u32, side: u32| u32::min(i * side / STEPS, side - 1);
        let mut seen = Seen::default();
        for (i, j) in (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (i, j))) {
            let (x, y) = (at(i, camera.width), at(j, camera.height));
            let ray = camera.ray_from_pixel(&Vec2::new(f64::from(x), f64::from(y)));
            if ray.and_then(|r| r.meet(plane)).is_some_and(|p| (depth_mm[0]..=depth_mm[1]).contains(&p.z)) {
                widen(&mut seen.looked_for_px, x, y);
            }
        }
        seen
    }

    /// Examines a shot if its index is 0 or a power of two.
    pub fn look(&mut self, index: u32, image: &Image) {
        if index != 0 && !index.is_power_of_two() {
            return;
        }
        if self.pictures == 0 {
            self.odd = odd(image);
        }
        match &image.pixels {
            Pixels::U8(p) => self.levels(image, p),
            Pixels::U16(p) => self.levels(image, p),
        }
    }

    fn levels<T: Copy + Into<u16> + Ord>(&mut self, image: &Image, pixels: &[T]) {
        let counts = counts(image.full_scale(), pixels);
        let mut below = 0;
        let median = counts.iter().position(|&n| {
            below += n as usize;
            below * 2 >= pixels.len()
        });
        let median = median.unwrap_or(0) as u16;
        let brightest = counts.iter().rposition(|&n| n > 0).unwrap_or(0) as u16;
        self.medians.push(median);
        let middle = self.medians.len() / 2;
        self.median_level = *self.medians.select_nth_unstable(middle).1;
        self.pictures += 1;
        self.full_scale = image.full_scale();
        self.brightest_level = self.brightest_level.max(brightest);
        let saturated = f64::from(counts[usize::from(image.full_scale())]) / pixels.len().max(1) as f64;
        self.saturated = self.saturated.max(saturated);
        if brightest > median {
            let half = median + (brightest - median).div_ceil(2);
            for (y, row) in (0..).zip(pixels.chunks(image.width as usize)) {
                let lit = |p: &T| (*p).into() >= half;
                // Most rows have no light; their largest level is found many pixels at a time.
                if !row.iter().copied().reduce(T::max).is_some_and(|most| lit(&most)) {
                    continue;
                }
                if let (Some(a), Some(b)) = (row.iter().position(lit), row.iter().rposition(lit)) {
                    widen(&mut self.light_px, a as u32, y);
                    widen(&mut self.light_px, b as u32, y);
                }
            }
        }
    }

    /// The findings in one sentence.
    pub fn words(&self) -> String {
        let place = |b: Option<[u32; 4]>| {
            b.map_or("nowhere".into(), |[x0, y0, x1, y1]| format!("in columns {x0} to {x1}, rows {y0} to {y1}"))
        };
        format!(
            "in {} pictures the median level is {}, the brightest {} of {}, up to {:.1} % of the pixels are \
             saturated; the light lies {}, the laser plane is looked for {}",
            self.pictures,
            self.median_level,
            self.brightest_level,
            self.full_scale,
            100.0 * self.saturated,
            place(self.light_px),
            place(self.looked_for_px)
        )
    }

    /// Warnings if the levels end where those of a camera of fewer bits would, or seem to be no grey levels.
    pub fn remarks(&self) -> impl Iterator<Item = String> {
        self.shallow().into_iter().chain(self.odd.map(|odd| odd.words()))
    }

    fn shallow(&self) -> Option<String> {
        let most = (10..16).map(|bits| (1u16 << bits) - 1).find(|most| self.brightest_level <= *most)?;
        // Above three quarters the pictures reach the top of that depth; darker ones may be of any.
        let reached = u32::from(self.brightest_level) * 4 > u32::from(most) * 3;
        let deep = u32::from(self.full_scale) >= 16 * u32::from(most);
        (reached && deep).then(|| {
            format!(
                "no level exceeds {} of {}: if the camera has {} bits, state that as image.bits in meta.json (or with \
                 --raw), or the stripe counts as too faint",
                self.brightest_level,
                self.full_scale,
                most.count_ones()
            )
        })
    }

    /// Likely cause and next step if nothing was measured.
    pub fn why(&self) -> (&'static str, &'static str) {
        let full = f64::from(self.full_scale);
        let apart = match (self.light_px, self.looked_for_px) {
            (Some(a), Some(b)) => a[0] > b[2] || b[0] > a[2] || a[1] > b[3] || b[1] > a[3],
            _ => false,
        };
        if self.odd == Some(Odd::BytesExchanged) {
            (
                "the two bytes of each level seem to be exchanged: the file has the low byte first",
                "exchange them, or save the pictures as PNG or TIFF",
            )
        } else if f64::from(self.brightest_level) < DARK * full {
            (
                "the pictures are dark: the laser was off, or the exposure is far too short",
                "expose longer, or switch the laser on",
            )
        } else if self.saturated > WHITE {
            (
                "the pictures are white: room light or exposure is far too strong for a stripe to stand out",
                "expose shorter, or use a filter of the laser's colour",
            )
        } else if apart {
            (
                "the light is outside the part of the picture where the laser plane is expected",
                "compare working_volume in station.toml and the laser plane with the station; is the picture \
                 mirrored or turned?",
            )
        } else {
            (
                "the light does not form a stripe within the settings: too wide, too faint, or broken into spots",
                "look at the overlays, then at [extraction] in station.toml",
            )
        }
    }
}

/// The number of pixels of each level.
fn counts<T: Copy + Into<u16>>(full_scale: u16, pixels: &[T]) -> Vec<u32> {
    // Neighbours have mostly the same level, and an addition waits for the one before it in the same place. Four
    // tables in turns take 3.6 ms where one takes 9.5, in a dark picture of 4096x3072.
    let [mut a, mut b, mut c, mut d] = [(); 4].map(|()| vec![0u32; usize::from(full_scale) + 1]);
    let (fours, rest) = pixels.as_chunks::<4>();
    for &[w, x, y, z] in fours {
        a[usize::from(w.into())] += 1;
        b[usize::from(x.into())] += 1;
        c[usize::from(y.into())] += 1;
        d[usize::from(z.into())] += 1;
    }
    rest.iter().for_each(|&p| a[usize::from(p.into())] += 1);
    (0..a.len()).map(|i| a[i] + b[i] + c[i] + d[i]).collect()
}

fn widen(range: &mut Option<[u32; 4]>, x: u32, y: u32) {
    let [x0, y0, x1, y1] = range.unwrap_or([x, y, x, y]);
    *range = Some([x0.min(x), y0.min(y), x1.max(x), y1.max(y)]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_and_light_are_found_where_they_are() {
        let mut seen = Seen::default();
        let mut pixels = vec![10u16; 64 * 48];
        for x in 5..=50 {
            pixels[30 * 64 + x] = 900;
        }
        seen.look(3, &Image::from_u16(64, 48, 10, pixels.clone()));
        assert_eq!(seen.pictures, 0);
        seen.look(4, &Image::from_u16(64, 48, 10, pixels));
        assert_eq!((seen.median_level, seen.brightest_level, seen.full_scale), (10, 900, 1023));
        assert_eq!(seen.light_px, Some([5, 30, 50, 30]));
        let white = |level| {
            let mut seen = Seen::default();
            seen.look(0, &Image::from_u8(8, 8, vec![level; 64]));
            seen
        };
        assert!(white(255).why().0.contains("white") && white(3).why().0.contains("dark"));
        assert_eq!(white(255).light_px, None);
        // Twelve bits in a file of sixteen; a picture of sixteen that is dark, or bright.
        let remark = |bits, level| {
            let mut seen = Seen::default();
            seen.look(0, &Image::from_u16(8, 8, bits, vec![level; 64]));
            seen.shallow()
        };
        assert!(remark(16, 3900).unwrap().contains("12 bits"), "{:?}", remark(16, 3900));
        assert!([(16, 2500), (16, 20_000), (12, 1000), (10, 1000)].iter().all(|(b, l)| remark(*b, *l).is_none()));
    }
}
