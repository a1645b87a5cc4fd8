//! In: a stream of bytes, or a datagram. Out: whole b-CAP frames, requests and replies; and the same bytes again.
//! Layout: 0x01, length u32, serial u16, field 7 u16, call or HRESULT u32, argument count u16, arguments (each a
//! length u32 and a variant), 0x04. Frame and unit: bytes, little endian.

use super::Variant;
use crate::fault::{Fault, Result};

/// Longest frame that is read. Poses, variables and error texts have some hundred bytes; a longer stated length
/// means damaged data.
pub const LARGEST_FRAME: usize = 1 << 20;

const BEGIN: u8 = 1;
const END: u8 = 4;
/// Number of bytes before the arguments; `SHORTEST` adds the last byte.
const HEAD: usize = 15;
const SHORTEST: usize = HEAD + 1;

/// A request or a reply; both have the same layout.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Serial number of the transmission; a reply carries that of its request.
    pub serial: u16,
    /// Field 7. Requests over UDP: serial of this call's first transmission, equal to `serial` for the first one.
    /// Otherwise 0.
    pub first_serial: u16,
    /// Requests: the call's number; replies: the HRESULT.
    pub number: u32,
    /// Requests: the call's arguments; replies: its results. In the order that the call defines.
    pub arguments: Vec<Variant>,
}

impl Frame {
    /// Reads one frame that fills `bytes`. Returns an error if lengths disagree, the first or last byte is wrong,
    /// or an argument cannot be read ([`Variant::decode`]).
    pub fn decode(bytes: &[u8]) -> Result<Frame> {
        let length = length_of(bytes)?.unwrap_or(usize::MAX);
        if length != bytes.len() {
            return Err(spoilt(format!("a frame of {} bytes says that it has {length}", bytes.len())));
        }
        if bytes[length - 1] != END {
            return Err(spoilt(format!("a frame ends with byte {:#04x}, it must be {END:#04x}", bytes[length - 1])));
        }
        let u16_at = |i: usize| u16::from_le_bytes([bytes[i], bytes[i + 1]]);
        let u32_at = |b: &[u8]| u32::from_le_bytes(b[..4].try_into().expect("four bytes"));
        let (count, mut left) = (u16_at(13), &bytes[HEAD..length - 1]);
        let mut arguments = Vec::new();
        for i in 0..count {
            let size = if left.len() < 4 { usize::MAX } else { u32_at(left) as usize };
            if size > left.len().saturating_sub(4) {
                return Err(spoilt(format!("argument {i} of {count} is cut off")));
            }
            arguments.push(Variant::decode(&left[4..4 + size]).map_err(|e| e.at(format!("argument {i}")))?);
            left = &left[4 + size..];
        }
        if !left.is_empty() {
            return Err(spoilt(format!("a frame has {} bytes behind its last argument", left.len())));
        }
        Ok(Frame { serial: u16_at(5), first_serial: u16_at(7), number: u32_at(&bytes[9..]), arguments })
    }

    /// The bytes of the frame. Returns an error for more than 65,535 arguments, or more than [`LARGEST_FRAME`]
    /// bytes.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let mut out = vec![BEGIN, 0, 0, 0, 0];
        out.extend(self.serial.to_le_bytes());
        out.extend(self.first_serial.to_le_bytes());
        out.extend(self.number.to_le_bytes());
        out.extend((self.arguments.len() as u16).to_le_bytes());
        for argument in &self.arguments {
            let at = out.len();
            out.extend([0; 4]);
            argument.encode(&mut out);
            let size = (out.len() - at - 4) as u32;
            out[at..at + 4].copy_from_slice(&size.to_le_bytes());
        }
        out.push(END);
        if out.len() > LARGEST_FRAME || self.arguments.len() > usize::from(u16::MAX) {
            return Err(Fault::usage(format!(
                "a call with {} arguments of {} bytes in all, at most 65535 and {LARGEST_FRAME} can be sent",
                self.arguments.len(),
                out.len()
            ))
            .cause("a text or an array that belongs into a file")
            .next("send less at once"));
        }
        let length = (out.len() as u32).to_le_bytes();
        out[1..5].copy_from_slice(&length);
        Ok(out)
    }
}

/// The length stated by the first bytes of a frame; `None` while fewer than five bytes are available.
fn length_of(bytes: &[u8]) -> Result<Option<usize>> {
    match bytes.first() {
        Some(&BEGIN) | None => {}
        Some(other) => {
            let text: String = bytes.iter().take(24).map(|&b| char::from(b)).take_while(|c| !c.is_control()).collect();
            let what = if text.is_ascii() && text.len() > 3 { format!("'{text}'") } else { format!("{other:#04x}") };
            return Err(spoilt(format!("a frame begins with {what}, it must begin with {BEGIN:#04x}")));
        }
    }
    let Some(length) = bytes.get(1..5) else { return Ok(None) };
    let length = u32::from_le_bytes(length.try_into().expect("four bytes")) as usize;
    if !(SHORTEST..=LARGEST_FRAME).contains(&length) {
        return Err(spoilt(format!("a frame says that it has {length} bytes, {SHORTEST}..={LARGEST_FRAME} are read")));
    }
    Ok(Some(length))
}

fn spoilt(what: String) -> Fault {
    Fault::input(what)
        .cause("damaged in transit, or the server there does not speak b-CAP")
        .next("check the address and the port (b-CAP: 5007)")
}

/// Assembles frames from the pieces that a stream delivers.
#[derive(Debug, Default)]
pub struct Splitter {
    bytes: Vec<u8>,
}

impl Splitter {
    /// Adds received bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }
    /// The next whole frame; `None` until more bytes arrive. After an error the frame boundaries are lost: close
    /// the stream.
    pub fn next(&mut self) -> Result<Option<Frame>> {
        match length_of(&self.bytes)? {
            Some(length) if length <= self.bytes.len() => {
                let frame = Frame::decode(&self.bytes[..length])?;
                self.bytes.drain(..length);
                Ok(Some(frame))
            }
            _ => Ok(None),
        }
    }
    /// Number of bytes of a frame that is not complete yet.
    pub fn waiting(&self) -> usize {
        self.bytes.len()
    }
}

#[cfg(test)]
mod tests {
    use super::super::variant::tests::any_variant;
    use super::*;
    use proptest::prelude::*;

    fn any_frame() -> impl Strategy<Value = Frame> {
        let arguments = proptest::collection::vec(any_variant(), 0..5);
        (any::<u16>(), any::<u16>(), any::<u32>(), arguments)
            .prop_map(|(serial, first_serial, number, arguments)| Frame { serial, first_serial, number, arguments })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(
            if std::env::var_os("SHEETLIGHT_LONG").is_some() { 100_000 } else { 1_000 }
        ))]
        #[test]
        fn frames_come_back_from_any_pieces(frames in proptest::collection::vec(any_frame(), 1..5),
            piece in 1usize..40) {
            let bytes: Vec<u8> = frames.iter().flat_map(|f| f.encode().unwrap()).collect();
            let (mut splitter, mut seen) = (Splitter::default(), Vec::new());
            for part in bytes.chunks(piece) {
                splitter.push(part);
                while let Some(frame) = splitter.next().unwrap() {
                    seen.push(frame);
                }
            }
            prop_assert_eq!(seen, frames);
            prop_assert_eq!(splitter.waiting(), 0);
        }
        #[test]
        fn damage_never_panics(frame in any_frame(),
            hits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
            let mut bytes = frame.encode().unwrap();
            for (at, byte) in hits {
                let i = at.index(bytes.len());
                bytes[i] = byte;
            }
            let _ = Frame::decode(&bytes);
            let mut splitter = Splitter::default();
            splitter.push(&bytes);
            while let Ok(Some(_)) = splitter.next() {}
        }
    }

    #[test]
    fn impossible_lengths_are_refused_at_once() {
        for length in [0u32, 15, (LARGEST_FRAME + 1) as u32, u32::MAX] {
            let mut splitter = Splitter::default();
            splitter.push(&[BEGIN]);
            splitter.push(&length.to_le_bytes());
            assert!(splitter.next().is_err(), "length {length}");
        }
        let mut splitter = Splitter::default();
        splitter.push(b"HTTP/1.1 400 Bad Request\r\n");
        assert!(splitter.next().unwrap_err().what.contains("'HTTP/1.1 400 Bad Request'"));
    }
}
