//! What kind of number a sample of a picture file is.

use std::fmt;

/// A kind of number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers from 0 to 2^bits - 1.
    Unsigned(u8),
    /// Whole numbers with a sign.
    Signed(u8),
    /// Floating point of 16, 32 or 64 bits.
    Float(u8),
    /// A number that was read from text.
    #[default]
    Text,
}

impl Kind {
    /// True for whole numbers, which have no special value for "not measured".
    pub fn whole(self) -> bool {
        matches!(self, Kind::Unsigned(_) | Kind::Signed(_))
    }

    /// The largest number of an unsigned kind.
    pub fn most(self) -> Option<f64> {
        match self {
            Kind::Unsigned(bits) => Some(2f64.powi(i32::from(bits)) - 1.0),
            _ => None,
        }
    }

    /// Whether `sample` is what a file of this kind stores for `number`: -99.9999 is stored in 32 bits as -99.99990082.
    pub fn same(self, sample: f64, number: f64) -> bool {
        match self {
            Kind::Float(16) => sample == in_half(number),
            // Other programs print a 32-bit number with 6 to 17 digits, and widen it to 64 bits.
            Kind::Float(_) | Kind::Text => sample as f32 == number as f32,
            Kind::Unsigned(_) | Kind::Signed(_) => sample == number,
        }
    }
}

/// The nearest number of 16-bit floating point (10 bits of fraction), as a 64-bit one.
fn in_half(number: f64) -> f64 {
    let exponent = number.abs().log2().floor().clamp(-14.0, 16.0);
    let step = (exponent - 10.0).exp2();
    (number / step).round_ties_even() * step
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Kind::Unsigned(bits) => write!(f, "{bits}-bit whole numbers"),
            Kind::Signed(bits) => write!(f, "{bits}-bit whole numbers with a sign"),
            Kind::Float(bits) => write!(f, "{bits}-bit floating point numbers"),
            Kind::Text => write!(f, "numbers as text"),
        }
    }
}

/// The samples of a picture: row by row, the channels of a pixel side by side.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// 1 to 8 bits, not stretched to 8.
    U8(Vec<u8>),
    /// 16 bits.
    U16(Vec<u16>),
    /// 16- and 32-bit floating point.
    F32(Vec<f32>),
    /// Every other kind.
    F64(Vec<f64>),
}

impl Values {
    pub fn len(&self) -> usize {
        match self {
            Values::U8(v) => v.len(),
            Values::U16(v) => v.len(),
            Values::F32(v) => v.len(),
            Values::F64(v) => v.len(),
        }
    }

    pub fn get(&self, i: usize) -> f64 {
        match self {
            Values::U8(v) => f64::from(v[i]),
            Values::U16(v) => f64::from(v[i]),
            Values::F32(v) => f64::from(v[i]),
            Values::F64(v) => v[i],
        }
    }

    /// The samples at the indices `from`, in that order.
    pub fn picked(&self, from: impl Iterator<Item = usize>) -> Values {
        match self {
            Values::U8(v) => Values::U8(from.map(|i| v[i]).collect()),
            Values::U16(v) => Values::U16(from.map(|i| v[i]).collect()),
            Values::F32(v) => Values::F32(from.map(|i| v[i]).collect()),
            Values::F64(v) => Values::F64(from.map(|i| v[i]).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_found_as_each_kind_stores_it() {
        for (kind, stored, number) in [
            (Kind::Float(32), f64::from(-99.9999f32), -99.9999),
            (Kind::Float(64), f64::from(999.999f32), 999.999),
            (Kind::Float(64), 999.999, 999.999),
            (Kind::Float(32), f64::from(f32::MIN), -3.402_823_466_385_29e38),
            (Kind::Float(16), -10_000.0, -9999.0),
            (Kind::Float(16), 0.0, 0.0),
            (Kind::Signed(16), -32_768.0, -32_768.0),
            (Kind::Text, -99.9999, -99.9999),
        ] {
            assert!(kind.same(stored, number), "{kind}: {stored} {number}");
        }
        for (kind, stored, number) in [
            (Kind::Signed(32), -2_147_483_647.0, -2_147_483_648.0),
            (Kind::Float(32), -99.99, -99.9999),
            (Kind::Float(16), -9992.0, -9999.0),
            (Kind::Float(32), f64::NAN, f64::NAN),
        ] {
            assert!(!kind.same(stored, number), "{kind}: {stored} {number}");
        }
    }
}
