//! In: one call after the other, and every frame that arrives. Out: the bytes to send, and the role of each frame
//! in the call. No I/O and no clock: the owner of the socket decides when to repeat and when to give up.
//! Frame and unit: none. Rules as captured from Denso's client: docs/robots.md, b-CAP.

use super::{Call, Frame, Outcome, Variant};
use crate::fault::Result;

/// The role of a frame in the call that is under way.
#[derive(Clone, Debug, PartialEq)]
pub enum Heard {
    /// The call is in progress; the answer follows.
    Interim,
    /// A late answer to another call, or noise. It does not concern this call.
    Foreign,
    /// The answer to this call: the outcome, and the returned values.
    Answer(Outcome, Vec<Variant>),
}

/// The serial numbers of one connection and the call that is under way on it.
#[derive(Debug)]
pub struct Exchange {
    datagrams: bool,
    last: u16,
    /// The request as last sent; `sendings` has the serials of all its transmissions.
    request: Frame,
    sendings: Vec<u16>,
}

impl Exchange {
    /// `datagrams`: requests carry the serial of their first transmission, so that the controller does not execute
    /// a repeated one twice.
    pub fn new(datagrams: bool) -> Exchange {
        Exchange { datagrams, last: 0, request: Frame::default(), sendings: Vec::new() }
    }

    /// The next serial; 0 is not used.
    fn serial(&mut self) -> u16 {
        self.last = self.last.checked_add(1).unwrap_or(1);
        self.last
    }

    /// Begins a call. Answers to the previous call are foreign from now on.
    pub fn begin(&mut self, call: Call, arguments: Vec<Variant>) -> Result<Vec<u8>> {
        let serial = self.serial();
        let first_serial = if self.datagrams { serial } else { 0 };
        self.request = Frame { serial, first_serial, number: call.number(), arguments };
        self.sendings = vec![serial];
        self.request.encode()
    }

    /// The same call again, under a new serial and with the serial of its first transmission, so that it is
    /// executed once.
    pub fn again(&mut self) -> Result<Vec<u8>> {
        self.request.serial = self.serial();
        self.sendings.push(self.request.serial);
        self.request.encode()
    }

    /// Classifies a frame that arrived. An answer ends the call: a second answer is foreign.
    pub fn hear(&mut self, reply: Frame) -> Heard {
        if !self.sendings.contains(&reply.serial) {
            return Heard::Foreign;
        }
        match Outcome(reply.number) {
            Outcome::INTERIM => Heard::Interim,
            outcome => {
                self.sendings.clear();
                Heard::Answer(outcome, reply.arguments)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reply(serial: u16, outcome: Outcome, value: i32) -> Frame {
        Frame { serial, first_serial: 0, number: outcome.0, arguments: vec![Variant::I32(value)] }
    }

    #[test]
    fn a_late_answer_to_another_call_is_foreign_and_leaves_nothing_behind() {
        let mut e = Exchange::new(false);
        e.begin(Call::RobotExecute, vec![]).unwrap();
        e.begin(Call::RobotMove, vec![]).unwrap();
        assert_eq!(e.hear(reply(1, Outcome::OK, 7)), Heard::Foreign);
        assert_eq!(e.hear(reply(2, Outcome::INTERIM, 0)), Heard::Interim);
        assert_eq!(e.hear(reply(2, Outcome::OK, 8)), Heard::Answer(Outcome::OK, vec![Variant::I32(8)]));
        assert_eq!(e.hear(reply(2, Outcome::OK, 9)), Heard::Foreign);
    }

    #[test]
    fn a_repeated_datagram_names_its_first_sending_and_either_answer_counts() {
        let mut e = Exchange::new(true);
        let first = Frame::decode(&e.begin(Call::RobotMove, vec![]).unwrap()).unwrap();
        let second = Frame::decode(&e.again().unwrap()).unwrap();
        assert_eq!((first.serial, first.first_serial, second.serial, second.first_serial), (1, 1, 2, 1));
        assert!(matches!(e.hear(reply(1, Outcome::OK, 0)), Heard::Answer(..)));
    }

    #[test]
    fn serials_go_round_without_zero() {
        let mut e = Exchange::new(false);
        e.last = u16::MAX;
        assert_eq!(Frame::decode(&e.begin(Call::ServiceStop, vec![]).unwrap()).unwrap().serial, 1);
    }
}
