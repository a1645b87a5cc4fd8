//! In: numbers, texts and bytes in the order of a message's fields. Out: the message as ROS 2 writes it: CDR of XCDR
//! version 1, little endian, preceded by its header of four bytes.
//! Frame and unit: none.

/// Representation identifier of little-endian CDR, followed by two bytes of options.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// A message under construction. Every number is aligned to its own size, counted from the end of the header. [OMG
/// DDS-XTypes 1.3, 7.4.1; OMG DDSI-RTPS 2.5, 10.2]
#[derive(Clone, Debug)]
pub struct Cdr {
    bytes: Vec<u8>,
}

impl Default for Cdr {
    fn default() -> Cdr {
        Cdr::with_room(0)
    }
}

impl Cdr {
    /// An empty message with capacity for `bytes` more.
    pub fn with_room(bytes: usize) -> Cdr {
        let mut message = Vec::with_capacity(HEADER.len() + bytes);
        message.extend(HEADER);
        Cdr { bytes: message }
    }

    /// The whole message, including its header.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        let written = self.bytes.len() - HEADER.len();
        self.bytes.resize(HEADER.len() + written.next_multiple_of(N), 0);
        self.bytes.extend(bytes);
    }

    /// `bool`: 0 or 1.
    pub fn bool(&mut self, value: bool) {
        self.put([u8::from(value)]);
    }

    /// `uint8` and `byte`.
    pub fn u8(&mut self, value: u8) {
        self.put([value]);
    }

    /// `int32`.
    pub fn i32(&mut self, value: i32) {
        self.put(value.to_le_bytes());
    }

    /// `uint32`.
    pub fn u32(&mut self, value: u32) {
        self.put(value.to_le_bytes());
    }

    /// `float64`.
    pub fn f64(&mut self, value: f64) {
        self.put(value.to_le_bytes());
    }

    /// `float64[N]`: without a length before it.
    pub fn f64s(&mut self, values: &[f64]) {
        values.iter().for_each(|v| self.f64(*v));
    }

    /// The number of elements of a sequence; the elements follow.
    ///
    /// # Panics
    /// More elements than a `uint32` can count: callers refuse such lengths before.
    pub fn count(&mut self, elements: usize) {
        self.u32(u32::try_from(elements).expect("its caller has refused longer ones"));
    }

    /// `string`: its length including the final zero byte, its bytes, the zero byte. The text is cut at a zero byte
    /// within it.
    pub fn string(&mut self, text: &str) {
        let text = text.split('\0').next().unwrap_or_default();
        self.count(text.len() + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// Elements of a `uint8[]`; [`Cdr::count`] must have written their number before.
    pub fn raw(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes after the header.
    fn body(write: impl Fn(&mut Cdr)) -> Vec<u8> {
        let mut message = Cdr::default();
        write(&mut message);
        assert_eq!(message.bytes()[..4], [0x00, 0x01, 0x00, 0x00]);
        message.bytes()[4..].to_vec()
    }

    #[test]
    fn numbers_are_aligned_to_their_size_from_behind_the_header() {
        let bytes = body(|m| {
            m.u8(7);
            m.u32(0x0102_0304);
            m.bool(true);
            m.f64(-2.0);
            m.i32(-1);
        });
        #[rustfmt::skip]
        assert_eq!(bytes, [
            7, 0, 0, 0,                // a byte, three padding bytes up to 4
            4, 3, 2, 1,                // at 4
            1, 0, 0, 0, 0, 0, 0, 0,    // at 8, seven padding bytes up to 16
            0, 0, 0, 0, 0, 0, 0, 0xc0, // at 16: -2
            255, 255, 255, 255,        // at 24
        ]);
        // Eight bytes directly follow eight: the header of four does not count for the alignment.
        assert_eq!(body(|m| m.f64(1.0)), [0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
    }

    #[test]
    fn texts_and_sequences_have_their_length_before_them() {
        let bytes = body(|m| {
            m.string("base");
            m.u32(1);
            m.string("");
            m.count(3);
            m.raw(&[9, 8, 7]);
            m.count(1);
            m.f64(1.0);
        });
        #[rustfmt::skip]
        assert_eq!(bytes, [
            5, 0, 0, 0, b'b', b'a', b's', b'e', 0,
            0, 0, 0,                   // padding up to 12
            1, 0, 0, 0,
            1, 0, 0, 0, 0,             // an empty text is only its zero byte
            0, 0, 0,                   // padding up to 24
            3, 0, 0, 0, 9, 8, 7,
            0,                         // padding up to 32
            1, 0, 0, 0,
            0, 0, 0, 0,                // padding up to 40
            0, 0, 0, 0, 0, 0, 0xf0, 0x3f,
        ]);
        assert_eq!(body(|m| m.string("a\0b")), [2, 0, 0, 0, b'a', 0]);
    }

    /// A message header: 1.5 s, "map", then a number of four bytes.
    #[test]
    fn a_header_is_the_bytes_that_were_worked_out() {
        let bytes = body(|m| {
            m.i32(1);
            m.u32(500_000_000);
            m.string("map");
            m.u32(2);
        });
        assert_eq!(bytes, [1, 0, 0, 0, 0x00, 0x65, 0xcd, 0x1d, 4, 0, 0, 0, b'm', b'a', b'p', 0, 2, 0, 0, 0]);
    }
}
