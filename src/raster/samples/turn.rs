//! Turns samples upright as a file's orientation states: number 1 to 8 of TIFF's tag 274, which Exif uses too.

/// An orientation with its source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Orientation {
    pub number: u16,
    /// What states it, for messages.
    pub by: &'static str,
}

impl Orientation {
    /// A picture that is stored upright.
    pub const UPRIGHT: Orientation = Orientation::exif(1);

    pub const fn exif(number: u16) -> Orientation {
        Orientation { number, by: "tag 274" }
    }

    /// Whether the stored picture is a mirror image of the upright one.
    pub fn mirrors(self) -> bool {
        matches!(self.number, 2 | 4 | 5 | 7)
    }
}

/// Orientations that exchange width and height.
fn across(orientation: u16) -> bool {
    (5..=8).contains(&orientation)
}

/// Width and height of the upright picture.
pub(super) fn size(orientation: u16, [width, height]: [u32; 2]) -> [u32; 2] {
    if across(orientation) { [height, width] } else { [width, height] }
}

/// For each pixel of the upright picture, row by row, the number of the stored pixel.
pub(super) fn places(orientation: u16, stored: [u32; 2]) -> impl Iterator<Item = usize> {
    let [w, h] = stored.map(|v| v as usize);
    let [wide, high] = size(orientation, stored).map(|v| v as usize);
    (0..high).flat_map(move |y| (0..wide).map(move |x| (x, y))).map(move |(x, y)| {
        let (column, row) = match orientation {
            2 => (w - 1 - x, y),
            3 => (w - 1 - x, h - 1 - y),
            4 => (x, h - 1 - y),
            5 => (y, x),
            6 => (y, h - 1 - x),
            7 => (w - 1 - y, h - 1 - x),
            8 => (w - 1 - y, x),
            _ => (x, y),
        };
        row * w + column
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// TIFF 6.0, page 36: where the stored row 0 and column 0 lie in the upright picture.
    #[test]
    fn row_and_column_zero_lie_where_the_standard_says() {
        let stored = [3, 2];
        for (orientation, row, column) in [
            (1, "top", "left"),
            (2, "top", "right"),
            (3, "bottom", "right"),
            (4, "bottom", "left"),
            (5, "left", "top"),
            (6, "right", "top"),
            (7, "right", "bottom"),
            (8, "left", "bottom"),
        ] {
            let [w, h] = size(orientation, stored).map(|v| v as usize);
            let places: Vec<usize> = places(orientation, stored).collect();
            let side = |name: &str| -> Vec<usize> {
                match name {
                    "top" => places[..w].to_vec(),
                    "bottom" => places[w * (h - 1)..].to_vec(),
                    "left" => places.iter().step_by(w).copied().collect(),
                    _ => places.iter().skip(w - 1).step_by(w).copied().collect(),
                }
            };
            let sorted = |mut v: Vec<usize>| {
                v.sort_unstable();
                v
            };
            assert_eq!(sorted(side(row)), [0, 1, 2], "orientation {orientation}: row 0 at the {row}");
            assert_eq!(sorted(side(column)), [0, 3], "orientation {orientation}: column 0 at the {column}");
        }
    }
}
