//! In: bytes of a Modbus TCP connection [modbus, MODBUS Application Protocol V1.1b3; MODBUS Messaging on TCP/IP V1.0b].
//! Out: registers read or written, answers as bytes. Pure. The crate tokio-modbus 0.17 panics at frames whose counts
//! contradict each other (functions 15 and 16), so the five functions that are served are read here.
//! Frame and unit: big-endian words.

use super::registers::{Asked, Refused, Registers};
use std::net::IpAddr;
use std::time::Instant;

/// Most bytes of a request without its header.
const MOST: usize = 253;
/// Bytes before those that the header's length counts.
const HEAD: usize = 6;

/// Exception codes.
const FUNCTION: u8 = 1;
const ADDRESS: u8 = 2;
const VALUE: u8 = 3;
const BUSY: u8 = 6;

/// A request with its header: transaction, protocol, length, unit.
#[derive(Debug, PartialEq, Eq)]
pub struct Frame(Vec<u8>);

/// Takes the first frame from the received bytes; none if more bytes are needed.
///
/// # Errors
/// The bytes are not Modbus, so where the next frame begins is unknown.
pub fn next(bytes: &mut Vec<u8>) -> Result<Option<Frame>, &'static str> {
    let Some(head) = bytes.get(..HEAD) else { return Ok(None) };
    if head[2..4] != [0, 0] {
        return Err("the protocol identifier is not 0: this is not Modbus TCP");
    }
    let length = usize::from(word(head, 4));
    if !(2..=MOST + 1).contains(&length) {
        return Err("the header states a length that no request has");
    }
    Ok((bytes.len() >= HEAD + length).then(|| Frame(bytes.drain(..HEAD + length).collect())))
}

/// Executes a frame. Returns the answer, and what the registers now ask for.
pub fn answer(Frame(frame): &Frame, registers: &mut Registers, from: IpAddr) -> (Vec<u8>, Option<Asked>) {
    let (head, pdu) = frame.split_at(HEAD + 1);
    let (pdu, asked) = match executed(pdu, registers, from) {
        Ok(done) => done,
        Err(code) => (vec![pdu[0] | 0x80, code], None),
    };
    let length = (pdu.len() as u16 + 1).to_be_bytes();
    ([&head[..4], &length, &head[HEAD..], &pdu].concat(), asked)
}

/// The answer without its header, or an exception's code.
fn executed(pdu: &[u8], registers: &mut Registers, from: IpAddr) -> Result<(Vec<u8>, Option<Asked>), u8> {
    let refused = |r: Refused| match r {
        Refused::Address => ADDRESS,
        Refused::Busy => BUSY,
        Refused::Number => VALUE,
    };
    let long = |bytes: usize| if pdu.len() == bytes { Ok(()) } else { Err(VALUE) };
    // The registers that a request writes. Their count stands at `at`, their bytes' count before `data`.
    let counted = |at: usize, most: u16, data: usize| {
        let Some(bytes) = pdu.get(data..) else { return Err(VALUE) };
        let (count, stated) = (word(pdu, at), usize::from(pdu[data - 1]));
        if !(1..=most).contains(&count) || stated != bytes.len() || 2 * usize::from(count) != bytes.len() {
            return Err(VALUE);
        }
        Ok(bytes.chunks_exact(2).map(|w| u16::from_be_bytes([w[0], w[1]])).collect::<Vec<_>>())
    };
    let asked_for = |at: usize| Some(word(pdu, at)).filter(|n| (1..=125).contains(n)).ok_or(VALUE);
    let read = |values: Vec<u16>| {
        let bytes = values.iter().flat_map(|v| v.to_be_bytes());
        [pdu[0], 2 * values.len() as u8].into_iter().chain(bytes).collect::<Vec<_>>()
    };
    match pdu[0] {
        function @ (3 | 4) => {
            long(5)?;
            let (at, count) = (word(pdu, 1), asked_for(3)?);
            let values = if function == 3 { registers.written(at, count) } else { registers.read(at, count) };
            Ok((read(values.map_err(refused)?), None))
        }
        6 => {
            long(5)?;
            let asked = registers.write(word(pdu, 1), &[word(pdu, 3)], from, Instant::now()).map_err(refused)?;
            Ok((pdu.to_vec(), asked))
        }
        16 => {
            let values = counted(3, 123, 6)?;
            let asked = registers.write(word(pdu, 1), &values, from, Instant::now()).map_err(refused)?;
            Ok((pdu[..5].to_vec(), asked))
        }
        23 => {
            let values = counted(7, 121, 10)?;
            let (at, count) = (word(pdu, 1), asked_for(3)?);
            // It writes before it reads [modbus 6.17], and does neither if one of both is refused.
            registers.written(at, count).map_err(refused)?;
            let asked = registers.write(word(pdu, 5), &values, from, Instant::now()).map_err(refused)?;
            Ok((read(registers.written(at, count).map_err(refused)?), asked))
        }
        _ => Err(FUNCTION),
    }
}

/// Why an answer refuses its request; `None` if it does not.
pub fn refusal(answer: &[u8]) -> Option<&'static str> {
    let [function, code, ..] = answer.get(HEAD + 1..)? else { return None };
    Some(match (function & 0x80, *code) {
        (0, _) => return None,
        (_, FUNCTION) => "exception 1: another function",
        (_, ADDRESS) => "exception 2: other registers",
        (_, BUSY) => "exception 6: a request is executed, or another PLC makes the requests",
        _ => "exception 3: a wrong count, or a number that does not follow the last answered one",
    })
}

fn word(bytes: &[u8], at: usize) -> u16 {
    u16::from_be_bytes([bytes[at], bytes[at + 1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Convention;
    use proptest::prelude::*;
    use std::time::Duration;

    const PLC: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

    /// The answer to a request after its header.
    fn said(registers: &mut Registers, pdu: &[u8]) -> Vec<u8> {
        let mut bytes = [&[0, 7, 0, 0, 0, pdu.len() as u8 + 1, 255], pdu].concat();
        let frame = next(&mut bytes).unwrap().unwrap();
        let (answer, _) = answer(&frame, registers, PLC);
        assert_eq!((&answer[..4], &answer[6..7]), (&[0, 7, 0, 0][..], &[255][..]));
        assert_eq!(usize::from(word(&answer, 4)), answer.len() - HEAD);
        answer[HEAD + 1..].to_vec()
    }

    fn registers() -> Registers {
        Registers::new(Convention::Denso, Duration::from_secs(10), 0, false).unwrap()
    }

    #[test]
    fn functions_are_served_as_the_standard_has_them() {
        let mut r = registers();
        assert_eq!(said(&mut r, &[4, 0, 0, 0, 1]), [4, 2, 0, 1]);
        assert_eq!(said(&mut r, &[6, 0, 4, 1, 2]), [6, 0, 4, 1, 2]);
        assert_eq!(said(&mut r, &[16, 0, 5, 0, 2, 4, 3, 4, 5, 6]), [16, 0, 5, 0, 2]);
        assert_eq!(said(&mut r, &[3, 0, 4, 0, 3]), [3, 6, 1, 2, 3, 4, 5, 6]);
        assert_eq!(said(&mut r, &[23, 0, 4, 0, 2, 0, 4, 0, 1, 2, 9, 8]), [23, 4, 9, 8, 3, 4]);
    }

    #[test]
    fn wrong_requests_get_the_standards_exceptions() {
        let mut r = registers();
        for (pdu, code) in [
            (&[1, 0, 0, 0, 1][..], FUNCTION),
            (&[15, 0, 0, 0x0f, 0xff, 1, 0], FUNCTION),
            (&[4, 0, 121, 0, 1], ADDRESS),
            (&[4, 0, 0, 0, 0], VALUE),
            (&[4, 0, 0, 0, 126], VALUE),
            (&[4, 0, 0, 0], VALUE),
            (&[16], VALUE),
            (&[16, 0, 0, 0, 1, 2, 0], VALUE),
            (&[16, 0, 0, 0, 2, 2, 0, 0], VALUE),
            (&[16, 0, 0, 0, 1, 3, 0, 0], VALUE),
            // Twice this count is 4 in 16 bits.
            (&[16, 0, 0, 0x80, 2, 4, 0, 0, 0, 0], VALUE),
            (&[16, 0, 36, 0, 1, 2, 0, 0], ADDRESS),
            (&[23, 0, 36, 0, 1, 0, 0, 0, 1, 2, 0, 5], ADDRESS),
        ] {
            assert_eq!(said(&mut r, pdu), [pdu[0] | 0x80, code], "{pdu:?}");
            let whole = [&[0; HEAD + 1][..], &[pdu[0] | 0x80, code]].concat();
            assert!(refusal(&whole).unwrap().starts_with(&format!("exception {code}: ")));
        }
        assert_eq!(refusal(&[0, 1, 0, 0, 0, 5, 1, 4, 2, 0, 1]), None);
        assert_eq!(r.written(0, 1), Ok(vec![0]), "nothing was written");
    }

    #[test]
    fn frames_come_in_pieces_and_what_is_none_ends_the_connection() {
        let mut bytes = vec![0, 1, 0, 0, 0, 6, 1, 4, 0, 0, 0];
        assert_eq!(next(&mut bytes), Ok(None));
        bytes.extend([1, 0, 2]);
        assert!(next(&mut bytes).unwrap().is_some());
        assert_eq!(bytes, [0, 2], "the next frame's bytes stay");
        assert!(next(&mut b"GET / HTTP/1.1".to_vec()).is_err());
        assert!(next(&mut vec![0, 1, 0, 1, 0, 6]).is_err(), "another protocol");
        assert!(next(&mut vec![0, 1, 0, 0, 0, 1]).is_err() && next(&mut vec![0, 1, 0, 0, 1, 0]).is_err());
    }

    proptest! {
        #[test]
        fn whatever_comes_is_answered_or_refused(
            function in prop::sample::select(vec![3u8, 4, 6, 15, 16, 22, 23, 43, 255]),
            rest in prop::collection::vec(any::<u8>(), 0..MOST),
        ) {
            let mut bytes = vec![0, 1, 0, 0, 0, rest.len() as u8 + 2, 1, function];
            bytes.extend(&rest);
            let frame = next(&mut bytes).unwrap().unwrap();
            let (answer, _) = answer(&frame, &mut registers(), PLC);
            prop_assert!(answer.len() <= HEAD + 1 + MOST && usize::from(word(&answer, 4)) == answer.len() - HEAD);
        }
    }
}
