//! In: the bytes of a message and the definition of its type. Out: whether they are CDR of this type: every length and
//! every text lies within the bytes, and nothing is left over.

use super::definition::{Count, Definition, Field, Kind};

/// Bytes before the message: representation and options.
const HEADER: usize = 4;
/// Most bytes behind a message: writers fill up to a multiple of 4.
const PADDING: usize = 3;

/// Checks a message; an error says in words where it departs from its type.
///
/// # Errors
/// Bytes that are no CDR of version 1, or not of this type.
pub fn check(bytes: &[u8], definition: &Definition) -> Result<(), String> {
    let Some((head, body)) = bytes.split_at_checked(HEADER) else {
        return Err(format!("it has {} bytes, the header alone has {HEADER}", bytes.len()));
    };
    let little = match head[..2] {
        [0, 0] => false,
        [0, 1] => true,
        _ => return Err(format!("it begins with {:02x} {:02x}, CDR begins with 00 00 or 00 01", head[0], head[1])),
    };
    let mut walk = Walk { body, at: 0, little, definition };
    match walk.fields(&definition.types[&definition.name])? {
        Walked::Unknown => Ok(()),
        Walked::Known if body.len() - walk.at > PADDING => {
            Err(format!("{} bytes are left over behind it", body.len() - walk.at))
        }
        Walked::Known => Ok(()),
    }
}

/// Whether the place in the bytes is known.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Walked {
    Known,
    /// Behind a wide text, whose characters have 2 or 4 bytes depending on the writer.
    Unknown,
}

struct Walk<'a> {
    body: &'a [u8],
    at: usize,
    little: bool,
    definition: &'a Definition,
}

impl Walk<'_> {
    fn fields(&mut self, fields: &[Field]) -> Result<Walked, String> {
        if fields.is_empty() {
            self.skip(1, 1).map_err(|e| format!("an empty type {e}"))?;
        }
        for field in fields {
            match self.field(field).map_err(|why| format!("{}: {why}", field.name))? {
                Walked::Known => {}
                Walked::Unknown => return Ok(Walked::Unknown),
            }
        }
        Ok(Walked::Known)
    }

    fn field(&mut self, f: &Field) -> Result<Walked, String> {
        let count = match f.count {
            Count::One => 1,
            Count::Fixed(n) => n,
            Count::Any => u64::from(self.length()?),
            Count::Bounded(most) => match u64::from(self.length()?) {
                n if n > most => return Err(format!("{n} elements, at most {most} are allowed")),
                n => n,
            },
        };
        if let Some(size) = size(f.kind) {
            self.skip(count, size)?;
            return Ok(Walked::Known);
        }
        let definition = self.definition;
        // Every text and every nested value has a byte at least, so this ends where the bytes end.
        for _ in 0..count {
            match f.kind {
                Kind::Nested => {
                    if self.fields(&definition.types[&f.nested])? == Walked::Unknown {
                        return Ok(Walked::Unknown);
                    }
                }
                Kind::Wstring | Kind::BoundedWstring => return Ok(Walked::Unknown),
                _ => self.text()?,
            }
        }
        Ok(Walked::Known)
    }

    /// Skips `count` numbers of `size` bytes. Numbers are aligned to their size.
    fn skip(&mut self, count: u64, size: usize) -> Result<(), String> {
        if count == 0 {
            return Ok(());
        }
        let begin = self.at.next_multiple_of(size);
        let end =
            count.checked_mul(size as u64).and_then(|n| usize::try_from(n).ok()).and_then(|n| begin.checked_add(n));
        match end.filter(|end| *end <= self.body.len()) {
            Some(end) => self.at = end,
            None => {
                return Err(format!("needs {count} x {size} bytes from {begin}, the message has {}", self.body.len()));
            }
        }
        Ok(())
    }

    fn length(&mut self) -> Result<u32, String> {
        self.skip(1, 4)?;
        let bytes = self.body[self.at - 4..self.at].try_into().expect("four bytes");
        Ok(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    /// A text: its length with the final zero, its bytes, the zero. Some writers give an empty text the length 0.
    fn text(&mut self) -> Result<(), String> {
        let length = self.length()?;
        self.skip(u64::from(length), 1)?;
        match self.body[..self.at].last() {
            Some(0) => Ok(()),
            _ if length == 0 => Ok(()),
            _ => Err(format!("a text of {length} bytes does not end with a zero")),
        }
    }
}

/// Size of numbers of a kind, bytes.
fn size(kind: Kind) -> Option<usize> {
    match kind {
        Kind::Bool | Kind::Byte | Kind::Int8 | Kind::Uint8 => Some(1),
        Kind::Int16 | Kind::Uint16 => Some(2),
        Kind::Int32 | Kind::Uint32 | Kind::Float => Some(4),
        Kind::Int64 | Kind::Uint64 | Kind::Double => Some(8),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(text: &str, body: &[u8]) -> Result<(), String> {
        let definition = Definition::read("a/msg/B", text.as_bytes()).unwrap();
        check(&[&[0, 1, 0, 0], body].concat(), &definition)
    }

    #[test]
    fn messages_of_their_type_pass_and_others_do_not() {
        let text = "uint8 a\nstring s\nfloat64[] d\nC[2] c\n===\nMSG: a/C\nuint16 u\n";
        let body: &[u8] = &[
            7, 0, 0, 0, 3, 0, 0, 0, b'h', b'i', 0, 0, 1, 0, 0, 0, // to 16
            0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 2, 0,
        ];
        assert_eq!(checked(text, body), Ok(()));
        assert_eq!(checked(text, &[body, &[0; 3]].concat()), Ok(()));
        assert!(checked(text, &[body, &[0; 4]].concat()).unwrap_err().contains("4 bytes are left over"));
        for end in 0..body.len() {
            assert!(checked(text, &body[..end]).is_err(), "{end}");
        }
        let mut huge = body.to_vec();
        huge[12..16].fill(0xff);
        assert!(checked(text, &huge).unwrap_err().contains("d: needs 4294967295 x 8 bytes from 16"));
        let mut open = body.to_vec();
        open[10] = b'!';
        assert!(checked(text, &open).unwrap_err().contains("s: a text of 3 bytes does not end with a zero"));
        assert!(checked("uint8[<=2] a\n", &[3, 0, 0, 0, 1, 2, 3]).unwrap_err().contains("3 elements, at most 2"));
        assert_eq!(checked("wstring w\nuint8 a\n", &[0]), Ok(()));
        assert_eq!(checked("", &[0]), Ok(()));
        assert!(checked("", &[]).is_err());
    }

    #[test]
    fn the_order_of_bytes_is_that_of_the_header() {
        let definition = Definition::read("a/msg/B", b"string s\n").unwrap();
        assert_eq!(check(&[0, 0, 0, 0, 0, 0, 0, 2, b'a', 0], &definition), Ok(()));
        assert!(check(&[0, 1, 0, 0, 0, 0, 0, 2, b'a', 0], &definition).is_err());
        assert!(check(&[0, 7, 0, 0, 2, 0, 0, 0, b'a', 0], &definition).unwrap_err().contains("begins with 00 07"));
        assert!(check(&[0, 1, 0], &definition).unwrap_err().contains("3 bytes"));
    }
}
