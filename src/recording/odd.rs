//! In: a picture. Out: whether it seems to be a colour sensor's mosaic, or 16-bit numbers with exchanged bytes.
//! Frame and unit: px, grey levels.

use crate::raster::{Image, Pixels};

/// What a picture seems to be instead of grey levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Odd {
    /// Each pixel saw one colour: the pixels on one diagonal of each 2x2 square differ from those on the other. Half
    /// of that difference, as a share of the brightest of the four kinds.
    Mosaic(f64),
    /// The low byte of each number was written where the high one belongs.
    BytesExchanged,
}

/// A larger picture is judged by about this number of rows.
const ROWS: usize = 512;
/// Diagonals that differ by this share are those of a mosaic. A thin stripe along rows or columns makes rows or columns
/// differ, but not diagonals; one between them makes diagonals differ by less.
const MOSAIC: f64 = 0.12;
/// A 2x2 square is lit if its brightest pixel reaches this fraction of full scale: 1 in 16.
const LIT: u16 = 16;
/// Fewer lit squares decide nothing.
const FEWEST: u64 = 200;
/// Roughness is the mean difference of neighbours in a row as a share of the levels' scatter. Exchanged bytes make it
/// exceed the first limit, and exceed the roughness with the bytes in order by the second factor.
const ROUGH: f64 = 0.1;
const ROUGHER: f64 = 4.0;

impl Odd {
    /// The finding, its cause and the next step in a sentence.
    pub fn words(&self) -> String {
        match self {
            Odd::Mosaic(share) => format!(
                "pixels on the two diagonals of 2x2 squares differ by {:.0} %: the picture seems to be the mosaic of a \
                 colour sensor (Bayer), in which one pixel in two or four sees the laser. Save grey or full-colour \
                 pictures",
                100.0 * share
            ),
            Odd::BytesExchanged => "neighbouring pixels are unrelated, but not if the two bytes of each level are \
                                    exchanged: the file seems to have the low byte first, where its format has the \
                                    high one"
                .into(),
        }
    }
}

/// What a picture seems to be instead of grey levels; nothing for most pictures.
pub fn odd(image: &Image) -> Option<Odd> {
    match &image.pixels {
        Pixels::U8(p) => mosaic(p, image.width as usize, image.full_scale()),
        Pixels::U16(p) if exchanged(p, image.width as usize) => Some(Odd::BytesExchanged),
        Pixels::U16(p) => mosaic(p, image.width as usize, image.full_scale()),
    }
}

/// Compares the mean levels of the four kinds of pixels in lit 2x2 squares.
fn mosaic<T: Copy + Into<u16>>(pixels: &[T], width: usize, full_scale: u16) -> Option<Odd> {
    let (mut sums, mut count) = ([0u64; 4], 0u64);
    for rows in pixels.chunks_exact(2 * width).step_by(step(pixels.len() / width)) {
        let (upper, lower) = rows.split_at(width);
        for (a, b) in upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0) {
            let four = [a[0], a[1], b[0], b[1]].map(Into::into);
            if four.iter().any(|v| *v >= full_scale / LIT) {
                sums.iter_mut().zip(four).for_each(|(sum, v)| *sum += u64::from(v));
                count += 1;
            }
        }
    }
    let [a, b, c, d] = sums.map(|s| s as f64);
    let share = (a + d - b - c).abs() / (2.0 * a.max(b).max(c).max(d));
    (count >= FEWEST && share > MOSAIC).then_some(Odd::Mosaic(share))
}

fn step(rows: usize) -> usize {
    (rows / ROWS).max(1)
}

/// Whether neighbours are unrelated as the levels are, and related with their bytes exchanged.
fn exchanged(pixels: &[u16], width: usize) -> bool {
    let read = rough(pixels, width, |v| v);
    read > ROUGH && read > ROUGHER * rough(pixels, width, u16::swap_bytes)
}

/// Mean difference of neighbours in a row, as a share of the scatter of all levels.
fn rough(pixels: &[u16], width: usize, read: impl Fn(u16) -> u16) -> f64 {
    let (mut n, mut sum, mut squares, mut steps) = (0.0, 0.0, 0.0, 0.0);
    for row in pixels.chunks_exact(width).step_by(4 * step(pixels.len() / width)) {
        for two in row.windows(2) {
            let [a, b] = [two[0], two[1]].map(|v| f64::from(read(v)));
            (n, sum, squares, steps) = (n + 1.0, sum + a, squares + a * a, steps + (a - b).abs());
        }
    }
    let scatter = (squares / n - (sum / n).powi(2)).max(0.0).sqrt();
    steps / n / scatter
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene with shades, an edge and some noise: levels from `low` to `high`.
    fn scene(low: f64, high: f64) -> Vec<u16> {
        let level = |i: usize| {
            let (x, y) = ((i % 320) as f64, (i / 320) as f64);
            let edge = if x + 0.3 * y > 200.0 { 0.35 } else { 0.0 };
            let noise = 0.01 * ((i * 7919 % 101) as f64 / 101.0 - 0.5);
            low + (high - low) * (0.3 + 0.2 * (x / 60.0).sin() * (y / 45.0).cos() + edge + noise)
        };
        (0..320 * 240).map(|i| level(i) as u16).collect()
    }

    #[test]
    fn a_mosaic_is_told_from_a_grey_picture() {
        let colours = [0.6, 1.0, 1.0, 0.4];
        let kind = |i: usize| i % 320 % 2 + 2 * (i / 320 % 2);
        let grey = scene(5.0, 250.0);
        let bayer: Vec<u8> = grey.iter().enumerate().map(|(i, v)| (f64::from(*v) * colours[kind(i)]) as u8).collect();
        let grey: Vec<u8> = grey.iter().map(|v| *v as u8).collect();
        let odd = |pixels| odd(&Image::from_u8(320, 240, pixels));
        let Some(Odd::Mosaic(share)) = odd(bayer) else { panic!("no mosaic") };
        assert!((share - 0.5).abs() < 0.02, "{share}");
        assert_eq!(odd(grey), None);
        assert_eq!(
            odd((0..320 * 240).map(|i| if (i % 320 / 20 + i / 6400) % 2 == 0 { 30 } else { 220 }).collect()),
            None
        );
        // A stripe of 0.6 px, 1.4 px wide at half its height, along rows, columns and between; red light on a mosaic.
        for degrees in [0.0f64, 90.0, 1.0, 45.0, 44.0, 30.0, 63.4] {
            let (s, c) = degrees.to_radians().sin_cos();
            let across = |i: usize| ((i % 320) as f64 - 160.0) * s + ((i / 320) as f64 - 120.0) * c;
            let stripe = |i: usize| 5.0 + 200.0 * (-0.5 * (across(i) / 0.6).powi(2)).exp();
            let seen = (0..320 * 240).map(|i| stripe(i) as u8).collect();
            assert_eq!(odd(seen), None, "a stripe at {degrees} degrees");
            let wide = |i: usize| 200.0 * (-0.5 * (across(i) / 1.5).powi(2)).exp() * [1.0, 0.1, 0.1, 0.02][kind(i)];
            let mosaic = odd((0..320 * 240).map(|i| 3 + wide(i) as u8).collect());
            assert!(matches!(mosaic, Some(Odd::Mosaic(_))), "red light at {degrees} degrees");
        }
    }

    #[test]
    fn exchanged_bytes_are_told_from_deep_pictures_of_every_kind() {
        let odd = |bits, pixels| odd(&Image::from_u16(320, 240, bits, pixels));
        for (bits, most) in [(12, 4000.0), (16, 65_000.0), (10, 1000.0)] {
            let right = scene(most / 50.0, most);
            assert_eq!(odd(bits, right.clone()), None, "{bits}");
            let exchanged = right.iter().map(|v| v.swap_bytes()).collect();
            assert_eq!(odd(16, exchanged), Some(Odd::BytesExchanged), "{bits}");
        }
        // 8 and 10 bits at the top of 16, and noise alone.
        assert_eq!(odd(16, scene(5.0, 250.0).iter().map(|v| v << 8).collect()), None);
        assert_eq!(odd(16, scene(20.0, 1000.0).iter().map(|v| v << 6).collect()), None);
        assert_eq!(odd(16, (0..320 * 240u64).map(|i| (i * i % 65_521 % 4099) as u16).collect()), None);
    }
}
