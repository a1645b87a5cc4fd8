//! In: several pictures of one camera. Out: its hot pixels, which are bright in all of them whatever the scene.
//! Frame and unit: px; grey levels of the pictures' depth.

use super::{Image, Pixels};
use rayon::prelude::*;

/// Pixels that are bright in every picture while their neighbours are not. On the flank of a wide stripe, a hot pixel
/// moves the centre of two dozen lines by a tenth of a pixel, in every shot of a flat surface. Sorted by rows from the
/// top, each from the left.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct HotPixels(Vec<[u32; 2]>);

/// Least number of pictures that distinguishes a hot pixel from a glint, and the share of them, in quarters, in which
/// it must stand out: in the others a stripe may lie on it.
const PICTURES: usize = 3;
const QUARTERS: usize = 3;
/// How far a pixel must stand out from its neighbours: standard deviations of a dark pixel, share of full scale.
const SIGMAS: f32 = 8.0;
const SHARE: f32 = 0.02;
/// No sensor has more hot pixels than this, per million: the scene is then not a stripe in the dark.
const MOST: usize = 10_000;

impl HotPixels {
    /// The hot pixels of pictures whose dark pixels scatter by `noise` grey levels of an 8-bit picture. Empty for fewer
    /// than three pictures: in a single one, a speck of light on the part looks the same. `span`: light at full scale
    /// of the pictures over that of one exposure ([`super::Levels::span`]), 1 for pictures of one exposure.
    pub fn find(pictures: &[&Image], noise: f32, span: f32) -> HotPixels {
        let Some((first, others)) = pictures.split_first() else { return HotPixels::default() };
        if pictures.len() < PICTURES {
            return HotPixels::default();
        }
        let over = over(first, noise, span);
        // Candidates come from two pictures: a stripe that covers a hot pixel in one may leave it free in the other.
        let mut found = standing_out(first, over);
        found.extend(standing_out(others[others.len() - 1], over));
        found.sort_unstable_by_key(|[x, y]| (*y, *x));
        found.dedup();
        let needed = (QUARTERS * pictures.len()).div_ceil(4);
        found.retain(|p| pictures.iter().filter(|i| stands_out(i, *p, over)).count() >= needed);
        HotPixels(few_enough(found, first.pixel_count()))
    }

    /// The hot pixels of many pictures that are examined one by one; `each` holds the result of [`HotPixels::may_be`]
    /// for each.
    pub fn of_all(each: &[Vec<[u32; 2]>], pixel_count: usize) -> HotPixels {
        if each.len() < PICTURES {
            return HotPixels::default();
        }
        let mut all: Vec<[u32; 2]> = each.concat();
        all.sort_unstable_by_key(|[x, y]| (*y, *x));
        let needed = (QUARTERS * each.len()).div_ceil(4);
        let found = all.chunk_by(|a, b| a == b).filter(|same| same.len() >= needed).map(|same| same[0]).collect();
        HotPixels(few_enough(found, pixel_count))
    }

    /// The pixels of one picture that stand out: hot pixels, and specks of light.
    pub fn may_be(image: &Image) -> Vec<[u32; 2]> {
        standing_out(image, over(image, 0.0, 1.0))
    }

    /// The hot pixels of a stored list, in any order.
    pub fn stored(places: &[[u32; 2]]) -> HotPixels {
        let mut places = places.to_vec();
        places.sort_unstable_by_key(|[x, y]| (*y, *x));
        places.dedup();
        HotPixels(places)
    }

    /// Columns and rows, px; sorted by rows from the top, each from the left.
    pub fn places(&self) -> &[[u32; 2]] {
        &self.0
    }

    /// Number of hot pixels.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Replaces each hot pixel by the mean of its two neighbours along the stripe, or by one of them if the other is
    /// hot. Pixels at the border or beyond it are skipped. `along`: the step to the next pixel of the stripe, columns
    /// and rows, 0 or 1 each.
    pub fn fill(&self, image: &mut Image, [dx, dy]: [u32; 2]) {
        let (w, h) = (image.width, image.height);
        for &[x, y] in &self.0 {
            if x == 0 || y == 0 || x + 1 >= w || y + 1 >= h {
                continue;
            }
            let beside = [[x - dx, y - dy], [x + dx, y + dy]];
            let good = |p: &[u32; 2]| self.0.binary_search_by_key(&(p[1], p[0]), |q| (q[1], q[0])).is_err();
            let level = |p: &[u32; 2]| u32::from(image.get(p[0], p[1]));
            let levels: Vec<u32> = beside.iter().filter(|p| good(p)).map(level).collect();
            // Both are hot: the pixel's own level is no worse than theirs.
            let Some(mean) = levels.iter().sum::<u32>().checked_div(levels.len() as u32) else { continue };
            let i = (y * w + x) as usize;
            match &mut image.pixels {
                Pixels::U8(p) => p[i] = mean as u8,
                Pixels::U16(p) => p[i] = mean as u16,
            }
        }
    }
}

/// Grey levels by which a hot pixel stands out where dark pixels scatter by `noise` levels of an 8-bit picture.
fn over(image: &Image, noise: f32, span: f32) -> u32 {
    let full = f32::from(image.full_scale()) / span;
    (SHARE * full).max(SIGMAS * noise * full / 255.0).ceil() as u32
}

/// The list, or an empty one if it has too many pixels for a sensor.
fn few_enough(found: Vec<[u32; 2]>, pixel_count: usize) -> Vec<[u32; 2]> {
    if found.len() > MOST * pixel_count / 1_000_000 { Vec::new() } else { found }
}

/// All pixels of a picture that stand out.
fn standing_out(image: &Image, over: u32) -> Vec<[u32; 2]> {
    let (w, h) = (image.width, image.height);
    if w < 3 || h < 3 {
        return Vec::new();
    }
    let of_row = |y: u32| {
        let row = (y * w) as usize..((y + 1) * w) as usize;
        let columns: Vec<u32> = match &image.pixels {
            Pixels::U8(p) => reaching(&p[row], over),
            Pixels::U16(p) => reaching(&p[row], over),
        };
        columns.into_iter().map(move |x| [x, y]).filter(|p| stands_out(image, *p, over)).collect::<Vec<_>>()
    };
    (1..h - 1).into_par_iter().with_min_len(64).flat_map_iter(of_row).collect()
}

/// Columns inside a row whose level is `over` or more. The largest level of a row is found many pixels at a time, and
/// most rows have no light.
fn reaching<T: Copy + Into<u32> + Ord>(row: &[T], over: u32) -> Vec<u32> {
    if row.iter().copied().reduce(T::max).is_none_or(|most| most.into() < over) {
        return Vec::new();
    }
    (1..row.len() - 1).filter(|&x| row[x].into() >= over).map(|x| x as u32).collect()
}

/// True for a pixel that exceeds all its neighbours but one by `over` (hot pixels come in pairs). Its height above the
/// darkest neighbour must also be more than twice theirs: a grain of speckle has others beside it.
fn stands_out(image: &Image, [x, y]: [u32; 2], over: u32) -> bool {
    let here = u32::from(image.get(x, y));
    let (mut dark, mut first, mut second) = (u32::MAX, 0, 0);
    for (dx, dy) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
        let level = u32::from(image.get(x + dx - 1, y + dy - 1));
        dark = dark.min(level);
        if level > first {
            (first, second) = (level, first);
        } else {
            second = second.max(level);
        }
    }
    here >= second + over && here - dark > 2 * (second - dark)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    /// A stripe that moves over a noisy sensor with hot pixels: some lie on its path, two lie side by side.
    fn pictures(hot: &[[u32; 2]], along: [u32; 2]) -> Vec<Image> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        (0..8)
            .map(|k| {
                let level = |x: u32, y: u32| {
                    let across = if along == [1, 0] { y } else { x };
                    let d = f64::from(across) - 20.0 - 2.0 * f64::from(k);
                    let light = 180.0 * (-0.5 * (d / 3.0).powi(2)).exp() * rng.random_range(0.7..1.3);
                    let own = if hot.contains(&[x, y]) { 90.0 } else { 0.0 };
                    (light + own + rng.random_range(0.0..6.0)).min(255.0) as u8
                };
                let pixels = (0..64 * 48).map(|i| (i % 64, i / 64)).map({
                    let mut level = level;
                    move |(x, y)| level(x, y)
                });
                Image::from_u8(64, 48, pixels.collect())
            })
            .collect()
    }

    #[test]
    fn pixels_that_shine_by_themselves_are_found_and_the_stripe_is_not() {
        for along in [[1, 0], [0, 1]] {
            let hot = [[5, 40], [40, 5], [41, 5], [50, 28], [28, 44]];
            let seen = pictures(&hot, along);
            let all: Vec<&Image> = seen.iter().collect();
            let found = HotPixels::find(&all, 2.0, 1.0);
            assert!([[5, 40], [40, 5], [41, 5]].iter().all(|p| found.0.contains(p)), "{found:?}");
            assert!(found.0.iter().all(|p| hot.contains(p)), "{found:?}");
            let mut image = seen[0].clone();
            found.fill(&mut image, along);
            assert!([[5, 40], [40, 5], [41, 5]].iter().all(|p| image.get(p[0], p[1]) < 8));
            assert!(HotPixels::find(&all[..2], 2.0, 1.0).0.is_empty(), "two pictures tell nothing");
            let none = pictures(&[], along);
            assert!(HotPixels::find(&none.iter().collect::<Vec<_>>(), 2.0, 1.0).0.is_empty());
        }
    }
}
