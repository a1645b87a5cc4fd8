//! Reads single fields out of the records of a binary or text file.

use crate::fault::Fault;

/// Number types of record fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    pub fn bytes(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::I64 | Number::U64 | Number::F64 => 8,
        }
    }

    /// Reads the number at the beginning of `bytes`, which must hold at least its size.
    pub fn read(self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut b = [0; 8];
        let n = self.bytes();
        b[..n].copy_from_slice(&bytes[..n]);
        if big_endian {
            b[..n].reverse();
        }
        let [b0, b1, b2, b3, ..] = b;
        match self {
            Number::I8 => f64::from(b0 as i8),
            Number::U8 => f64::from(b0),
            Number::I16 => f64::from(i16::from_le_bytes([b0, b1])),
            Number::U16 => f64::from(u16::from_le_bytes([b0, b1])),
            Number::I32 => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
            Number::U32 => f64::from(u32::from_le_bytes([b0, b1, b2, b3])),
            Number::I64 => i64::from_le_bytes(b) as f64,
            Number::U64 => u64::from_le_bytes(b) as f64,
            Number::F32 => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
            Number::F64 => f64::from_le_bytes(b),
        }
    }
}

/// Indices of x, y, z and the intensity among a record's fields.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    pub xyz: [usize; 3],
    pub light: Option<usize>,
}

impl Wanted {
    /// Refuses names without a coordinate, and one that is there twice. An exact name is preferred; otherwise the case
    /// of letters is ignored.
    pub fn among<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Result<Wanted, String> {
        let at = |name: &str| {
            let places = |same: &dyn Fn(&str) -> bool| -> Vec<usize> {
                names.clone().enumerate().filter(|(_, n)| same(n)).map(|(k, _)| k).collect()
            };
            let exact = places(&|n| n == name);
            let found = if exact.is_empty() { places(&|n| n.eq_ignore_ascii_case(name)) } else { exact };
            match found[..] {
                [] => Ok(None),
                [k] => Ok(Some(k)),
                _ => Err(format!("{} of its fields are called {name}", found.len())),
            }
        };
        let needed = |name: &str| at(name)?.ok_or_else(|| "x, y or z is missing".to_owned());
        Ok(Wanted { xyz: [needed("x")?, needed("y")?, needed("z")?], light: at("intensity")? })
    }
}

/// The error for a file that holds more points than its header counts.
pub(super) fn surplus(there: usize, counted: usize) -> Fault {
    Fault::input(format!("holds {there} points or more, its header counts {counted}"))
        .cause("points were appended, or the header was copied from another file")
        .next("correct the number in the header, or export the cloud again")
}

/// Points collected while records are read.
#[derive(Debug, Default)]
pub(super) struct Points {
    pub points: Vec<[f64; 3]>,
    pub light: Vec<f32>,
}

impl Points {
    pub fn take(&mut self, wanted: &Wanted, field: impl Fn(usize) -> f64) {
        self.points.push(wanted.xyz.map(&field));
        self.light.extend(wanted.light.map(|k| field(k) as f32));
    }

    /// Takes the fields of a text record; false if one is missing or is no number.
    pub fn take_text(&mut self, wanted: &Wanted, record: &[&str]) -> bool {
        let number = |k: usize| record.get(k).and_then(|t| t.parse::<f64>().ok());
        let needed = wanted.xyz.into_iter().chain(wanted.light);
        if needed.clone().any(|k| number(k).is_none()) {
            return false;
        }
        self.take(wanted, |k| number(k).unwrap_or(f64::NAN));
        true
    }

    pub fn intensity(self) -> (Vec<[f64; 3]>, Option<Vec<f32>>) {
        let known = !self.light.is_empty();
        (self.points, known.then_some(self.light))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_that_is_there_twice_is_refused() {
        let among = |names: &[&'static str]| Wanted::among(names.iter().copied());
        assert_eq!(among(&["_", "X", "x", "y", "Z", "_"]).unwrap().xyz, [2, 3, 4]);
        assert!(among(&["x", "y", "z", "z"]).unwrap_err().contains("2 of its fields are called z"));
        assert!(among(&["x", "y", "z", "Intensity", "INTENSITY"]).unwrap_err().contains("intensity"));
        assert!(among(&["x", "y"]).unwrap_err().contains("missing"));
    }
}
