//! In: the region of a layer that shows a part. Out: its values with 254 steps, of which the missing ones do not count;
//! they are stored with the part's template and compared with what is found.
//! Frame and unit: pixels of the region, row-major; steps from 1 to 255 over the region's range, 0 for missing.

use crate::find::scene::{Kind, Layer};
use nalgebra::{Matrix3, Vector3};

/// Most values of a region, so that a template's file stays below 2 MB.
const MOST_VALUES: usize = 1 << 20;
/// Most halvings: a picture has at most 2^32 pixels.
const MOST_HALVINGS: u32 = 8;

/// The values of a part's region: grey levels, or heights above the plane through them.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Levels {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// How often the region was halved, because it has more than 2^20 pixels; usually 0.
    pub halved: u32,
    /// Row-major, 1 to 255 over the region's range, 0 where nothing counts; in files base64.
    #[serde(with = "text")]
    pub values: Vec<u8>,
}

impl Levels {
    /// The values of a region that was cut out of a layer; `None` where they are all missing or all alike.
    pub fn of(region: &Layer) -> Option<Levels> {
        let (mut layer, mut halved) = (region.clone(), 0);
        while layer.values.len() > MOST_VALUES {
            (layer, halved) = (layer.halved(), halved + 1);
        }
        if layer.kind == Kind::Height {
            level(&mut layer);
        }
        let seen = || layer.values.iter().filter(|v| !v.is_nan());
        let low = seen().copied().fold(f32::INFINITY, f32::min);
        let high = seen().copied().fold(f32::NEG_INFINITY, f32::max);
        let step = |v: &f32| if v.is_nan() { 0 } else { 1 + (254.0 * (v - low) / (high - low)).round() as u8 };
        (high > low).then(|| Levels {
            width: layer.width,
            height: layer.height,
            halved,
            values: layer.values.iter().map(step).collect(),
        })
    }

    /// The values as a layer; missing ones are missing there too.
    pub(in crate::find) fn layer(&self, kind: Kind) -> Layer {
        let value = |&v: &u8| if v == 0 { f32::NAN } else { f32::from(v) };
        Layer { kind, width: self.width, height: self.height, values: self.values.iter().map(value).collect() }
    }

    /// What a file may hold for a region of this size, in words where it holds something else.
    pub(super) fn check(&self, [w, h]: [u32; 2]) -> Result<(), String> {
        let size = |n: u32| (n as usize >> self.halved).max(1);
        if self.halved > MOST_HALVINGS || [self.width, self.height] != [w, h].map(size) {
            return Err(format!("levels of {}x{} for a region of {w}x{h} px", self.width, self.height));
        }
        if self.values.len() != self.width * self.height || self.values.len() > MOST_VALUES {
            return Err(format!("{} levels; allowed: {MOST_VALUES}, one a pixel", self.values.len()));
        }
        Ok(())
    }
}

/// Subtracts the plane of least squares, so that the range is the part's and not the tilt's.
fn level(layer: &mut Layer) {
    let (width, half) = (layer.width, [0.5 * layer.width as f64, 0.5 * layer.height as f64]);
    let row = |i: usize| Vector3::new(1.0, (i % width) as f64 - half[0], (i / width) as f64 - half[1]);
    let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
    for (i, v) in layer.values.iter().enumerate().filter(|(_, v)| !v.is_nan()) {
        a += row(i) * row(i).transpose();
        b += row(i) * f64::from(*v);
    }
    // Cells on a line have no plane; they keep their heights.
    let Some(inverse) = a.try_inverse() else { return };
    let plane = inverse * b;
    layer.values.iter_mut().enumerate().for_each(|(i, v)| *v -= plane.dot(&row(i)) as f32);
}

/// Bytes as base64.
mod text {
    use base64::prelude::{BASE64_STANDARD, Engine};
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(bytes: &[u8], out: S) -> Result<S::Ok, S::Error> {
        out.serialize_str(&BASE64_STANDARD.encode(bytes))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u8>, D::Error> {
        BASE64_STANDARD.decode(String::deserialize(from)?).map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(kind: Kind, width: usize, height: usize, f: impl Fn(usize, usize) -> f32) -> Layer {
        Layer::new(kind, width, height, (0..width * height).map(|i| f(i % width, i / width)).collect()).unwrap()
    }

    #[test]
    fn levels_span_the_range_and_missing_ones_do_not_count() {
        let grey = |x: usize, y: usize| if (x, y) == (1, 0) { f32::NAN } else { 100.0 + 10.0 * x as f32 };
        let levels = Levels::of(&layer(Kind::Intensity, 3, 2, grey)).unwrap();
        assert_eq!(levels.values, [1, 0, 255, 1, 128, 255]);
        let text = serde_json::to_string(&levels).unwrap();
        assert!(text.contains("\"AQD/AYD/\""), "{text}");
        assert_eq!(serde_json::from_str::<Levels>(&text).unwrap(), levels);
        assert!(Levels::of(&layer(Kind::Intensity, 3, 2, |_, _| 7.0)).is_none());
        assert!(levels.check([3, 2]).is_ok() && levels.check([2, 3]).is_err());
        assert!(Levels { halved: 40, ..levels }.check([3, 2]).is_err());
    }

    #[test]
    fn heights_lose_their_tilt_and_large_regions_are_halved() {
        let step = |x: usize, y: usize| 0.5 * x as f32 - 0.2 * y as f32 + if x >= 10 { 1.0 } else { 0.0 };
        let levels = Levels::of(&layer(Kind::Height, 20, 16, step)).unwrap();
        // Without its plane the step of 1 on a rise of 10 is the larger part of the range.
        assert!(i32::from(levels.values[10]) - i32::from(levels.values[9]) > 120, "{:?}", &levels.values[..20]);
        let large = Levels::of(&layer(Kind::Intensity, 1500, 1001, |x, _| x as f32)).unwrap();
        assert!(large.halved == 1 && (large.width, large.height) == (750, 500) && large.check([1500, 1001]).is_ok());
    }
}
