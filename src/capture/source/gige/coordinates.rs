//! In: what a 3-D camera states about its coordinates (SFNC's 3D Scan Control), the bytes of its pictures. Out: its
//! profiles, one for each row. What is not stated or cannot be honoured is refused by the feature's name.
//! Frame and unit: the camera's own A (along the row) as x and C as z, mm; NaN where nothing was measured.

use crate::capture::feature::Value;
use crate::fault::{Fault, Result};

/// Features of a camera that can be read and selected.
pub trait Told {
    /// The present value of a feature; none if the camera does not have it.
    fn value(&mut self, name: &str) -> Option<Value>;
    /// Chooses an entry of a selector.
    ///
    /// # Errors
    /// The camera refuses it, or does not answer.
    fn choose(&mut self, name: &str, entry: &str) -> Result<()>;
}

/// A number of a coordinate in the bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Number {
    /// Whole, without sign, of this many bits, the lowest first; those of 10 and 12 bits have no gaps between them.
    Whole(u32),
    /// 32 bits, IEEE 754, little endian.
    Float,
}

impl Number {
    fn bits(self) -> usize {
        if let Number::Whole(bits) = self { bits as usize } else { 32 }
    }
}

/// How a coordinate's numbers become mm.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Scaled {
    /// mm to one.
    pub scale_mm: f64,
    /// Coordinate of the number 0, mm.
    pub offset_mm: f64,
    /// The number that means "not measured", before it is scaled; none if there is none.
    pub invalid: Option<f64>,
}

/// What a camera states about the coordinates that it sends.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Coordinates {
    /// Value of PixelFormat.
    pub pixel_format: String,
    /// Value of Scan3dOutputMode.
    pub output_mode: String,
    /// Coordinates A, B, C as the camera scales them; B only if it is sent.
    pub scaled: [Option<Scaled>; 3],
    /// Indices of the coordinates that a place has in the bytes, in their order.
    #[serde(skip)]
    sent: Vec<usize>,
    #[serde(skip)]
    number: Number,
}

const NAMES: [&str; 3] = ["CoordinateA", "CoordinateB", "CoordinateC"];
/// A profile lies in the plane B = 0. Beyond this distance from it, mm, a place does not.
const FLAT_MM: f64 = 1e-3;
const SET: &str = "set the camera in its maker's program or with sheetlight camera set, then look with sheetlight \
                   camera show";

/// Whether a pixel format holds coordinates.
pub fn is_coordinates(format: &str) -> bool {
    format.starts_with("Coord3D_")
}

/// Coordinates and numbers of a format: Coord3D_ with C, AC or ABC and 8, 10p, 12p, 16 or 32f.
fn layout(format: &str) -> Option<(Vec<usize>, Number)> {
    let rest = format.strip_prefix("Coord3D_")?;
    let (sent, numbers) = rest.split_at(rest.find(|c: char| c.is_ascii_digit())?);
    let sent = match sent {
        "C" => vec![2],
        "AC" => vec![0, 2],
        "ABC" => vec![0, 1, 2],
        _ => return None,
    };
    let number = match numbers {
        "8" => Number::Whole(8),
        "10p" => Number::Whole(10),
        "12p" => Number::Whole(12),
        "16" => Number::Whole(16),
        "32f" => Number::Float,
        _ => return None,
    };
    Some((sent, number))
}

fn refuse(name: &str, is: &str, cause: &str, next: &str) -> Fault {
    Fault::input(format!("{name} is {is}")).cause(cause).next(format!("{next}: {SET}"))
}

fn missing(name: &str) -> Fault {
    Fault::input(format!("the camera sends coordinates and has no {name}"))
        .cause("the feature is not in its description, or hidden by another setting")
        .next("update the camera's firmware, or export its profiles as files (docs/file-formats.md)")
}

fn word(camera: &mut dyn Told, name: &str) -> Result<String> {
    match camera.value(name) {
        Some(Value::Word(word)) => Ok(word),
        _ => Err(missing(name)),
    }
}

fn number(camera: &mut dyn Told, name: &str) -> Result<f64> {
    match camera.value(name) {
        Some(Value::Float(v)) => Some(v),
        Some(Value::Integer(v)) => Some(v as f64),
        _ => None,
    }
    .filter(|v| v.is_finite())
    .ok_or_else(|| missing(name))
}

impl Coordinates {
    /// Reads the camera's statements for this pixel format.
    ///
    /// # Errors
    /// A format, an output mode, a unit or a coordinate system that is not known; a feature that is missing.
    pub fn told(camera: &mut dyn Told, format: &str) -> Result<Coordinates> {
        let Some((sent, kind)) = layout(format) else {
            return Err(refuse(
                "PixelFormat",
                format,
                "read are Coord3D_C, _AC and _ABC of 8, 10p, 12p, 16 bits and 32f, not planar ones",
                "choose one of these",
            ));
        };
        let mode = word(camera, "Scan3dOutputMode")?;
        let fits = match sent.len() {
            1 => ["RectifiedC", "RectifiedC_Linescan"],
            2 => ["CalibratedAC", "CalibratedAC_Linescan"],
            _ => ["CalibratedABC_Grid", "CalibratedABC_PointCloud"],
        };
        if !fits.contains(&mode.as_str()) {
            let cause = match mode.as_str() {
                "UncalibratedC" => "its heights are no lengths",
                "CalibratedC" | "CalibratedC_Linescan" => "x of a place is not sent with its height",
                "DisparityC" | "DisparityC_Linescan" => "disparities are no lengths",
                _ => "another organisation of the coordinates than the pixel format's",
            };
            let next = format!("for {format} choose {}", fits.join(" or "));
            return Err(refuse("Scan3dOutputMode", &mode, cause, &next));
        }
        let unit = match word(camera, "Scan3dDistanceUnit")?.as_str() {
            "Millimeter" => 1.0,
            "Inch" => 25.4,
            other => {
                return Err(refuse(
                    "Scan3dDistanceUnit",
                    other,
                    "heights that are no lengths, or a unit that is not known here",
                    "choose Millimeter or Inch",
                ));
            }
        };
        for (name, wanted) in [("Scan3dCoordinateSystem", "Cartesian"), ("Scan3dCoordinateSystemReference", "Anchor")] {
            if let Some(is) = camera.value(name).map(|v| v.to_string()).filter(|is| is != wanted) {
                let cause = "coordinates that are turned or not along straight axes are no profile of one plane";
                return Err(refuse(name, &is, cause, &format!("choose {wanted}")));
            }
        }
        let mut scaled = [None; 3];
        for axis in 0..3 {
            // x of rectified heights is the column, scaled as coordinate A.
            if sent.contains(&axis) || axis == 0 {
                scaled[axis] = Some(Scaled::told(camera, axis, unit)?);
            }
        }
        Ok(Coordinates { pixel_format: format.to_owned(), output_mode: mode, scaled, sent, number: kind })
    }

    /// The profiles of a picture: for each row its places, x and z. `padding` is the number of bytes after each row.
    ///
    /// # Errors
    /// Too few bytes; a place that does not lie in the plane of the profile.
    pub fn profiles(&self, width: u32, height: u32, padding: usize, bytes: &[u8]) -> Result<Vec<Vec<[f64; 2]>>> {
        let (w, h) = (width as usize, height as usize);
        let (each, bits) = (self.sent.len(), self.number.bits());
        let row_bits = w * each * bits;
        // Without padding, packed numbers continue from row to row.
        let stride = if padding == 0 { row_bits } else { 8 * (row_bits.div_ceil(8) + padding) };
        let whole = (stride * h.saturating_sub(1) + row_bits).div_ceil(8);
        if bytes.len() < whole || w == 0 || h == 0 {
            return Err(Fault::input(format!(
                "a picture of {} bytes, {width}x{height} in {} has {whole}",
                bytes.len(),
                self.pixel_format
            ))
            .cause("the camera's size or format was changed while it runs")
            .next("stop, set the camera, start again"));
        }
        let place = |y: usize, x: usize| -> Result<[f64; 2]> {
            let mut at = [f64::NAN; 3];
            for (k, &axis) in self.sent.iter().enumerate() {
                at[axis] = self.coordinate(axis, raw(bytes, stride * y + (x * each + k) * bits, self.number));
            }
            let measured = self.sent.iter().all(|&axis| at[axis].is_finite());
            if self.sent.len() == 1 {
                at[0] = self.coordinate(0, x as f64);
            }
            if measured && at[1].abs() > FLAT_MM {
                return Err(Fault::input(format!("coordinate B is {:.4} mm in column {x}, row {y}", at[1]))
                    .cause("a camera that measures areas, or one that counts its travel into B")
                    .next("choose Scan3dOutputMode CalibratedAC or RectifiedC; areas are read by import-map"));
            }
            Ok(if measured { [at[0], at[2]] } else { [at[0], f64::NAN] })
        };
        (0..h).map(|y| (0..w).map(|x| place(y, x)).collect()).collect()
    }

    fn coordinate(&self, axis: usize, raw: f64) -> f64 {
        let Some(s) = &self.scaled[axis] else { return f64::NAN };
        // A column is no number of the camera's, and is never invalid.
        let column = axis == 0 && self.sent.len() == 1;
        let invalid = s
            .invalid
            .is_some_and(|v| !column && if self.number == Number::Float { v as f32 == raw as f32 } else { v == raw });
        if invalid { f64::NAN } else { s.scale_mm * raw + s.offset_mm }
    }
}

impl Scaled {
    fn told(camera: &mut dyn Told, axis: usize, unit: f64) -> Result<Scaled> {
        camera.value("Scan3dCoordinateSelector").ok_or_else(|| missing("Scan3dCoordinateSelector"))?;
        camera.choose("Scan3dCoordinateSelector", NAMES[axis]).map_err(|e| e.at(NAMES[axis]))?;
        let of = |e: Fault| e.at(NAMES[axis]);
        let scale = number(camera, "Scan3dCoordinateScale").map_err(of)?;
        let offset = number(camera, "Scan3dCoordinateOffset").map_err(of)?;
        if scale == 0.0 {
            return Err(of(refuse("Scan3dCoordinateScale", "0", "it was never set", "set a scale")));
        }
        // A camera without the flag marks nothing.
        let invalid = match camera.value("Scan3dInvalidDataFlag") {
            Some(Value::Boolean(true)) => Some(number(camera, "Scan3dInvalidDataValue").map_err(of)?),
            _ => None,
        };
        Ok(Scaled { scale_mm: unit * scale, offset_mm: unit * offset, invalid })
    }
}

/// The number that begins at a bit.
fn raw(bytes: &[u8], bit: usize, number: Number) -> f64 {
    let byte = |i: usize| u32::from(bytes.get(bit / 8 + i).copied().unwrap_or(0));
    let word = byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24;
    match number {
        Number::Float => f64::from(f32::from_bits(word)),
        Number::Whole(bits) => f64::from(word >> (bit % 8) & ((1 << bits) - 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// A camera that has these features; those of a coordinate follow its selector.
    #[derive(Clone)]
    struct Fake {
        features: BTreeMap<&'static str, Value>,
        of_axis: BTreeMap<(&'static str, &'static str), Value>,
        selected: String,
    }

    impl Told for Fake {
        fn value(&mut self, name: &str) -> Option<Value> {
            if name == "Scan3dCoordinateSelector" {
                return Some(Value::Word(self.selected.clone()));
            }
            let of = self.of_axis.iter().find(|((n, axis), _)| *n == name && *axis == self.selected);
            of.map(|(_, v)| v.clone()).or_else(|| self.features.get(name).cloned())
        }
        fn choose(&mut self, name: &str, entry: &str) -> Result<()> {
            assert_eq!(name, "Scan3dCoordinateSelector");
            self.selected = entry.to_owned();
            Ok(())
        }
    }

    fn camera(mode: &str) -> Fake {
        let word = |w: &str| Value::Word(w.to_owned());
        let features = [
            ("Scan3dOutputMode", word(mode)),
            ("Scan3dDistanceUnit", word("Millimeter")),
            ("Scan3dCoordinateSystem", word("Cartesian")),
            ("Scan3dInvalidDataFlag", Value::Boolean(true)),
        ];
        let mut of_axis = BTreeMap::new();
        for (axis, scale, offset, invalid) in
            [("CoordinateA", 0.05, -8.0, 0.0), ("CoordinateB", 1.0, 0.0, 0.0), ("CoordinateC", 0.02, 100.0, 0.0)]
        {
            of_axis.insert(("Scan3dCoordinateScale", axis), Value::Float(scale));
            of_axis.insert(("Scan3dCoordinateOffset", axis), Value::Float(offset));
            of_axis.insert(("Scan3dInvalidDataValue", axis), Value::Float(invalid));
        }
        Fake { features: features.into(), of_axis, selected: "CoordinateC".into() }
    }

    /// Compares with numbers that were computed by hand.
    fn same(is: &[Vec<[f64; 2]>], want: &[&[[f64; 2]]]) {
        assert_eq!(is.len(), want.len());
        for (is, want) in is.iter().zip(want) {
            assert_eq!(is.len(), want.len());
            for (p, q) in is.iter().zip(*want) {
                let one = |a: f64, b: f64| (a - b).abs() < 1e-9 || a.is_nan() && b.is_nan();
                assert!(one(p[0], q[0]) && one(p[1], q[1]), "{p:?} {q:?}");
            }
        }
    }

    const NAN: f64 = f64::NAN;

    #[test]
    fn rectified_heights_have_x_of_their_column() {
        let told = Coordinates::told(&mut camera("RectifiedC"), "Coord3D_C16").unwrap();
        // 0x0102 = 258: 100 + 0.02 * 258; 0xffff: 100 + 0.02 * 65535; 0: not measured. Two bytes after each row.
        let bytes = [0x02, 0x01, 0xff, 0xff, 9, 9, 0x00, 0x00, 0x01, 0x00, 9, 9];
        let is = told.profiles(2, 2, 2, &bytes).unwrap();
        same(&is, &[&[[-8.0, 105.16], [-7.95, 1410.7]], &[[-8.0, NAN], [-7.95, 100.02]]]);
        let told = Coordinates::told(&mut camera("RectifiedC_Linescan"), "Coord3D_C8").unwrap();
        same(&told.profiles(3, 1, 0, &[200, 0, 1]).unwrap(), &[&[[-8.0, 104.0], [-7.95, NAN], [-7.9, 100.02]]]);
        // 12 bits: 0x123 and 0xabc, the lowest bits first; the second row goes on within the third byte.
        let told = Coordinates::told(&mut camera("RectifiedC"), "Coord3D_C12p").unwrap();
        let bytes = [0x23, 0xc1, 0xab, 0x01, 0xf0, 0xff];
        let want = |n: f64| 100.0 + 0.02 * n;
        let is = told.profiles(2, 2, 0, &bytes).unwrap();
        same(&is, &[&[[-8.0, want(291.0)], [-7.95, want(2748.0)]], &[[-8.0, want(1.0)], [-7.95, want(4095.0)]]]);
        // 10 bits, one in a row: 0x3ff, then 0x155 from bit 10 on.
        let told = Coordinates::told(&mut camera("RectifiedC"), "Coord3D_C10p").unwrap();
        same(&told.profiles(1, 2, 0, &[0xff, 0x57, 0x05]).unwrap(), &[&[[-8.0, want(1023.0)]], &[[-8.0, want(341.0)]]]);
        assert!(told.profiles(2, 2, 0, &[0; 4]).unwrap_err().what.contains("has 5"));
    }

    #[test]
    fn sent_coordinates_are_scaled_each_by_its_own() {
        let told = Coordinates::told(&mut camera("CalibratedAC"), "Coord3D_AC16").unwrap();
        // A = 100: -8 + 5; C = 50: 100 + 1. Then A = 0, which is invalid.
        let is = told.profiles(2, 1, 0, &[100, 0, 50, 0, 0, 0, 50, 0]).unwrap();
        same(&is, &[&[[-3.0, 101.0], [NAN, NAN]]]);
        let told = Coordinates::told(&mut camera("CalibratedAC_Linescan"), "Coord3D_AC8").unwrap();
        same(&told.profiles(1, 1, 0, &[100, 50]).unwrap(), &[&[[-3.0, 101.0]]]);
        // Floats in inches: A = 2.5, C = -1.25; invalid is -1000; a NaN is never measured.
        let mut inches = camera("CalibratedAC");
        inches.features.insert("Scan3dDistanceUnit", Value::Word("Inch".into()));
        for axis in ["CoordinateA", "CoordinateC"] {
            inches.of_axis.insert(("Scan3dCoordinateScale", axis), Value::Float(1.0));
            inches.of_axis.insert(("Scan3dCoordinateOffset", axis), Value::Integer(0));
            inches.of_axis.insert(("Scan3dInvalidDataValue", axis), Value::Float(-1000.0));
        }
        let told = Coordinates::told(&mut inches, "Coord3D_AC32f").unwrap();
        let floats = [2.5f32, -1.25, 2.5, -1000.0, 2.5, f32::NAN];
        let bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
        assert_eq!(bytes[..8], [0x00, 0x00, 0x20, 0x40, 0x00, 0x00, 0xa0, 0xbf], "IEEE 754");
        same(&told.profiles(3, 1, 0, &bytes).unwrap(), &[&[[63.5, -31.75], [63.5, NAN], [63.5, NAN]]]);
    }

    #[test]
    fn a_place_beside_the_plane_is_refused() {
        let told = Coordinates::told(&mut camera("CalibratedABC_PointCloud"), "Coord3D_ABC16").unwrap();
        // B = 0 is the invalid number here: nothing is measured. Without a flag it is the plane.
        same(&told.profiles(1, 1, 0, &[100, 0, 0, 0, 50, 0]).unwrap(), &[&[[-3.0, NAN]]]);
        let mut plain = camera("CalibratedABC_Grid");
        plain.features.insert("Scan3dInvalidDataFlag", Value::Boolean(false));
        let told = Coordinates::told(&mut plain, "Coord3D_ABC16").unwrap();
        same(&told.profiles(1, 1, 0, &[100, 0, 0, 0, 50, 0]).unwrap(), &[&[[-3.0, 101.0]]]);
        let beside = told.profiles(1, 1, 0, &[100, 0, 3, 0, 50, 0]).unwrap_err();
        assert!(beside.what.contains("coordinate B is 3.0000 mm"), "{beside}");
        let told = Coordinates::told(&mut plain, "Coord3D_ABC32f").unwrap();
        let bytes: Vec<u8> = [20.0f32, 0.0, 5.0].iter().flat_map(|f| f.to_le_bytes()).collect();
        same(&told.profiles(1, 1, 0, &bytes).unwrap(), &[&[[-7.0, 100.1]]]);
    }

    #[test]
    fn what_is_not_stated_or_not_known_is_refused_by_its_name() {
        let said = |change: &dyn Fn(&mut Fake), mode: &str, format: &str| {
            let mut camera = camera(mode);
            change(&mut camera);
            Coordinates::told(&mut camera, format).unwrap_err().to_string()
        };
        let none = |_: &mut Fake| {};
        for (mode, format, says) in [
            ("UncalibratedC", "Coord3D_C16", "Scan3dOutputMode is UncalibratedC"),
            ("CalibratedC", "Coord3D_C16", "Scan3dOutputMode is CalibratedC"),
            ("CalibratedAC", "Coord3D_C16", "choose RectifiedC or RectifiedC_Linescan"),
            ("CalibratedAC", "Coord3D_AC16_Planar", "PixelFormat is Coord3D_AC16_Planar"),
            ("CalibratedAC", "Coord3D_A16", "PixelFormat is Coord3D_A16"),
        ] {
            let s = said(&none, mode, format);
            assert!(s.contains(says), "{s}");
        }
        for name in ["Scan3dOutputMode", "Scan3dDistanceUnit"] {
            let s = said(&|c| drop(c.features.remove(name)), "RectifiedC", "Coord3D_C16");
            assert!(s.contains(&format!("has no {name}")), "{s}");
        }
        for name in ["Scan3dCoordinateScale", "Scan3dCoordinateOffset", "Scan3dInvalidDataValue"] {
            let s = said(&|c| drop(c.of_axis.remove(&(name, "CoordinateC"))), "RectifiedC", "Coord3D_C16");
            assert!(s.contains(&format!("has no {name}")) && s.contains("CoordinateC"), "{s}");
        }
        for (name, is) in [
            ("Scan3dDistanceUnit", "Pixel"),
            ("Scan3dCoordinateSystem", "Spherical"),
            ("Scan3dCoordinateSystemReference", "Transformed"),
        ] {
            let set = |c: &mut Fake| drop(c.features.insert(name, Value::Word(is.into())));
            let s = said(&set, "RectifiedC", "Coord3D_C16");
            assert!(s.contains(&format!("{name} is {is}")), "{s}");
        }
    }
}
