//! Reads single fields out of the records of a binary or text file.

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
    /// `None` if a coordinate is missing. An exact name is preferred; otherwise the case of letters is ignored.
    pub fn among<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Option<Wanted> {
        let at = |name: &str| {
            let any_case = || names.clone().position(|n| n.eq_ignore_ascii_case(name));
            names.clone().position(|n| n == name).or_else(any_case)
        };
        Some(Wanted { xyz: [at("x")?, at("y")?, at("z")?], light: at("intensity") })
    }
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
