//! In: a recording's laser pictures and the sheet that they show. Out: that laser pictures are turned or mirrored
//! against the ambient pictures of their frames, if the sheet is seen only when they are turned back.
//! Frame and unit: px.

use crate::calibrate::laser_plane::solve::LaserPlaneFit;
use crate::calibrate::laser_plane::views::StripeView;
use crate::fault::{Fault, Result};
use crate::raster::{Image, Pixels};

/// A fit of the sheet to all pictures.
pub type Sheet = Result<(Vec<StripeView>, LaserPlaneFit)>;

/// Turning is looked for if less than two thirds of the pictures agree, and named if four fifths do so turned, and at
/// least three more than before.
const FEW: [usize; 2] = [2, 3];
const MOST: [usize; 2] = [4, 5];
const MORE: usize = 3;

/// How pictures may be turned without changing their size: columns reversed, rows reversed.
#[derive(Clone, Copy)]
pub struct Flip {
    columns: bool,
    rows: bool,
    words: &'static str,
}

const FLIPS: [Flip; 3] = [
    Flip { columns: true, rows: true, words: "turned by 180 degrees" },
    Flip { columns: true, rows: false, words: "mirrored left to right" },
    Flip { columns: false, rows: true, words: "mirrored top to bottom" },
];

impl Flip {
    /// The picture turned.
    pub fn of(self, image: &Image) -> Image {
        let pixels = match &image.pixels {
            Pixels::U8(p) => Pixels::U8(self.reversed(p, image.width)),
            Pixels::U16(p) => Pixels::U16(self.reversed(p, image.width)),
        };
        Image { pixels, ..*image }
    }

    fn reversed<T: Copy>(self, levels: &[T], width: u32) -> Vec<T> {
        let mut rows: Vec<Vec<T>> = levels.chunks(width.max(1) as usize).map(<[T]>::to_vec).collect();
        if self.columns {
            rows.iter_mut().for_each(|row| row.reverse());
        }
        if self.rows {
            rows.reverse();
        }
        rows.concat()
    }
}

fn used(sheet: &Sheet) -> Vec<bool> {
    sheet.as_ref().map_or_else(|_| Vec::new(), |(_, fit)| fit.views.iter().map(|v| v.used).collect())
}

fn count(used: &[bool]) -> usize {
    used.iter().filter(|u| **u).count()
}

/// The fault of laser pictures that are turned against their ambient ones. `images`: the laser's light as recorded,
/// `now`: their fit; `turned`: the laser's light in turned pictures; `fit`: the fit to other pictures.
///
/// # Errors
/// Pictures that cannot be read.
pub fn turned_against_ambient(
    images: &[Image],
    now: &Sheet,
    turned: &dyn Fn(Flip) -> Result<Vec<Image>>,
    fit: &dyn Fn(&[Image]) -> Sheet,
) -> Result<Option<Fault>> {
    let (all, before) = (images.len(), used(now));
    if count(&before) * FEW[1] >= all * FEW[0] {
        return Ok(None);
    }
    let enough = |then: usize| then * MOST[1] >= all * MOST[0] && then >= count(&before) + MORE;
    for flip in FLIPS {
        let other = turned(flip)?;
        let then = count(&used(&fit(&other)));
        if enough(then) {
            return Ok(Some(named(flip, "the laser pictures are", [count(&before), then, all])));
        }
        // Only the pictures that disagree may be turned.
        let kept = |i: usize| before.get(i).copied().unwrap_or(false);
        let mixed: Vec<Image> =
            other.into_iter().enumerate().map(|(i, o)| if kept(i) { images[i].clone() } else { o }).collect();
        let then = if count(&before) == 0 { 0 } else { count(&used(&fit(&mixed))) };
        if enough(then) {
            let part = format!("{} of {all} laser pictures are", all - count(&before));
            return Ok(Some(named(flip, &part, [count(&before), then, all])));
        }
    }
    Ok(None)
}

fn named(flip: Flip, which: &str, [before, then, all]: [usize; 3]) -> Fault {
    Fault::input(format!(
        "{which} {} against the ambient pictures of their frames: as recorded, {before} of {all} pictures agree on one \
         laser plane, turned back {then} do",
        flip.words
    ))
    .cause("the camera's flip settings changed between the two pictures, or a program turned one kind of them")
    .next("store both pictures of a frame as the sensor reads them out, and record or convert them again")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_change_places_only() {
        let image = Image::from_u8(3, 2, vec![1, 2, 3, 4, 5, 6]);
        let wanted = [[6, 5, 4, 3, 2, 1], [3, 2, 1, 6, 5, 4], [4, 5, 6, 1, 2, 3]];
        for (flip, wanted) in FLIPS.into_iter().zip(wanted) {
            assert_eq!(flip.of(&image), Image::from_u8(3, 2, wanted.to_vec()), "{}", flip.words);
            assert_eq!(flip.of(&flip.of(&image)), image);
        }
    }
}
