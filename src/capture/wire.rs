//! In: messages of a cell's camera, or the bytes of a stream of them. Out: the other form. Pure functions: nothing
//! here waits, or allocates as much as an unchecked length claims.
//! Frame and unit: little endian; times in ns of the cell's clock.
//!
//! The server (the cell) sends messages, the client (this program) lines of text. A message consists of a head of 16
//! bytes and its content:
//!
//! | bytes | what |
//! |---|---|
//! | 4 | `SLP1` for a picture, `SLT1` for text |
//! | 4 | 0 |
//! | 8 | length of the content, bytes |
//!
//! A picture's content is a head of 56 bytes, then its rows without gaps (levels of more than 8 bits as two bytes):
//!
//! | bytes | what |
//! |---|---|
//! | 4, 4, 4 | width, height, bits |
//! | 4 | flags: 1 = the count is valid |
//! | 8 | id: increases by one for every picture taken, sent or not |
//! | 8 | start of the exposure, ns |
//! | 8 | exposure time, ns |
//! | 8 | an encoder's or trigger's count (signed) |
//! | 8 | number of pictures that this camera has sent to this client, including this one |
//!
//! Lines; each is answered in order by one text that begins with `ok` or `error `:
//!
//! | line | answer |
//! |---|---|
//! | `start FPS` | pictures come at this rate until `stop`; 0: the cell chooses the rate |
//! | `stop` | no more pictures come |
//! | `snap` | one picture, taken now |
//! | `time` | `ok NS`: the cell's clock |
//! | `format` | `ok WIDTH HEIGHT BITS` of its pictures, which show the whole sensor |
//! | `features` | `ok`, then a line each: name, value, unit, low, high, separated by tabs |
//! | `set NAME VALUE` | `ok`; the setting stays for later clients, as in a camera |

use super::format::Format;
use crate::fault::{Fault, Result};
use crate::raster::{Image, MOST_PIXELS};

/// Bytes before a message's content.
pub const HEAD: usize = 16;
/// Bytes before a picture's rows.
pub const PICTURE_HEAD: usize = 56;
/// Most bytes of a text.
pub const MOST_TEXT: u64 = 1 << 20;
const PICTURE: [u8; 4] = *b"SLP1";
const TEXT: [u8; 4] = *b"SLT1";

/// A message from the server.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// A picture with its numbers.
    Picture(Box<Sent>),
    /// An answer.
    Text(String),
}

/// A picture on the wire.
#[derive(Clone, Debug, PartialEq)]
pub struct Sent {
    /// Grey levels of the sensor's depth.
    pub image: Image,
    /// Increases by one for every picture taken, sent or not.
    pub id: u64,
    /// Start of the exposure, by the cell's clock.
    pub device_ns: u64,
    /// Exposure time.
    pub exposure_ns: u64,
    /// An encoder's or trigger's count.
    pub count: Option<i64>,
    /// Pictures sent to this client so far, including this one.
    pub sent: u64,
}

/// Content of a message's head: kind and length of what follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    picture: bool,
    /// Number of bytes that follow.
    pub length: usize,
}

fn bad(what: String) -> Fault {
    Fault::input(what)
        .cause("another program than a sheetlight cell answers at this address, or bytes were lost")
        .next("compare host and port with those that the cell prints")
}

fn head(kind: [u8; 4], length: usize) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEAD + length);
    out.extend(kind);
    out.extend([0; 4]);
    out.extend((length as u64).to_le_bytes());
    out
}

/// Serialises a message.
pub fn write(message: &Message) -> Vec<u8> {
    match message {
        Message::Text(text) => {
            let mut out = head(TEXT, text.len());
            out.extend(text.as_bytes());
            out
        }
        Message::Picture(p) => {
            let rows = super::format::raw_bytes(&p.image);
            let mut out = head(PICTURE, PICTURE_HEAD + rows.len());
            let words = [p.image.width, p.image.height, u32::from(p.image.bits), u32::from(p.count.is_some())];
            words.iter().for_each(|w| out.extend(w.to_le_bytes()));
            [p.id, p.device_ns, p.exposure_ns].iter().for_each(|w| out.extend(w.to_le_bytes()));
            out.extend(p.count.unwrap_or(0).to_le_bytes());
            out.extend(p.sent.to_le_bytes());
            out.extend(rows.iter());
            out
        }
    }
}

/// Reads a message's first [`HEAD`] bytes. Refuses an unknown kind, and a content longer than any picture or text.
pub fn read_head(bytes: &[u8; HEAD]) -> Result<Head> {
    let picture = bytes[..4] == PICTURE;
    if !picture && bytes[..4] != TEXT {
        return Err(bad(format!("a message begins with {:02x?}, SLP1 or SLT1 is expected", &bytes[..4])));
    }
    let length = u64::from_le_bytes(bytes[8..].try_into().expect("8 bytes"));
    let most = if picture { PICTURE_HEAD as u64 + 2 * MOST_PIXELS } else { MOST_TEXT };
    if length > most {
        return Err(bad(format!("a message of {length} bytes, at most {most} are read")));
    }
    Ok(Head { picture, length: length as usize })
}

/// Reads the content that a head announced. Refuses a picture whose size and bytes disagree, and text that is not
/// UTF-8.
pub fn read(head: Head, mut content: Vec<u8>) -> Result<Message> {
    if content.len() != head.length {
        return Err(bad(format!("{} bytes where {} were announced", content.len(), head.length)));
    }
    if !head.picture {
        return String::from_utf8(content).map(Message::Text).map_err(|_| bad("an answer is not UTF-8".into()));
    }
    if content.len() < PICTURE_HEAD {
        return Err(bad(format!("a picture of {} bytes, its head alone has {PICTURE_HEAD}", content.len())));
    }
    let rows = content.split_off(PICTURE_HEAD);
    let word = |at: usize| u32::from_le_bytes(content[at..at + 4].try_into().expect("4 bytes"));
    let long = |at: usize| u64::from_le_bytes(content[at..at + 8].try_into().expect("8 bytes"));
    let bits = u8::try_from(word(8)).ok().filter(|b| (8..=16).contains(b));
    let Some(bits) = bits.filter(|_| word(0) > 0 && word(4) > 0) else {
        return Err(bad(format!("a picture of {}x{} with {} bits", word(0), word(4), word(8))));
    };
    if u64::from(word(0)) * u64::from(word(4)) > MOST_PIXELS {
        return Err(bad(format!("a picture of {}x{}, at most {MOST_PIXELS} pixels are read", word(0), word(4))));
    }
    let image = Format { width: word(0), height: word(4), bits }.image(rows)?;
    let count = (word(12) & 1 == 1).then(|| long(40) as i64);
    let (id, device_ns, exposure_ns, sent) = (long(16), long(24), long(32), long(48));
    Ok(Message::Picture(Box::new(Sent { image, id, device_ns, exposure_ns, count, sent })))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn back(bytes: &[u8]) -> Result<Message> {
        let head = read_head(bytes[..HEAD].try_into().expect("long enough"))?;
        read(head, bytes[HEAD..].to_vec())
    }

    #[test]
    fn what_is_written_is_read_and_lies_are_refused() {
        let sent = |image, count| {
            Message::Picture(Box::new(Sent { image, id: 7, device_ns: 1 << 40, exposure_ns: 5, count, sent: 3 }))
        };
        let eight = sent(Image::from_u8(3, 2, vec![0, 1, 2, 3, 4, 255]), Some(-9));
        let twelve = sent(Image::from_u16(1, 2, 12, vec![4095, 7]), None);
        for message in [eight.clone(), twelve, Message::Text("ok 1 2".into())] {
            assert_eq!(back(&write(&message)).unwrap(), message);
        }
        let whole = write(&eight);
        for at in 0..whole.len() {
            // No byte causes a panic; lengths are trusted only as far as they are consistent.
            for value in [0, 1, 0x7f, 0xff] {
                let mut changed = whole.clone();
                changed[at] = value;
                let _ = back(&changed);
            }
        }
        let mut long = whole.clone();
        long[8..16].fill(0xff);
        assert!(back(&long).unwrap_err().what.contains("at most"));
        assert!(back(&whole[..whole.len() - 1]).is_err());
        let mut other = whole;
        other[..4].copy_from_slice(b"HTTP");
        assert!(back(&other).unwrap_err().what.contains("SLP1"));
    }
}
