//! In: a picture that a person made as a mask, the size of what it masks and the part's region there. Out: where
//! nothing counts.
//! Frame and unit: pixels of the template's picture.

use crate::fault::{Fault, Result};
use crate::raster::{Image, Mask};

/// Pixels of the picture in which nothing counts, from a mask as large as the picture or as its region. Where the mask
/// has transparent pixels (`clear`), these do not count and all opaque ones do. A mask without them counts where it is
/// white, at half of its full level and above.
///
/// # Errors
/// A mask of another size.
pub fn excluded(mask: &Image, clear: Option<&Mask>, size: [u32; 2], region: Option<[u32; 4]>) -> Result<Mask> {
    let [x0, y0, w, h] = region.unwrap_or([0, 0, size[0], size[1]]);
    let own = [mask.width, mask.height];
    let [dx, dy] = if own == size {
        [0, 0]
    } else if own == [w, h] {
        [x0, y0]
    } else {
        return Err(Fault::usage(format!(
            "the mask has {}x{} px, the picture {}x{} and its region {w}x{h}",
            own[0], own[1], size[0], size[1]
        ))
        .cause("a mask of another picture or of another region")
        .next("make the mask as large as the template's picture, or as its region"));
    };
    let half = mask.full_scale().div_ceil(2);
    let counts = |x: u32, y: u32| clear.map_or_else(|| mask.get(x, y) >= half, |clear| !clear.get(x, y));
    Ok(Mask::from_fn(size[0], size[1], |x, y| match (x.checked_sub(dx), y.checked_sub(dy)) {
        (Some(x), Some(y)) if x < own[0] && y < own[1] => !counts(x, y),
        _ => false,
    }))
}

/// What is excluded by either of two masks of the same size.
pub fn either(a: Option<Mask>, b: Option<Mask>) -> Option<Mask> {
    match (a, b) {
        (Some(mut a), Some(b)) => {
            a.words.iter_mut().zip(&b.words).for_each(|(a, b)| *a |= b);
            Some(a)
        }
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_counts_where_it_is_white_or_opaque() {
        let grey = Image::from_u8(3, 1, vec![0, 127, 128]);
        let whole = excluded(&grey, None, [3, 1], None).unwrap();
        assert_eq!([0, 1, 2].map(|x| whole.get(x, 0)), [true, true, false]);
        // Opaque black counts where transparency decides.
        let clear = Mask::from_fn(3, 1, |x, _| x == 2);
        let cut = excluded(&grey, Some(&clear), [3, 1], None).unwrap();
        assert_eq!([0, 1, 2].map(|x| cut.get(x, 0)), [false, false, true]);
        // As large as the region it lies there.
        let placed = excluded(&grey, None, [6, 4], Some([2, 3, 3, 1])).unwrap();
        let set: Vec<(u32, u32)> = (0..24).map(|i| (i % 6, i / 6)).filter(|&(x, y)| placed.get(x, y)).collect();
        assert_eq!(set, [(2, 3), (3, 3)]);
        let said = excluded(&grey, None, [6, 4], Some([0, 0, 2, 2])).unwrap_err().what;
        assert!(said.contains("3x1") && said.contains("6x4") && said.contains("2x2"), "{said}");
        let both = either(Some(whole), Some(cut)).unwrap();
        assert_eq!([0, 1, 2].map(|x| both.get(x, 0)), [true, true, true]);
    }
}
