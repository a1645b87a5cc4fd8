//! In: one picture taken with the laser off. Out: shots with that ambient light subtracted; a picture that cannot
//! have been taken with the shots' settings is refused. Frame and unit: grey levels at the shots' depth. The rule is
//! that of the stage `ambient`.

use super::Format;
use crate::fault::{Fault, Result};
use crate::raster::{Image, Pixels};

/// Grey levels (8 bits) by which a pixel of the ambient picture may exceed that of a shot. It allows for noise and
/// for a robot that moved under uneven room light.
const SPARE: u32 = 8;
/// Share of a shot's pixels that may be darker than the ambient picture by more than `SPARE`. With equal exposure
/// hardly any pixel is. Most are if the ambient picture was exposed for room light, and subtracting it would remove
/// the stripe.
const DARKER: f64 = 0.1;

/// Ambient light that is present in every shot.
#[derive(Clone, Debug)]
pub struct Ambient {
    /// One picture with the laser off, of the shots' size and depth; grey levels.
    pub image: Image,
}

impl Ambient {
    /// Refuses a picture whose size or depth differs from the shots'.
    pub fn new(image: Image, format: Format) -> Result<Ambient> {
        let is = Format { width: image.width, height: image.height, bits: image.bits };
        if is != format {
            let words = |f: Format| format!("{}x{} with {} bits", f.width, f.height, f.bits);
            return Err(Fault::input(format!("the ambient picture is {}, the shots are {}", words(is), words(format)))
                .cause("a picture of another camera or another setting")
                .next("take one picture with the laser off and nothing else changed"));
        }
        Ok(Ambient { image })
    }

    /// Refuses an ambient picture that is brighter than the shot over a large share of its pixels.
    pub fn suits(&self, shot: &Image, name: &str) -> Result<()> {
        let spare = SPARE << (shot.bits - 8);
        let darker = match (&self.image.pixels, &shot.pixels) {
            (Pixels::U8(a), Pixels::U8(s)) => darker(a, s, spare),
            (Pixels::U16(a), Pixels::U16(s)) => darker(a, s, spare),
            _ => shot.pixel_count(),
        };
        let share = darker as f64 / shot.pixel_count().max(1) as f64;
        if share > DARKER {
            return Err(Fault::input(format!(
                "the ambient picture is brighter than {name} by more than {spare} grey levels in {:.0} % of its \
                 pixels, \
                 limit {:.0} %",
                100.0 * share,
                100.0 * DARKER
            ))
            .cause("it was exposed for room light, not as the shots were; subtracted, it would eat the stripe")
            .next("take it with the shots' exposure, or scan without --ambient"));
        }
        Ok(())
    }
}

fn darker<T: Copy + Into<u32>>(ambient: &[T], shot: &[T], spare: u32) -> usize {
    ambient.iter().zip(shot).filter(|(a, s)| (**a).into() > (**s).into() + spare).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::stripe::ambient::without;

    #[test]
    fn what_does_not_fit_the_shots_is_refused() {
        let format = Format { width: 10, height: 10, bits: 8 };
        let flat = |v: u8| Image::from_u8(10, 10, vec![v; 100]);
        assert!(Ambient::new(Image::from_u8(10, 9, vec![0; 90]), format).unwrap_err().what.contains("10x9"));
        assert!(Ambient::new(Image::from_u16(10, 10, 12, vec![0; 100]), format).unwrap_err().what.contains("12 bits"));
        let a = Ambient::new(flat(30), format).unwrap();
        assert!(a.suits(&flat(22), "shot").is_ok());
        assert!(a.suits(&flat(21), "shot").unwrap_err().what.contains("100 %"));
        assert_eq!(without(&flat(50), &a.image), flat(20));
        assert_eq!((without(&flat(20), &a.image), without(&flat(255), &a.image)), (flat(0), flat(255)));
    }
}
