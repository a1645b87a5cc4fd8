//! In: registers that a PLC writes over Modbus. Out: its requests; registers that it reads. Pure:
//! docs/connections.md has the map.
//! Frame and unit: 1/1000 mm and 1/10,000 degree, 32-bit signed, high word first [modbus 4.2: big-endian].

use super::shown::{self, Shown};
use super::table::{PER_DEGREE, PER_MM, POSE, TABLE, holding, input, request};
use super::words::{self, Code, Of, Reply, Request, Target, Which, Wrong};
use crate::fault::{Fault, Result};
use crate::robot::Convention;
use std::net::IpAddr;
use std::time::{Duration, Instant};

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
    /// Who made it.
    pub from: IpAddr,
    /// Another PLC made the requests before: it knows nothing of their scan.
    pub by_another: bool,
}

/// All registers.
pub struct Registers {
    notation: Convention,
    /// The table has the registers of jobs.
    jobs: bool,
    holding: Vec<u16>,
    input: Vec<u16>,
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
    /// being executed a second time. `jobs`: the table has the registers of jobs.
    ///
    /// # Errors
    /// The notation is not of six numbers in mm and degrees.
    pub fn new(notation: Convention, patience: Duration, answered: u16, jobs: bool) -> Result<Registers> {
        let unit = |label: &&str| label.ends_with(" mm") || label.ends_with(" deg");
        let labels = notation.labels();
        if labels.len() != POSE / 2 || !labels.iter().all(unit) {
            let what = format!("Modbus has no registers for poses in the notation {}", notation.name());
            return Err(Fault::usage(format!("{what}: {}", labels.join(", ")))
                .cause("its registers hold six numbers in mm and degrees")
                .next("choose the notation denso, kuka, fanuc or yaskawa, or serve text lines"));
        }
        let [written, read] = match jobs {
            true => [holding::COUNT_WITH_JOBS, input::COUNT_WITH_JOBS],
            false => [holding::COUNT, input::COUNT],
        };
        let mut input = vec![0; read];
        (input[input::TABLE], input[input::ANSWERED]) = (TABLE, answered);
        Ok(Registers {
            notation,
            jobs,
            holding: vec![0; written],
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
        if values.is_empty() || end > self.holding.len() {
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
            self.taken_over = true;
            self.holding.fill(0);
        }
        self.asks = Some((from, now));
        self.holding[begin..end].copy_from_slice(values);
        if !new {
            return Ok(None);
        }
        self.input[input::BUSY] = 1;
        let by_another = std::mem::take(&mut self.taken_over);
        Ok(Some(Asked { number, request: self.request(), from, by_another }))
    }

    fn request(&self) -> std::result::Result<Request, Wrong> {
        let choice = |at: usize, what: &str, [least, most]: [u16; 2]| match self.holding[at] {
            x if (least..=most).contains(&x) => Ok(usize::from(x - least)),
            x => Err(Wrong::new(Code::Word, format!("register {at} is {x}, {least} to {most} {what}"))),
        };
        match self.holding[holding::WORD] {
            request::SCAN if self.jobs => words::recording(&self.name()).map(Request::Scan),
            request::SCAN => Ok(Request::Scan(None)),
            request::POSE => Ok(Request::Pose(self.pose())),
            request::FIND => words::recipe(&self.name()).map(Request::Find),
            request::GIVE => {
                let which = [Which::Approach, Which::Insertion, Which::Retract];
                let which = which[choice(holding::WHICH, "are approach, insertion, retract", [0, 2])?];
                let of = [Of::Tool, Of::Flange][choice(holding::OF, "are tool, flange", [0, 1])?];
                Ok(Request::Give(which, of))
            }
            request::INSERT if self.jobs => {
                let recipe = words::recipe(&self.name())?;
                let sweep_mm = self.numbers(holding::SWEEP, 1).map(|n| f64::from(n) / PER_MM).next();
                Ok(Request::Insert { recipe, sweep_mm: sweep_mm.filter(|mm| *mm != 0.0) })
            }
            request::STOP if self.jobs => Ok(Request::Stop),
            request::CALIBRATE if self.jobs => {
                let what = "are camera, hand-eye, laser plane, pointer, axis";
                let target = Target::ALL[choice(holding::TARGET, what, [1, 5])?];
                Ok(Request::Calibrate(target, words::recording(&self.name())?))
            }
            x => {
                let known = match self.jobs {
                    true => "1 SCAN, 2 POSE, 3 FIND, 4 GIVE, 5 INSERT, 6 STOP and 7 CALIBRATE",
                    false => "1 SCAN, 2 POSE, 3 FIND and 4 GIVE",
                };
                Err(Wrong::new(Code::Word, format!("register {} is {x}; {known} are requests", holding::WORD)))
            }
        }
    }

    fn scales(&self) -> impl Iterator<Item = f64> + use<> {
        self.notation.labels().iter().map(|l| if l.ends_with(" mm") { PER_MM } else { PER_DEGREE })
    }

    /// `count` numbers of two registers each, the higher one first.
    fn numbers(&self, at: usize, count: usize) -> impl Iterator<Item = i32> {
        let words = &self.holding[at..at + 2 * count];
        words.chunks_exact(2).map(|w| (u32::from(w[0]) << 16 | u32::from(w[1])) as i32)
    }

    fn pose(&self) -> Vec<f64> {
        self.numbers(holding::POSE, POSE / 2).zip(self.scales()).map(|(n, scale)| f64::from(n) / scale).collect()
    }

    fn name(&self) -> String {
        let words = &self.holding[holding::NAME..holding::SWEEP];
        let bytes = words.iter().flat_map(|w| w.to_be_bytes()).take_while(|b| *b != 0);
        bytes.map(char::from).collect::<String>().trim_end().to_owned()
    }

    /// Puts what a request came to and the session's state into the registers, and ends the request.
    pub fn answer(&mut self, number: u16, said: &std::result::Result<Reply, Wrong>, state: &Reply) {
        self.input[input::ERROR] = said.as_ref().err().map_or(0, |w| w.code as u16);
        let words = said.as_ref().err().map(|wrong| words::plain(&wrong.words)).unwrap_or_default();
        shown::letters(&mut self.input, input::LENGTH, &words);
        self.state(state);
        match said {
            Ok(Reply::Score(score)) => self.input[input::SCORE] = (score * 1000.0).round() as u16,
            _ if !matches!(state, Reply::Found(_)) => self.input[input::SCORE] = 0,
            _ => {}
        }
        // Only a GIVE that succeeded leaves a pose: an old one must not be taken for an answer.
        self.input[input::POSE..input::POSE + POSE].fill(0);
        if let Ok(Reply::Pose(numbers)) = said {
            let units = self.scales();
            shown::numbers(&mut self.input, input::POSE, numbers, units);
        }
        self.input[input::ANSWERED] = number;
        self.input[input::BUSY] = 0;
    }

    /// Puts the session's state into the registers.
    fn state(&mut self, state: &Reply) {
        let (state, shots) = match state {
            Reply::Scanning(shots) => (1, *shots as u16),
            Reply::Found(_) => (2, self.input[input::SHOTS]),
            Reply::Works => (3, 0),
            _ => (0, 0),
        };
        (self.input[input::STATE], self.input[input::SHOTS]) = (state, shots);
    }

    /// Puts what a station does into the registers of jobs, if the table has them.
    pub fn show(&mut self, shown: &Shown, state: &Reply) {
        if self.jobs {
            let units = self.scales();
            shown.put(&mut self.input, units);
            self.state(state);
        }
    }
}

/// Whether poses of a notation have registers.
///
/// # Errors
/// The notation is not of six numbers in mm and degrees.
pub fn has_registers(notation: Convention) -> Result<()> {
    Registers::new(notation, Duration::ZERO, 0, true).map(|_| ())
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
        Registers::new(Convention::Denso, Duration::from_secs(10), answered, false).unwrap()
    }

    fn with_jobs() -> Registers {
        Registers::new(Convention::Denso, Duration::from_secs(10), 0, true).unwrap()
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
        assert_eq!(asked, Asked { number: 1, request: Ok(Request::Pose(told)), from: PLC, by_another: false });
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
    fn a_station_has_further_requests_and_registers() {
        let (mut r, mut plain, now) = (with_jobs(), registers(), Instant::now());
        assert_eq!(r.write(16, &[0x6c65, 0x6400], PLC, now), Ok(None));
        let insert = |r: &mut Registers, number, sweep: [u16; 2]| {
            assert_eq!(r.write(36, &sweep, PLC, now), Ok(None));
            let asked = r.write(0, &[number, 5], PLC, now).unwrap().unwrap();
            r.answer(number, &Ok(Reply::Ordered("0001-insert".into())), &Reply::Works);
            asked.request
        };
        let of = |sweep_mm| Ok(Request::Insert { recipe: "led".into(), sweep_mm });
        assert_eq!(insert(&mut r, 1, [0, 0]), of(None), "0: the program chooses");
        assert_eq!(insert(&mut r, 2, [0, 30_500]), of(Some(30.5)));
        assert_eq!(insert(&mut r, 3, [65535, 65535]), of(Some(-0.001)), "the job refuses it");
        assert_eq!(r.read(4, 2), Ok(vec![0, 3]));
        assert_eq!(r.write(0, &[4, 6], PLC, now).unwrap().unwrap().request, Ok(Request::Stop));
        assert_eq!(r.read(361, 1), Ok(vec![0]));
        assert_eq!((r.read(362, 1), r.write(38, &[1], PLC, now)), (Err(Refused::Address), Err(Refused::Address)));
        let said = plain.write(0, &[1, 5], PLC, now).unwrap().unwrap().request.unwrap_err();
        assert_eq!(said.words, "register 1 is 5; 1 SCAN, 2 POSE, 3 FIND and 4 GIVE are requests");
    }

    #[test]
    fn scans_and_calibrations_name_a_recording_or_the_newest() {
        let (mut r, mut plain, now) = (with_jobs(), registers(), Instant::now());
        let ask = |r: &mut Registers, name: &[u16], values: [u16; 2]| {
            let mut all = [0; 20];
            all[..name.len()].copy_from_slice(name);
            assert_eq!(r.write(16, &all, PLC, now), Ok(None));
            let number = r.read(3, 1).unwrap()[0] + 1;
            let asked = r.write(0, &[number, values[0], values[1]], PLC, now).unwrap().unwrap();
            r.answer(number, &Ok(Reply::Ordered("0001-scan".into())), &Reply::Works);
            asked.request
        };
        // "a/b 1"
        let name = &[0x612f, 0x6220, 0x3100];
        assert_eq!(ask(&mut r, name, [1, 0]), Ok(Request::Scan(Some("a/b 1".into()))));
        assert_eq!(ask(&mut r, &[], [1, 0]), Ok(Request::Scan(None)));
        assert_eq!(ask(&mut r, &[0x4141; 20], [1, 0]), Ok(Request::Scan(Some("A".repeat(40)))));
        for (number, target) in (1..).zip(Target::ALL) {
            assert_eq!((target as u16, ask(&mut r, &[], [7, number])), (number, Ok(Request::Calibrate(target, None))));
        }
        assert_eq!(ask(&mut r, name, [7, 2]), Ok(Request::Calibrate(Target::HandEye, Some("a/b 1".into()))));
        let said = |request: std::result::Result<Request, Wrong>| request.unwrap_err().words;
        for number in [0, 6] {
            let what = format!("register 2 is {number}, 1 to 5 are camera, hand-eye, laser plane, pointer, axis");
            assert_eq!(said(ask(&mut r, &[], [7, number])), what);
        }
        // Which letter a byte above 127 is, nobody has stated.
        assert!(said(ask(&mut r, &[0x61fc], [1, 0])).contains("plain ASCII"));
        assert!(said(ask(&mut r, &[0x0a61], [7, 1])).contains("plain ASCII"));
        assert!(said(ask(&mut r, &[], [8, 0])).ends_with("6 STOP and 7 CALIBRATE are requests"));
        // A robot's own program scans by its motions, whatever stands in the registers of names.
        assert_eq!(ask(&mut plain, name, [1, 0]), Ok(Request::Scan(None)));
        assert!(said(ask(&mut plain, name, [7, 1])).ends_with("3 FIND and 4 GIVE are requests"));
    }

    /// What is shown of a job is no answer to a request, and an answer changes nothing of the job.
    #[test]
    fn jobs_and_answers_have_registers_of_their_own() {
        let (mut r, now) = (with_jobs(), Instant::now());
        r.write(0, &[1, 4], PLC, now).unwrap().unwrap();
        let shown = Shown { ended: 7, ..Shown::default() };
        r.show(&shown, &Reply::Works);
        assert_eq!((r.read(2, 4), r.read(129, 1)), (Ok(vec![1, 0, 0, 3]), Ok(vec![7])));
        r.answer(1, &Ok(Reply::Pose(vec![1.0; 6])), &Reply::Found("led".into()));
        assert_eq!((r.read(2, 4), r.read(129, 1)), (Ok(vec![0, 1, 0, 2]), Ok(vec![7])));
        r.show(&Shown::default(), &Reply::Found("led".into()));
        assert_eq!((r.read(8, 2), r.read(129, 1)), (Ok(vec![0, 1000]), Ok(vec![0])));
    }

    #[test]
    fn poses_in_other_units_are_refused() {
        for other in [Convention::Ur, Convention::Abb, Convention::Matrix] {
            let said = Registers::new(other, Duration::ZERO, 0, false).err().unwrap();
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
