//! In: registers that a PLC writes over Modbus. Out: its requests; registers that it reads. Pure:
//! docs/connections.md has the map.
//! Frame and unit: 1/1000 mm and 1/10,000 degree, 32-bit signed, high word first [modbus 4.2: big-endian].

use super::words::{self, Code, Of, Reply, Request, Which, Wrong};
use crate::fault::{Fault, Result};
use crate::robot::Convention;
use std::net::IpAddr;
use std::time::{Duration, Instant};

/// Number of the map; it changes with the meaning of a register.
const MAP: u16 = 1;
/// Registers of a pose: six numbers of two words.
const POSE: usize = 12;
/// Units of the registers in a mm and in a degree. 1/10,000 degree is 0.9 um at half a metre.
const PER_MM: f64 = 1000.0;
const PER_DEGREE: f64 = 10_000.0;

/// Addresses that the PLC writes.
mod holding {
    pub const NUMBER: usize = 0;
    pub const WORD: usize = 1;
    pub const WHICH: usize = 2;
    pub const OF: usize = 3;
    pub const POSE: usize = 4;
    pub const RECIPE: usize = 16;
    pub const COUNT: usize = 36;
}

/// Addresses that it reads.
mod input {
    pub const MAP: usize = 0;
    pub const SECONDS: usize = 1;
    pub const BUSY: usize = 2;
    pub const ANSWERED: usize = 3;
    pub const ERROR: usize = 4;
    pub const STATE: usize = 5;
    pub const SHOTS: usize = 6;
    pub const SCORE: usize = 7;
    pub const POSE: usize = 8;
    pub const LENGTH: usize = 20;
    pub const WORDS: usize = 21;
    pub const COUNT: usize = 121;
}

/// Why registers are not read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// There are no such registers.
    Address,
    /// A request is being executed, or another PLC makes the requests.
    Busy,
    /// The request's number does not follow that of the last answered one.
    Number,
}

/// A request that registers made.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Its number, which the PLC chose.
    pub number: u16,
    /// The request, or what is wrong with it.
    pub request: std::result::Result<Request, Wrong>,
    /// Another PLC made the requests before: it knows nothing of their scan.
    pub by_another: bool,
}

/// All registers.
pub struct Registers {
    notation: Convention,
    holding: [u16; holding::COUNT],
    input: [u16; input::COUNT],
    since: Instant,
    asks: Option<(IpAddr, Instant)>,
    /// Another PLC has taken over and made no request yet.
    taken_over: bool,
    patience: Duration,
}

impl Registers {
    /// Registers of poses in `notation`. A PLC that makes requests is the only one until it is silent for `patience`.
    /// `answered` stands as the number of the last answered request, though there was none yet. A PLC writes its last
    /// request in every cycle, also after this program started again: a number that it cannot know keeps that from
    /// being executed a second time.
    ///
    /// # Errors
    /// The notation is not of six numbers in mm and degrees.
    pub fn new(notation: Convention, patience: Duration, answered: u16) -> Result<Registers> {
        let unit = |label: &&str| label.ends_with(" mm") || label.ends_with(" deg");
        let labels = notation.labels();
        if labels.len() != POSE / 2 || !labels.iter().all(unit) {
            let what = format!("Modbus has no registers for poses in the notation {}", notation.name());
            return Err(Fault::usage(format!("{what}: {}", labels.join(", ")))
                .cause("its registers hold six numbers in mm and degrees")
                .next("give --notation denso, kuka, fanuc or yaskawa, or serve text lines"));
        }
        let mut input = [0; input::COUNT];
        (input[input::MAP], input[input::ANSWERED]) = (MAP, answered);
        Ok(Registers {
            notation,
            holding: [0; holding::COUNT],
            input,
            since: Instant::now(),
            asks: None,
            taken_over: false,
            patience,
        })
    }

    /// Registers from `address` on that the PLC wrote.
    ///
    /// # Errors
    /// There are no such registers.
    pub fn written(&self, address: u16, count: u16) -> std::result::Result<Vec<u16>, Refused> {
        part(&self.holding, address, count)
    }

    /// Registers from `address` on that the PLC reads.
    ///
    /// # Errors
    /// There are no such registers.
    pub fn read(&mut self, address: u16, count: u16) -> std::result::Result<Vec<u16>, Refused> {
        // It goes round after 18 hours, and whoever compares it with its last value sees the program run.
        self.input[input::SECONDS] = self.since.elapsed().as_secs() as u16;
        part(&self.input, address, count)
    }

    /// Writes registers; all or none. The number after that of the last answered request makes a request. The same
    /// number again makes none: PLCs write the same registers in every cycle.
    ///
    /// # Errors
    /// There are no such registers, a new request comes too early, or its number is not the next one.
    pub fn write(
        &mut self,
        address: u16,
        values: &[u16],
        from: IpAddr,
        now: Instant,
    ) -> std::result::Result<Option<Asked>, Refused> {
        let begin = usize::from(address);
        let end = begin + values.len();
        if values.is_empty() || end > holding::COUNT {
            return Err(Refused::Address);
        }
        let owner = self.asks.filter(|(_, last)| now.duration_since(*last) < self.patience).map(|(who, _)| who);
        let number = if begin == holding::NUMBER { values[0] } else { self.holding[holding::NUMBER] };
        let answered = self.input[input::ANSWERED];
        let new = ![0, answered, self.holding[holding::NUMBER]].contains(&number);
        if owner.is_some_and(|who| who != from) || (new && self.input[input::BUSY] == 1) {
            return Err(Refused::Busy);
        }
        if new && number != next(answered) {
            return Err(Refused::Number);
        }
        if self.asks.is_some_and(|(who, _)| who != from) {
            // What the other PLC wrote is no part of this one's request.
            (self.taken_over, self.holding) = (true, [0; holding::COUNT]);
        }
        self.asks = Some((from, now));
        self.holding[begin..end].copy_from_slice(values);
        if !new {
            return Ok(None);
        }
        self.input[input::BUSY] = 1;
        let by_another = std::mem::take(&mut self.taken_over);
        Ok(Some(Asked { number, request: self.request(), by_another }))
    }

    fn request(&self) -> std::result::Result<Request, Wrong> {
        let choice = |at: usize, what: &str, most: u16| match self.holding[at] {
            x if x <= most => Ok(x),
            x => Err(Wrong::new(Code::Word, format!("register {at} is {x}, 0 to {most} {what}"))),
        };
        match self.holding[holding::WORD] {
            1 => Ok(Request::Scan),
            2 => Ok(Request::Pose(self.pose())),
            3 => words::recipe(&self.recipe()).map(Request::Find),
            4 => {
                let which = [Which::Approach, Which::Insertion, Which::Retract];
                let which = which[usize::from(choice(holding::WHICH, "are approach, insertion, retract", 2)?)];
                let of = [Of::Tool, Of::Flange][usize::from(choice(holding::OF, "are tool, flange", 1)?)];
                Ok(Request::Give(which, of))
            }
            x => Err(Wrong::new(
                Code::Word,
                format!("register {} is {x}; 1 SCAN, 2 POSE, 3 FIND and 4 GIVE are requests", holding::WORD),
            )),
        }
    }

    fn scales(&self) -> impl Iterator<Item = f64> + use<> {
        self.notation.labels().iter().map(|l| if l.ends_with(" mm") { PER_MM } else { PER_DEGREE })
    }

    fn pose(&self) -> Vec<f64> {
        let words = &self.holding[holding::POSE..holding::POSE + POSE];
        let number = |w: &[u16]| (u32::from(w[0]) << 16 | u32::from(w[1])) as i32;
        words.chunks_exact(2).zip(self.scales()).map(|(w, scale)| f64::from(number(w)) / scale).collect()
    }

    fn recipe(&self) -> String {
        let bytes = self.holding[holding::RECIPE..].iter().flat_map(|w| w.to_be_bytes()).take_while(|b| *b != 0);
        bytes.map(char::from).collect::<String>().trim_end().to_owned()
    }

    /// Puts what a request came to and the session's state into the registers, and ends the request.
    pub fn answer(&mut self, number: u16, said: &std::result::Result<Reply, Wrong>, state: &Reply) {
        self.input[input::ERROR] = said.as_ref().err().map_or(0, |w| w.code as u16);
        let words = said.as_ref().err().map(words::plain).unwrap_or_default();
        self.words(&words);
        match state {
            Reply::Scanning(shots) => self.state(1, *shots as u16),
            Reply::Found(_) => self.state(2, self.input[input::SHOTS]),
            _ => self.state(0, 0),
        }
        match said {
            Ok(Reply::Score(score)) => self.input[input::SCORE] = (score * 1000.0).round() as u16,
            _ if !matches!(state, Reply::Found(_)) => self.input[input::SCORE] = 0,
            _ => {}
        }
        // Only a GIVE that succeeded leaves a pose: an old one must not be taken for an answer.
        let mut pose = [0; POSE];
        if let Ok(Reply::Pose(numbers)) = said {
            for ((words, x), scale) in pose.chunks_exact_mut(2).zip(numbers).zip(self.scales()) {
                let whole = (x * scale).round() as i32 as u32;
                words.copy_from_slice(&[(whole >> 16) as u16, whole as u16]);
            }
        }
        self.input[input::POSE..input::POSE + POSE].copy_from_slice(&pose);
        self.input[input::ANSWERED] = number;
        self.input[input::BUSY] = 0;
    }

    fn state(&mut self, state: u16, shots: u16) {
        (self.input[input::STATE], self.input[input::SHOTS]) = (state, shots);
    }

    fn words(&mut self, words: &str) {
        let room = &mut self.input[input::WORDS..];
        room.fill(0);
        for (to, two) in room.iter_mut().zip(words.as_bytes().chunks(2)) {
            *to = u16::from_be_bytes([two[0], two.get(1).copied().unwrap_or(0)]);
        }
        self.input[input::LENGTH] = words.len() as u16;
    }
}

/// The request number that follows this one: 1 to 65535, then 1 again.
fn next(number: u16) -> u16 {
    number.checked_add(1).unwrap_or(1)
}

fn part(of: &[u16], address: u16, count: u16) -> std::result::Result<Vec<u16>, Refused> {
    let begin = usize::from(address);
    let found = of.get(begin..begin + usize::from(count)).filter(|found| !found.is_empty());
    found.map(<[u16]>::to_vec).ok_or(Refused::Address)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PLC: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 2));
    const OTHER: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 3));

    fn after(answered: u16) -> Registers {
        Registers::new(Convention::Denso, Duration::from_secs(10), answered).unwrap()
    }

    fn registers() -> Registers {
        after(0)
    }

    #[test]
    fn only_the_next_number_makes_a_request() {
        let (mut r, now) = (after(700), Instant::now());
        // What a PLC still writes from before a start of this program.
        for old in [1, 5, 699, 702, 65535] {
            assert_eq!(r.write(0, &[old, 1, 0, 0], PLC, now), Err(Refused::Number), "{old}");
            assert_eq!(r.written(0, 4), Ok(vec![0; 4]), "a refused write changes nothing");
        }
        assert_eq!(r.write(0, &[700, 1], PLC, now), Ok(None));
        assert!(r.write(0, &[701, 1], PLC, now).unwrap().is_some());
        r.answer(701, &Ok(Reply::Shots(0)), &Reply::Scanning(0));
        let mut last = after(65535);
        assert_eq!(last.write(0, &[0], PLC, now), Ok(None));
        assert!(last.write(0, &[1, 1], PLC, now).unwrap().is_some());
    }

    #[test]
    fn a_request_is_what_the_registers_say() {
        let (mut r, now) = (registers(), Instant::now());
        // 300.000 mm, -20.000 mm, 420.000 mm, 180 degrees, -0.0001 degree, 90 degrees, as a PLC's 32-bit numbers.
        let pose = [4, 37856, 65535, 45536, 6, 26784, 27, 30528, 65535, 65535, 13, 48032];
        assert_eq!(r.write(4, &pose, PLC, now), Ok(None));
        let asked = r.write(0, &[1, 2], PLC, now).unwrap().unwrap();
        let told = [300.0, -20.0, 420.0, 180.0, -0.0001, 90.0].to_vec();
        assert_eq!(asked, Asked { number: 1, request: Ok(Request::Pose(told)), by_another: false });
        r.answer(1, &Ok(Reply::Shots(7)), &Reply::Scanning(7));
        assert_eq!(r.read(2, 5), Ok(vec![0, 1, 0, 1, 7]));
        assert_eq!(r.write(16, &[0x6c65, 0x6400], PLC, now), Ok(None));
        assert_eq!(r.write(0, &[2, 3], PLC, now).unwrap().unwrap().request, Ok(Request::Find("led".into())));
        r.answer(2, &Ok(Reply::Score(0.9126)), &Reply::Found("led".into()));
        assert_eq!(r.read(2, 6), Ok(vec![0, 2, 0, 2, 7, 913]));
        let given = r.write(0, &[3, 4, 1, 1], PLC, now).unwrap().unwrap().request;
        assert_eq!(given, Ok(Request::Give(Which::Insertion, Of::Flange)));
        r.answer(3, &Ok(Reply::Pose(vec![300.0, -20.0, 420.0, 180.0, -0.0001, 90.0])), &Reply::Found("led".into()));
        assert_eq!(r.read(8, 12), Ok(pose.to_vec()));
    }

    #[test]
    fn the_same_registers_again_are_no_request_and_a_new_one_waits() {
        let (mut r, now) = (after(4), Instant::now());
        assert!(r.write(0, &[5, 1, 0, 0], PLC, now).unwrap().is_some());
        assert_eq!(r.write(0, &[5, 1, 0, 0], PLC, now), Ok(None), "a cycle");
        assert_eq!(r.write(0, &[6, 1, 0, 0], PLC, now), Err(Refused::Busy));
        assert_eq!(r.written(0, 1), Ok(vec![5]), "a refused write changes nothing");
        r.answer(5, &Ok(Reply::Shots(0)), &Reply::Scanning(0));
        assert_eq!(r.write(0, &[5, 1, 0, 0], PLC, now), Ok(None), "a cycle after the answer");
        assert!(r.write(0, &[6], PLC, now).unwrap().is_some());
        r.answer(6, &Ok(Reply::Shots(0)), &Reply::Scanning(0));
        assert_eq!(r.write(0, &[0], PLC, now), Ok(None), "0 is never a request");
    }

    #[test]
    fn one_plc_makes_requests_until_it_is_silent() {
        let (mut r, now) = (registers(), Instant::now());
        assert!(r.write(0, &[1, 1, 2], PLC, now).unwrap().is_some_and(|a| !a.by_another));
        r.answer(1, &Ok(Reply::Shots(0)), &Reply::Scanning(0));
        assert_eq!(r.write(0, &[2], OTHER, now + Duration::from_secs(9)), Err(Refused::Busy));
        let asked = r.write(0, &[2], OTHER, now + Duration::from_secs(10)).unwrap().unwrap();
        assert!(asked.by_another);
        assert!(asked.request.is_err(), "the word was the other's: {asked:?}");
        r.answer(2, &Ok(Reply::Score(0.9)), &Reply::Found("led".into()));
        // The first takes over again: what it writes before its request loses nothing.
        assert_eq!(r.write(16, &[0x6c65], PLC, now + Duration::from_secs(20)), Ok(None));
        assert!(r.write(0, &[3, 3], PLC, now + Duration::from_secs(21)).unwrap().is_some_and(|a| a.by_another));
        r.answer(3, &Err(Wrong::new(Code::Order, "no scan")), &Reply::Idle);
        assert_eq!(r.read(7, 1), Ok(vec![0]), "the score was the other's");
        assert!(r.write(0, &[4, 1], PLC, now + Duration::from_secs(22)).unwrap().is_some_and(|a| !a.by_another));
    }

    #[test]
    fn errors_are_numbers_and_words_and_leave_no_pose() {
        let (mut r, now) = (registers(), Instant::now());
        r.answer(1, &Ok(Reply::Pose(vec![1.0; 6])), &Reply::Idle);
        let wrong = |r: &mut Registers, values: &[u16]| {
            (r.input[input::BUSY], r.input[input::ANSWERED]) = (0, values[0] - 1);
            r.write(0, values, PLC, now).unwrap().unwrap().request.unwrap_err()
        };
        assert_eq!(wrong(&mut r, &[1, 9]).words, "register 1 is 9; 1 SCAN, 2 POSE, 3 FIND and 4 GIVE are requests");
        assert!(wrong(&mut r, &[2, 4, 3, 0]).words.starts_with("register 2 is 3"));
        assert!(wrong(&mut r, &[3, 4, 2, 2]).words.starts_with("register 3 is 2"));
        assert!(wrong(&mut r, &[4, 3]).words.contains("is not a recipe's name"));
        r.answer(4, &Err(Wrong::new(Code::Refused, "no pose: b\u{fc}rr")), &Reply::Idle);
        let said = r.read(20, 7).unwrap();
        assert_eq!((said[0], &said[1..3]), (13, &[0x6e6f, 0x2070][..]));
        assert_eq!(r.read(4, 16).unwrap()[0], 4);
        assert_eq!(r.read(8, 12), Ok(vec![0; 12]));
        for (address, count) in [(121, 1), (0, 122), (65535, 65535), (3, 0)] {
            assert_eq!(r.read(address, count), Err(Refused::Address), "{address} {count}");
        }
        assert_eq!(r.write(36, &[1], PLC, now), Err(Refused::Address));
        assert_eq!(r.write(35, &[1, 1], PLC, now), Err(Refused::Address));
    }

    #[test]
    fn poses_in_other_units_are_refused() {
        for other in [Convention::Ur, Convention::Abb, Convention::Matrix] {
            let said = Registers::new(other, Duration::ZERO, 0).err().unwrap();
            assert!(said.what.starts_with("Modbus has no registers for poses in the notation"), "{said}");
        }
    }

    proptest! {
        #[test]
        fn whatever_is_written_is_a_request_or_refused(
            writes in prop::collection::vec((0..40u16, prop::collection::vec(any::<u16>(), 0..40)), 1..20),
        ) {
            let (mut r, now) = (registers(), Instant::now());
            for (address, mut values) in writes {
                // Every other number follows; by chance hardly any would.
                if let (0, Some(first)) = (address, values.first_mut()) && *first % 2 == 0 {
                    *first = next(r.read(3, 1).unwrap()[0]);
                }
                if let Ok(Some(asked)) = r.write(address, &values, PLC, now) {
                    prop_assert_eq!(r.read(2, 1).unwrap(), vec![1]);
                    let said = asked.request.map(|_| Reply::Pose(vec![f64::from(asked.number) * 1e5; 6]));
                    r.answer(asked.number, &said, &Reply::Idle);
                    prop_assert_eq!(r.read(2, 2).unwrap(), vec![0, asked.number]);
                }
            }
        }
    }
}
