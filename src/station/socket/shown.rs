//! In: what a station does: its robot, its job, the part that was found. Out: the registers that show it. Pure;
//! table.rs has their addresses.
//! Frame and unit: 1/1000 mm and 1/10,000 degree; standard deviations in 1/10,000 mm.

use super::part::Part;
use super::table::{GATES, OTHER_GATE, PER_SIGMA, POSE, WORDS, input, two};
use super::words::{self, Target, Wrong};
use crate::rig::Verdict;
use crate::station::job::Phase;

/// The robot, as the screen knows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RobotShown {
    /// Its controller answers.
    pub linked: bool,
    /// A person armed it from a screen.
    pub armed: bool,
    /// That screen operates.
    pub attended: bool,
    /// A confirmed motion is under way.
    pub moves: bool,
    /// A person has to look at it before it moves again.
    pub look: bool,
}

/// State of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// It waits for its turn.
    Waits = 1,
    /// It runs.
    Runs = 2,
    /// It ended with its result.
    Done = 3,
    /// It ended with an error.
    Failed = 4,
    /// It was stopped.
    Stopped = 5,
    /// The program ended while it ran.
    CutOff = 6,
}

/// The job that the registers show.
#[derive(Clone, Debug, PartialEq)]
pub struct JobShown {
    /// Its number.
    pub number: u32,
    /// The request that makes such a job.
    pub procedure: u16,
    /// Its state.
    pub stage: Stage,
    /// Its phase; `None` before its first one, and for a job that moves nothing.
    pub phase: Option<Phase>,
    /// The phase whose motion waits for a person's confirmation.
    pub asks: Option<Phase>,
    /// Why it ended early.
    pub error: Option<Wrong>,
    /// The part that it found, and its insertion pose in the notation of the registers.
    pub part: Option<(Part, Option<Vec<f64>>)>,
    /// What it makes of a recording, of a scan or calibration.
    pub made: Option<Made>,
}

/// A scan or a calibration from a recording, and what came of it; zeros and `None` before its end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Made {
    /// Path of the recording below the recordings' folder.
    pub recording: String,
    /// What is calibrated.
    pub target: Option<Target>,
    /// The calibration's verdict.
    pub verdict: Option<Verdict>,
    /// Shots of the scan.
    pub shots: usize,
    /// Its points.
    pub points: u64,
}

/// All that the registers show of a station.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// The robot.
    pub robot: RobotShown,
    /// The job that runs, or the last one.
    pub job: Option<JobShown>,
    /// Jobs that ended since the start.
    pub ended: u16,
    /// Components that were inserted since the start.
    pub inserted: u16,
}

/// Number of a phase.
fn number(phase: Phase) -> u16 {
    match phase {
        Phase::Touch => 1,
        Phase::Scan => 2,
        Phase::Find => 3,
        Phase::Approach => 4,
        Phase::Insert => 5,
        Phase::Retract => 6,
        Phase::Done => 7,
        Phase::BackedOut => 8,
    }
}

/// Number of a verdict.
fn verdict(verdict: Verdict) -> u16 {
    match verdict {
        Verdict::Good => 1,
        Verdict::Usable => 2,
        Verdict::BadlyDetermined => 3,
        Verdict::Refused => 4,
    }
}

/// Bits of the gates that were judged, and of those that passed.
fn bits(gates: &[(String, bool)]) -> [u32; 2] {
    let bit = |name: &str| 1 << GATES.iter().position(|g| *g == name).map_or(OTHER_GATE, |k| k as u32);
    let judged = gates.iter().fold(0, |bits, (name, _)| bits | bit(name));
    // A gate that is judged twice has passed if it passed both times.
    let missed = gates.iter().filter(|(_, passed)| !passed).fold(0, |bits, (name, _)| bits | bit(name));
    [judged, judged & !missed]
}

impl Shown {
    /// Writes it into the registers; `units` of the pose's numbers in a mm or a degree.
    pub(super) fn put(&self, to: &mut [u16], units: impl Iterator<Item = f64>) {
        let RobotShown { linked, armed, attended, moves, look } = self.robot;
        let robot = [linked, armed, attended, moves, look];
        to[input::ROBOT..input::COUNT_WITH_JOBS].fill(0);
        to[input::ROBOT] = robot.iter().enumerate().map(|(k, on)| u16::from(*on) << k).sum();
        (to[input::ENDED], to[input::INSERTED], to[input::SCORE]) = (self.ended, self.inserted, 0);
        let Some(job) = &self.job else { return };
        to[input::JOB_STATE] = job.stage as u16;
        to[input::STEP] = job.phase.map_or(0, number);
        to[input::ASKS] = job.asks.map_or(0, number);
        to[input::JOB..input::JOB + 2].copy_from_slice(&two(job.number));
        to[input::PROCEDURE] = job.procedure;
        if let Some(wrong) = &job.error {
            to[input::JOB_ERROR] = wrong.code as u16;
            letters(to, input::JOB_LENGTH, &words::plain(&wrong.words));
        }
        if let Some(made) = &job.made {
            made.put(to);
        }
        let Some((part, pose)) = &job.part else { return };
        to[input::FOUND] = if pose.is_some() { 1 } else { 2 };
        to[input::SCORE] = (part.score * 1000.0).round() as u16;
        let [judged, passed] = bits(&part.gates);
        to[input::GATES..input::GATES + 2].copy_from_slice(&two(judged));
        to[input::GATES_PASSED..input::GATES_PASSED + 2].copy_from_slice(&two(passed));
        if let Some(pose) = pose {
            numbers(to, input::INSERTION, pose, units);
        }
        for (to, sigma) in to[input::SIGMA..].iter_mut().zip(part.sigma_mm.iter().chain(&part.sigma_deg)) {
            // What is greater, or not known, is the greatest number.
            *to = if sigma.is_nan() { u16::MAX } else { (sigma * PER_SIGMA).round() as u16 };
        }
    }
}

impl Made {
    fn put(&self, to: &mut [u16]) {
        // More than the registers hold is the greatest number.
        let counted = |n: u64| two(n.try_into().unwrap_or(u32::MAX));
        to[input::TARGET] = self.target.map_or(0, |target| target as u16);
        to[input::VERDICT] = self.verdict.map_or(0, verdict);
        to[input::SCANNED..input::SCANNED + 2].copy_from_slice(&counted(self.shots as u64));
        to[input::POINTS..input::POINTS + 2].copy_from_slice(&counted(self.points));
        letters(to, input::RECORDING_LENGTH, &words::plain(&self.recording));
    }
}

/// Writes the numbers of a pose.
pub(super) fn numbers(to: &mut [u16], at: usize, pose: &[f64], units: impl Iterator<Item = f64>) {
    for ((words, x), unit) in to[at..at + POSE].chunks_exact_mut(2).zip(pose).zip(units) {
        words.copy_from_slice(&two((x * unit).round() as i32 as u32));
    }
}

/// Writes words: their length, then two characters a register.
pub(super) fn letters(to: &mut [u16], at: usize, words: &str) {
    let room = &mut to[at + 1..at + 1 + WORDS];
    room.fill(0);
    for (to, two) in room.iter_mut().zip(words.as_bytes().chunks(2)) {
        *to = u16::from_be_bytes([two[0], two.get(1).copied().unwrap_or(0)]);
    }
    to[at] = words.len() as u16;
}

#[cfg(test)]
mod tests {
    use super::super::words::Code;
    use super::*;

    #[test]
    fn gates_are_bits_and_one_without_a_name_is_the_last() {
        let gate = |name: &str, passed| (name.to_owned(), passed);
        assert_eq!(bits(&[gate("score", true), gate("coverage", false)]), [0b101, 0b001]);
        assert_eq!(bits(&[gate("another", true)]), [1 << 31, 1 << 31]);
        assert_eq!(bits(&[gate("margin", true), gate("margin", false)]), [0b10, 0]);
        assert_eq!(bits(&[]), [0, 0]);
    }

    #[test]
    fn a_job_is_shown_whole_and_nothing_of_it_stays() {
        let mut to = vec![0; input::COUNT_WITH_JOBS];
        let units = || [1000.0, 1000.0, 1000.0, 10_000.0, 10_000.0, 10_000.0].into_iter();
        let part = Part {
            recipe: "osc".into(),
            frame: "base".into(),
            score: 0.9126,
            gates: vec![("score".into(), true), ("sigma_mm".into(), true)],
            sigma_mm: [0.0213, 7.0, f64::INFINITY],
            sigma_deg: [0.05, f64::NAN, 0.0],
            reasons: vec![],
            poses: None,
        };
        let job = JobShown {
            number: 70_001,
            procedure: 5,
            stage: Stage::Runs,
            phase: Some(Phase::Insert),
            asks: Some(Phase::Insert),
            error: Some(Wrong::new(Code::Full, "no room")),
            part: Some((part, Some(vec![300.0, -20.0, 420.0, 180.0, -0.0001, 90.0]))),
            made: None,
        };
        let robot = RobotShown { linked: true, armed: true, attended: false, moves: true, look: true };
        Shown { robot, job: Some(job), ended: 3, inserted: 2 }.put(&mut to, units());
        assert_eq!(to[121..132], [0b11011, 2, 5, 5, 1, 4465, 5, 13, 3, 2, 1]);
        assert_eq!(to[132..136], [0, 0b100_0001, 0, 0b100_0001]);
        assert_eq!(to[136..148], [4, 37856, 65535, 45536, 6, 26784, 27, 30528, 65535, 65535, 13, 48032]);
        assert_eq!(to[148..154], [213, 65535, 65535, 500, 65535, 0]);
        assert_eq!((to[154], &to[155..159]), (7, &[0x6e6f, 0x2072, 0x6f6f, 0x6d00][..]));
        assert_eq!(to[7], 913);
        Shown::default().put(&mut to, units());
        assert!(to.iter().all(|x| *x == 0), "{to:?}");
    }

    #[test]
    fn what_a_job_makes_of_a_recording_stands_behind_the_rest() {
        let shown = |made: Made, procedure: u16| {
            let mut to = vec![0; input::COUNT_WITH_JOBS];
            let job = JobShown {
                number: 3,
                procedure,
                stage: Stage::Done,
                phase: None,
                asks: None,
                error: None,
                part: None,
                made: Some(made),
            };
            Shown { job: Some(job), ..Shown::default() }.put(&mut to, std::iter::empty());
            assert_eq!(to[121..129], [0, 3, 0, 0, 0, 3, procedure, 0]);
            assert!(to[129..255].iter().all(|x| *x == 0), "{to:?}");
            to[255..].to_vec()
        };
        let scan = Made { recording: "a/b\u{fc}".into(), shots: 70, points: 70_001, ..Made::default() };
        let to = shown(scan, 1);
        assert_eq!(to[..9], [0, 0, 0, 70, 1, 4465, 4, 0x612f, 0x623f]);
        let of = |target, verdict| {
            let made = Made { target: Some(target), verdict, points: 1 << 40, ..Made::default() };
            shown(made, 7)[..6].to_vec()
        };
        assert_eq!(of(Target::LaserPlane, Some(Verdict::BadlyDetermined)), [3, 3, 0, 0, u16::MAX, u16::MAX]);
        let numbers = [Verdict::Good, Verdict::Usable, Verdict::BadlyDetermined, Verdict::Refused]
            .map(|v| of(Target::Axis, Some(v))[1]);
        assert_eq!((numbers, of(Target::Axis, None)[..2].to_vec()), ([1, 2, 3, 4], vec![5, 0]));
        let long = shown(Made { recording: "x".repeat(300), ..Made::default() }, 1);
        assert_eq!((long[6], long.len(), long[106]), (200, 107, 0x7878));
    }
}
