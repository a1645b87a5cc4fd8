//! In: a short text. Out: the text drawn into a colour picture in a 5x7 pixel font.
//! Frame and unit: pixels; a character cell is 6 x 9 times the scale.

use super::{Rgb, RgbImage};

/// Columns of the characters from space to tilde, five bytes each from left to right, lowest bit on top.
const GLYPHS: [u64; 95] = [
    0x0000000000,
    0x00005f0000,
    0x0007000700,
    0x147f147f14,
    0x242a7f2a12,
    0x2313086462,
    0x3649562050,
    0x0000070000,
    0x001c224100,
    0x0041221c00,
    0x2a1c7f1c2a,
    0x08083e0808,
    0x0080703000,
    0x0808080808,
    0x0060600000,
    0x2010080402,
    0x3e5149453e,
    0x00427f4000,
    0x7249494946,
    0x2141494d33,
    0x1814127f10,
    0x2745454539,
    0x3c4a494931,
    0x4121110907,
    0x3649494936,
    0x464949291e,
    0x0036360000,
    0x0040340000,
    0x0008142241,
    0x1414141414,
    0x4122140800,
    0x0201590906,
    0x3e415d594e,
    0x7c1211127c,
    0x7f49494936,
    0x3e41414122,
    0x7f4141413e,
    0x7f49494941,
    0x7f09090901,
    0x3e41415173,
    0x7f0808087f,
    0x00417f4100,
    0x2040413f01,
    0x7f08142241,
    0x7f40404040,
    0x7f021c027f,
    0x7f0408107f,
    0x3e4141413e,
    0x7f09090906,
    0x3e4151215e,
    0x7f09192946,
    0x2649494932,
    0x03017f0103,
    0x3f4040403f,
    0x1f2040201f,
    0x3f4038403f,
    0x6314081463,
    0x0304780403,
    0x6159494d43,
    0x007f414100,
    0x0204081020,
    0x0041417f00,
    0x0402010204,
    0x4040404040,
    0x0003070800,
    0x2054547840,
    0x7f28444438,
    0x3844444428,
    0x384444287f,
    0x3854545418,
    0x00087e0902,
    0x18a4a49c78,
    0x7f08040478,
    0x00447d4000,
    0x2040403d00,
    0x7f10284400,
    0x00417f4000,
    0x7c04780478,
    0x7c08040478,
    0x3844444438,
    0xfc18242418,
    0x18242418fc,
    0x7c08040408,
    0x4854545424,
    0x04043f4424,
    0x3c4040207c,
    0x1c2040201c,
    0x3c4030403c,
    0x4428102844,
    0x4c9090907c,
    0x4464544c44,
    0x0008364100,
    0x0000770000,
    0x0041360800,
    0x0201020402,
];
/// Further characters that units need.
const EXTRA: [(char, u64); 5] =
    [('±', 0x44445f4444), ('µ', 0xfc20201c20), ('°', 0x0006090906), ('²', 0x0012191612), ('×', 0x0028102800)];

fn glyph(c: char) -> u64 {
    let plain = (c as usize).checked_sub(32).and_then(|i| GLYPHS.get(i)).copied();
    plain.or_else(|| EXTRA.iter().find(|(e, _)| *e == c).map(|(_, g)| *g)).unwrap_or(GLYPHS[31])
}

/// Width of a text in pixels.
pub fn text_width(text: &str, scale: u32) -> i64 {
    text.chars().count() as i64 * 6 * i64::from(scale)
}

impl RgbImage {
    /// Draws `text` with its top left corner at (x, y); what lies outside the picture is cut off. Unknown characters
    /// appear as a question mark.
    pub fn text(&mut self, x: i64, y: i64, scale: u32, colour: Rgb, text: &str) {
        let s = i64::from(scale);
        for (i, c) in text.chars().enumerate() {
            let bits = glyph(c);
            for column in 0..5 {
                let byte = bits >> (8 * (4 - column)) & 0xff;
                for row in (0..8).filter(|row| byte >> row & 1 == 1) {
                    let (px, py) = (x + (6 * i as i64 + column as i64) * s, y + row as i64 * s);
                    self.fill(px, py, s, s, colour);
                }
            }
        }
    }

    /// Fills a rectangle; what lies outside the picture is cut off.
    pub fn fill(&mut self, x: i64, y: i64, width: i64, height: i64, colour: Rgb) {
        let within = |from: i64, length: i64, end: u32| {
            [from, from + length.max(0)].map(|at| at.clamp(0, i64::from(end)) as usize)
        };
        let ([left, right], [top, below]) = (within(x, width, self.width), within(y, height, self.height));
        for row in (top..below).map(|y| y * self.width as usize) {
            self.pixels[row + left..row + right].fill(colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The picture of a text, one character a pixel: a golden sample that a person can read.
    #[test]
    fn text_looks_like_text() {
        let mut picture = RgbImage::filled(18, 8, [0; 3]);
        picture.text(0, 0, 1, [255; 3], "1,µ");
        let rows: Vec<String> = picture
            .pixels
            .chunks(18)
            .map(|row| row.iter().map(|p| if p[0] > 0 { '#' } else { '.' }).collect())
            .collect();
        assert_eq!(rows[0], "..#...............");
        assert_eq!(rows[6], ".###....#...#.....");
        assert_eq!(text_width("1,µ", 2), 36);
    }
}
