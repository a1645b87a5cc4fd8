//! In: bytes of a b-CAP argument. Out: a variant, named as in OLE Automation; and the same bytes again.
//! Layout: type u16, count u32, then the values, little endian; texts are a byte count and UTF-16.
//! Frame and unit: none. Memory is allocated only for bytes that are present.

use crate::fault::{Fault, Result};

/// Deepest nesting of arrays of variants. The deepest that Denso's library sends is 2.
pub const DEEPEST: usize = 16;

const ARRAY: u16 = 0x2000;
const EMPTY: u16 = 0;
const NULL: u16 = 1;
const TEXT: u16 = 8;
const BOOL: u16 = 11;
const VARIANT: u16 = 12;

/// Defines the enum, and for each plain number type how it is read and written.
macro_rules! variants {
    ($($(#[$doc:meta])* $one:ident, $many:ident, $number:ty, $code:literal;)*) => {
        /// An argument of a call or a reply: nothing, a value, or an array of values of one type.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Variant {
            /// Nothing.
            Empty,
            /// The null value.
            Null,
            /// UTF-16 on the wire; half a surrogate pair arrives as U+FFFD.
            Text(String),
            /// An array of texts.
            Texts(Vec<String>),
            /// 0 or -1 in two bytes; every value other than 0 is true.
            Bool(bool),
            /// An array of truth values.
            Bools(Vec<bool>),
            /// An array whose values have different types.
            Variants(Vec<Variant>),
            $(
                $(#[$doc])* $one($number),
                #[doc = concat!("An array of [`Variant::", stringify!($one), "`].")]
                $many(Vec<$number>),
            )*
        }

        impl Variant {
            /// The values of a plain number type; `None` if the type is not a number.
            fn numbers(kind: u16, count: u32, from: &mut Bytes) -> Result<Option<Variant>> {
                Ok(Some(match kind {
                    $($code => Variant::$one(from.numbers::<$number>(1)?[0]),)*
                    $(k if k == $code | ARRAY => Variant::$many(from.numbers::<$number>(count)?),)*
                    _ => return Ok(None),
                }))
            }
            fn write_numbers(&self, out: &mut Vec<u8>) {
                match self {
                    $(Variant::$one(x) => { head($code, 1, out); x.write(out); })*
                    $(Variant::$many(all) => { head($code | ARRAY, all.len(),
                        out); all.iter().for_each(|x| x.write(out)); })*
                    _ => unreachable!("written by its own rule"),
                }
            }
        }

        $(impl Number for $number {
            const BYTES: usize = size_of::<$number>();
            fn read(bytes: &[u8]) -> $number {
                <$number>::from_le_bytes(bytes.try_into().expect("as many bytes as the type has"))
            }
            fn write(&self, out: &mut Vec<u8>) {
                out.extend(self.to_le_bytes());
            }
        })*
    };
}

trait Number: Sized {
    const BYTES: usize;
    fn read(bytes: &[u8]) -> Self;
    fn write(&self, out: &mut Vec<u8>);
}

variants! {
    /// A signed integer of 16 bits.
    I16, I16s, i16, 2;
    /// A signed integer of 32 bits.
    I32, I32s, i32, 3;
    /// A number of single precision.
    F32, F32s, f32, 4;
    /// A number of double precision.
    F64, F64s, f64, 5;
    /// A byte.
    U8, U8s, u8, 17;
    /// An unsigned integer of 16 bits.
    U16, U16s, u16, 18;
    /// An unsigned integer of 32 bits.
    U32, U32s, u32, 19;
    /// A signed integer of 64 bits.
    I64, I64s, i64, 20;
    /// An unsigned integer of 64 bits.
    U64, U64s, u64, 21;
    /// Ten-thousandths of a currency unit.
    Currency, Currencies, Currency, 6;
    /// Days since 30 December 1899.
    Date, Dates, Date, 7;
    /// An HRESULT.
    Error, Errors, Error, 10;
}

/// A number whose meaning differs from that of the plain type with the same bytes.
macro_rules! meaning {
    ($($name:ident, $number:ty;)*) => {$(
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name(pub $number);
        impl $name {
            fn from_le_bytes(bytes: [u8; size_of::<$number>()]) -> $name {
                $name(<$number>::from_le_bytes(bytes))
            }
            fn to_le_bytes(self) -> [u8; size_of::<$number>()] {
                self.0.to_le_bytes()
            }
        }
    )*};
}

meaning! {
    Currency, i64;
    Date, f64;
    Error, i32;
}

/// Bytes that are not read yet.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8]> {
        if n > self.0.len() {
            return Err(spoilt(format!("an argument wants {n} bytes more, {} are there", self.0.len())));
        }
        let (taken, left) = self.0.split_at(n);
        self.0 = left;
        Ok(taken)
    }
    fn numbers<N: Number>(&mut self, count: u32) -> Result<Vec<N>> {
        let bytes = (count as usize).saturating_mul(N::BYTES);
        Ok(self.take(bytes)?.chunks_exact(N::BYTES).map(N::read).collect())
    }
    fn number<N: Number>(&mut self) -> Result<N> {
        Ok(N::read(self.take(N::BYTES)?))
    }
    fn text(&mut self) -> Result<String> {
        let size = self.number::<u32>()? as usize;
        if !size.is_multiple_of(2) {
            return Err(spoilt(format!("a text has {size} bytes, UTF-16 has an even number")));
        }
        let units: Vec<u16> = self.take(size)?.chunks_exact(2).map(u16::read).collect();
        Ok(String::from_utf16_lossy(&units))
    }
    /// Returns an error for a count of values that the remaining bytes cannot hold: each value has at least `least`
    /// bytes.
    fn enough(&self, count: u32, least: usize) -> Result<()> {
        if count as usize > self.0.len() / least {
            return Err(spoilt(format!("an array claims {count} values, {} bytes are left", self.0.len())));
        }
        Ok(())
    }
}

fn spoilt(what: String) -> Fault {
    Fault::input(what)
        .cause("a damaged frame, or something else than b-CAP answers there")
        .next("check the address and the port (b-CAP: 5007)")
}

fn head(kind: u16, count: usize, out: &mut Vec<u8>) {
    out.extend(kind.to_le_bytes());
    out.extend((count as u32).to_le_bytes());
}

fn write_text(text: &str, out: &mut Vec<u8>) {
    let units: Vec<u16> = text.encode_utf16().collect();
    out.extend((2 * units.len() as u32).to_le_bytes());
    units.iter().for_each(|u| out.extend(u.to_le_bytes()));
}

impl Variant {
    /// Reads one variant that fills `bytes`. Returns an error for too few or too many bytes, an unknown type, a
    /// wrong count, or arrays nested more than [`DEEPEST`] deep.
    pub fn decode(bytes: &[u8]) -> Result<Variant> {
        let mut from = Bytes(bytes);
        let variant = Variant::next(&mut from, 0)?;
        if !from.0.is_empty() {
            return Err(spoilt(format!("an argument has {} bytes more than its type says", from.0.len())));
        }
        Ok(variant)
    }

    fn next(from: &mut Bytes, depth: usize) -> Result<Variant> {
        let (kind, count) = (from.number::<u16>()?, from.number::<u32>()?);
        if kind & ARRAY == 0 && count != 1 {
            return Err(spoilt(format!("a single value of type {kind} claims to be {count}")));
        }
        if let Some(numbers) = Variant::numbers(kind, count, from)? {
            return Ok(numbers);
        }
        Ok(match kind {
            EMPTY => Variant::Empty,
            NULL => Variant::Null,
            TEXT => Variant::Text(from.text()?),
            BOOL => Variant::Bool(from.number::<i16>()? != 0),
            k if k == BOOL | ARRAY => Variant::Bools(from.numbers::<i16>(count)?.into_iter().map(|x| x != 0).collect()),
            k if k == TEXT | ARRAY => {
                from.enough(count, 4)?;
                Variant::Texts((0..count).map(|_| from.text()).collect::<Result<_>>()?)
            }
            k if k == VARIANT | ARRAY => {
                if depth == DEEPEST {
                    return Err(spoilt(format!("arrays are nested more than {DEEPEST} deep")));
                }
                from.enough(count, 6)?;
                Variant::Variants((0..count).map(|_| Variant::next(from, depth + 1)).collect::<Result<_>>()?)
            }
            _ => return Err(spoilt(format!("an argument has the unknown type {kind}"))),
        })
    }

    /// Appends the bytes of the variant to `out`.
    pub fn encode(&self, out: &mut Vec<u8>) {
        match self {
            Variant::Empty => head(EMPTY, 1, out),
            Variant::Null => head(NULL, 1, out),
            Variant::Text(text) => {
                head(TEXT, 1, out);
                write_text(text, out);
            }
            Variant::Texts(all) => {
                head(TEXT | ARRAY, all.len(), out);
                all.iter().for_each(|text| write_text(text, out));
            }
            Variant::Bool(x) => {
                head(BOOL, 1, out);
                out.extend((-i16::from(*x)).to_le_bytes());
            }
            Variant::Bools(all) => {
                head(BOOL | ARRAY, all.len(), out);
                all.iter().for_each(|x| out.extend((-i16::from(*x)).to_le_bytes()));
            }
            Variant::Variants(all) => {
                head(VARIANT | ARRAY, all.len(), out);
                all.iter().for_each(|v| v.encode(out));
            }
            _ => self.write_numbers(out),
        }
    }

    /// The value, if it is a number of a plain type.
    pub fn as_f64(&self) -> Option<f64> {
        Some(match self {
            Variant::I16(x) => f64::from(*x),
            Variant::I32(x) => f64::from(*x),
            Variant::F32(x) => f64::from(*x),
            Variant::F64(x) => *x,
            Variant::U8(x) => f64::from(*x),
            Variant::U16(x) => f64::from(*x),
            Variant::U32(x) => f64::from(*x),
            Variant::I64(x) => *x as f64,
            Variant::U64(x) => *x as f64,
            Variant::Bool(x) => f64::from(u8::from(*x)),
            _ => return None,
        })
    }

    /// The values, if it is an array of a plain number type.
    pub fn as_f64s(&self) -> Option<Vec<f64>> {
        Some(match self {
            Variant::I16s(all) => all.iter().map(|&x| f64::from(x)).collect(),
            Variant::I32s(all) => all.iter().map(|&x| f64::from(x)).collect(),
            Variant::F32s(all) => all.iter().map(|&x| f64::from(x)).collect(),
            Variant::F64s(all) => all.clone(),
            Variant::Variants(all) => all.iter().map(Variant::as_f64).collect::<Option<_>>()?,
            _ => return None,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Variants of every type, arrays of arrays included.
    pub fn any_variant() -> impl Strategy<Value = Variant> {
        let text = || proptest::string::string_regex(".{0,12}").unwrap();
        let leaf = prop_oneof![
            Just(Variant::Empty),
            Just(Variant::Null),
            text().prop_map(Variant::Text),
            proptest::collection::vec(text(), 0..4).prop_map(Variant::Texts),
            any::<bool>().prop_map(Variant::Bool),
            proptest::collection::vec(any::<bool>(), 0..5).prop_map(Variant::Bools),
            any::<i16>().prop_map(Variant::I16),
            any::<i32>().prop_map(Variant::I32),
            (-1e30f32..1e30).prop_map(Variant::F32),
            (-1e300f64..1e300).prop_map(Variant::F64),
            any::<u8>().prop_map(Variant::U8),
            any::<u16>().prop_map(Variant::U16),
            any::<u32>().prop_map(Variant::U32),
            any::<i64>().prop_map(Variant::I64),
            any::<u64>().prop_map(Variant::U64),
            any::<i64>().prop_map(|x| Variant::Currency(Currency(x))),
            (0f64..1e5).prop_map(|x| Variant::Date(Date(x))),
            any::<i32>().prop_map(|x| Variant::Error(Error(x))),
            proptest::collection::vec(-1e9f64..1e9, 0..9).prop_map(Variant::F64s),
            proptest::collection::vec(-1e9f32..1e9, 0..9).prop_map(Variant::F32s),
            proptest::collection::vec(any::<i32>(), 0..9).prop_map(Variant::I32s),
            proptest::collection::vec(any::<u8>(), 0..9).prop_map(Variant::U8s),
            proptest::collection::vec(any::<i16>(), 0..9).prop_map(Variant::I16s),
            proptest::collection::vec(any::<u64>(), 0..9).prop_map(Variant::U64s),
        ];
        leaf.prop_recursive(4, 24, 6, |inner| proptest::collection::vec(inner, 0..6).prop_map(Variant::Variants))
    }

    fn bytes(v: &Variant) -> Vec<u8> {
        let mut out = Vec::new();
        v.encode(&mut out);
        out
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(
            if std::env::var_os("SHEETLIGHT_LONG").is_some() { 100_000 } else { 2_000 }
        ))]
        #[test]
        fn what_is_written_is_read(v in any_variant()) {
            prop_assert_eq!(Variant::decode(&bytes(&v)).unwrap(), v);
        }
        #[test]
        fn spoilt_bytes_are_refused_or_read(v in any_variant(), at in any::<prop::sample::Index>(), byte: u8,
            cut in any::<prop::sample::Index>()) {
            let mut b = bytes(&v);
            let i = at.index(b.len());
            b[i] = byte;
            let _ = Variant::decode(&b);
            let short = &b[..cut.index(b.len())];
            prop_assert!(Variant::decode(short).is_err() || short.is_empty() || short != &b[..]);
        }
    }

    #[test]
    fn counts_that_lie_are_refused_before_anything_is_allocated() {
        for kind in [2u16, 3, 4, 5, 8, 11, 12, 17, 20].map(|k| k | ARRAY) {
            let mut b = Vec::new();
            b.extend(kind.to_le_bytes());
            b.extend(u32::MAX.to_le_bytes());
            b.extend([0; 64]);
            assert!(Variant::decode(&b).is_err(), "type {kind}");
        }
        assert!(Variant::decode(&[3, 0, 2, 0, 0, 0, 1, 0, 0, 0]).unwrap_err().what.contains("claims to be 2"));
        assert!(Variant::decode(&[0, 32, 255, 255, 255, 255]).unwrap_err().what.contains("unknown type"));
    }

    #[test]
    fn ten_thousand_arrays_inside_each_other_are_refused() {
        let mut b = Vec::new();
        for _ in 0..10_000 {
            head(VARIANT | ARRAY, 1, &mut b);
        }
        head(EMPTY, 1, &mut b);
        assert!(Variant::decode(&b).unwrap_err().what.contains("nested"));
    }
}
