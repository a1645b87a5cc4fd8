//! In: registers that were read from a station, as docs/connections.md lists them. Out: what they say; the registers
//! of a request. Pure.
//! Frame and unit: mm, degrees; a pose is six numbers in the station's notation.

/// Number of the table that is understood.
pub const TABLE: u16 = 1;
/// Registers that are read together: answers, jobs, the words of a job's error.
pub const ANSWERS: (u16, u16) = (0, 121);
pub const JOBS: (u16, u16) = (121, 33);
pub const WORDS: (u16, u16) = (154, 101);
/// What a scan or calibration made of its recording. The first programs of stations have none of these.
pub const MADE: (u16, u16) = (255, 107);
/// Requests whose jobs make something of a recording.
const SCAN: u16 = 1;
const CALIBRATE: u16 = 7;
const PER_MM: f64 = 1000.0;
const PER_DEGREE: f64 = 10_000.0;
const PER_SIGMA: f64 = 10_000.0;
/// A standard deviation that is unknown or greater than 6.5.
const UNKNOWN: u16 = u16::MAX;

/// Names of the gates by their bit.
const GATES: [&str; 21] = [
    "score",
    "margin",
    "coverage",
    "agreement",
    "edges seen",
    "edges crossed",
    "sigma_mm",
    "sigma_deg",
    "disagreement_mm",
    "points that tell the turn",
    "turn told",
    "sizes' ratio",
    "range's ratio",
    "number of looks",
    "looks' ratio",
    "looks' misfit",
    "looks' turn_deg",
    "looks' tilt_deg",
    "unseen in plane, mm",
    "unseen height, mm",
    "unseen turn, deg",
];

/// The phases of an insertion by their number; 0 has no name.
const PHASES: [&str; 9] = ["", "touch", "scan", "find", "approach", "insert", "retract", "inserted", "backed out"];

/// Target of a calibration, with its number in the registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    Camera = 1,
    HandEye = 2,
    LaserPlane = 3,
    Pointer = 4,
    Axis = 5,
}

impl Target {
    /// All of them, in the order of their numbers.
    pub const ALL: [Target; 5] = [Target::Camera, Target::HandEye, Target::LaserPlane, Target::Pointer, Target::Axis];

    /// In letters, digits and _.
    pub fn word(self) -> &'static str {
        match self {
            Target::Camera => "camera",
            Target::HandEye => "hand_eye",
            Target::LaserPlane => "laser_plane",
            Target::Pointer => "pointer",
            Target::Axis => "axis",
        }
    }
}

/// Verdict of a calibration, by its number in the registers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verdict {
    /// No calibration has ended, or the station states a verdict that this program does not know.
    #[default]
    None,
    Good,
    Usable,
    BadlyDetermined,
    Refused,
}

impl Verdict {
    fn of(number: u16) -> Verdict {
        use Verdict::{BadlyDetermined, Good, Refused, Usable};
        [Verdict::None, Good, Usable, BadlyDetermined, Refused].get(usize::from(number)).copied().unwrap_or_default()
    }

    /// Whether a person may accept such a calibration.
    pub fn is_acceptable(self) -> bool {
        matches!(self, Verdict::Good | Verdict::Usable)
    }

    /// As a word.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::None => "none",
            Verdict::Good => "good",
            Verdict::Usable => "usable",
            Verdict::BadlyDetermined => "badly determined",
            Verdict::Refused => "refused",
        }
    }
}

/// What a station is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Scan the recording of this name, or the newest one; where the client moves the robot, begin a scan by its own
    /// motions.
    Scan(Option<String>),
    /// The flange stands here: take a picture.
    Pose([f64; 6]),
    /// Find the part of a recipe.
    Find(String),
    /// Give a pose of the tool: 0 approach, 1 insertion, 2 retract.
    Give(u16),
    /// Insert the part of a recipe; length of the sweep in mm, if it is not the program's choice.
    Insert(String, Option<f64>),
    /// Stop what runs.
    Stop,
    /// Calibrate from the recording of this name, or from the newest one. A person accepts the result at the screen.
    Calibrate(Target, Option<String>),
}

/// An answer to a request.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// 0, or the number of the error.
    pub error: u16,
    /// Its words.
    pub words: String,
    /// The pose of a GIVE.
    pub pose: [f64; 6],
    /// Number of shots of a scan.
    pub shots: u16,
    /// Score of the found part, 0 to 1.
    pub score: f64,
}

/// State of a job.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    #[default]
    None,
    Waits,
    Runs,
    Done,
    Failed,
    Stopped,
    CutOff,
}

impl Stage {
    fn of(number: u16) -> Stage {
        use Stage::{CutOff, Done, Failed, Runs, Stopped, Waits};
        [Stage::None, Waits, Runs, Done, Failed, Stopped, CutOff].get(usize::from(number)).copied().unwrap_or_default()
    }

    /// Whether such a job waits or runs.
    pub fn is_under_way(self) -> bool {
        matches!(self, Stage::Waits | Stage::Runs)
    }

    /// Whether such a job has ended.
    pub fn is_over(self) -> bool {
        !self.is_under_way() && self != Stage::None
    }

    /// As a word.
    pub fn word(self) -> &'static str {
        match self {
            Stage::None => "none",
            Stage::Waits => "waits",
            Stage::Runs => "runs",
            Stage::Done => "done",
            Stage::Failed => "failed",
            Stage::Stopped => "stopped",
            Stage::CutOff => "cut off",
        }
    }
}

/// The job that a station shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Job {
    /// Its number.
    pub number: u32,
    pub stage: Stage,
    /// The request that makes such a job.
    pub procedure: u16,
    /// Name of its phase.
    pub phase: &'static str,
    /// Name of the phase whose motion waits for a person.
    pub asks: &'static str,
    /// 0, or the number of its error.
    pub error: u16,
    /// Words of its error.
    pub words: String,
    /// 0 not found, 1 found, 2 a gate was missed.
    pub found: u16,
    /// Names of the gates that were judged, and of those that passed.
    pub judged: Vec<&'static str>,
    pub passed: Vec<&'static str>,
    /// The tool's insertion pose.
    pub pose: [f64; 6],
    /// Standard deviations in mm along x, y, z and in degrees about them; infinite if unknown.
    pub sigma: [f64; 6],
    /// Score of the found part, 0 to 1.
    pub score: f64,
    /// Path of the recording of a scan or calibration; empty of other jobs.
    pub recording: String,
    /// Shots and points of a finished scan.
    pub shots: u32,
    pub points: u32,
    /// Number of the calibration's target; 0 of other jobs.
    pub target: u16,
    /// Verdict of a finished calibration.
    pub verdict: Verdict,
}

/// The robot, by the bits of its register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Robot {
    pub linked: bool,
    pub armed: bool,
    pub attended: bool,
    pub moves: bool,
    pub look: bool,
}

/// What a station shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// It runs jobs; without jobs the client moves the robot.
    pub jobs: bool,
    pub robot: Robot,
    pub job: Job,
    /// Jobs that ended, and components that were inserted, since the station's start.
    pub ended: u16,
    pub inserted: u16,
}

/// A number of two registers, high word first.
fn word(registers: &[u16], at: usize) -> u32 {
    u32::from(registers[at]) << 16 | u32::from(registers[at + 1])
}

/// A signed number of two registers.
fn number(registers: &[u16], at: usize) -> f64 {
    f64::from(word(registers, at) as i32)
}

fn pose(registers: &[u16], at: usize) -> [f64; 6] {
    std::array::from_fn(|k| number(registers, at + 2 * k) / if k < 3 { PER_MM } else { PER_DEGREE })
}

/// Words behind their length; none of no registers.
fn letters(registers: &[u16]) -> String {
    let Some((length, registers)) = registers.split_first() else { return String::new() };
    let bytes = registers.iter().flat_map(|r| r.to_be_bytes()).take(usize::from(*length));
    bytes.map(|b| if b.is_ascii_graphic() || b == b' ' { char::from(b) } else { '?' }).collect()
}

/// The names of the bits of two registers.
fn gates(registers: &[u16], at: usize) -> Vec<&'static str> {
    let bits = word(registers, at);
    let named = (0..32).filter(|k| bits >> k & 1 == 1);
    named.map(|k| GATES.get(k).copied().unwrap_or("another gate")).collect()
}

/// The answer in registers 0 to 120.
pub fn answer(r: &[u16]) -> Answer {
    Answer { error: r[4], words: letters(&r[20..]), pose: pose(r, 8), shots: r[6], score: f64::from(r[7]) / 1000.0 }
}

/// Whether the job of these registers makes something of a recording.
pub fn makes(jobs: &[u16]) -> bool {
    matches!(jobs[6], SCAN | CALIBRATE)
}

/// What registers 121 to 153 say, beside those from 0, the words from 154 on, and what was made of a recording; both
/// are empty if they were not read.
pub fn seen(answers: &[u16], jobs: &[u16], words: &[u16], made: &[u16]) -> Seen {
    let made = if made.is_empty() { &[0; MADE.1 as usize] } else { made };
    let name = |k: u16| PHASES.get(usize::from(k)).copied().unwrap_or("another phase");
    let on = |bit: usize| jobs[0] >> bit & 1 == 1;
    let sigma = |k: usize| match jobs[27 + k] {
        UNKNOWN => f64::INFINITY,
        x => f64::from(x) / PER_SIGMA,
    };
    let job = Job {
        number: word(jobs, 4),
        stage: Stage::of(jobs[1]),
        procedure: jobs[6],
        phase: name(jobs[2]),
        asks: name(jobs[3]),
        error: jobs[7],
        words: letters(words),
        found: jobs[10],
        judged: gates(jobs, 11),
        passed: gates(jobs, 13),
        pose: pose(jobs, 15),
        sigma: std::array::from_fn(sigma),
        score: f64::from(answers[7]) / 1000.0,
        recording: letters(&made[6..]),
        shots: word(made, 2),
        points: word(made, 4),
        target: made[0],
        verdict: Verdict::of(made[1]),
    };
    let robot = Robot { linked: on(0), armed: on(1), attended: on(2), moves: on(3), look: on(4) };
    Seen { jobs: true, robot, job, ended: jobs[8], inserted: jobs[9] }
}

/// Whether the text is HOST:PORT, with a port that can be reached.
pub fn is_address(text: &str) -> bool {
    let port = text.rsplit_once(':').filter(|(host, _)| !host.is_empty()).and_then(|(_, p)| p.parse::<u16>().ok());
    port.is_some_and(|port| port > 0)
}

/// Whether a recipe's name can be written into the registers: 1 to 40 letters, digits, - and _.
pub fn is_name(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    (1..=40).contains(&name.len()) && name.chars().all(plain)
}

/// Whether a recording's path can be written into the registers: 1 to 40 plain characters. The station decides whether
/// it is one.
pub fn is_recording(path: &str) -> bool {
    (1..=40).contains(&path.len()) && path.bytes().all(|b| b.is_ascii_graphic() || b == b' ')
}

fn two(number: f64) -> [u16; 2] {
    // A number out of range becomes the nearest one there is, which the station refuses.
    let number = number.round() as i32 as u32;
    [(number >> 16) as u16, number as u16]
}

impl Ask {
    /// Whether a station that runs jobs needs the registers of scans and calibrations for it.
    pub fn makes(&self) -> bool {
        matches!(self, Ask::Scan(_) | Ask::Calibrate(..))
    }

    /// The registers from 1 on that make this request.
    pub fn registers(&self) -> Vec<u16> {
        let named = |word: u16, name: &str| {
            let mut out = vec![0; 37];
            out[0] = word;
            for (to, two) in out[15..35].iter_mut().zip(name.as_bytes().chunks(2)) {
                *to = u16::from_be_bytes([two[0], two.get(1).copied().unwrap_or(0)]);
            }
            out
        };
        // Without jobs the table ends before the sweep. A name of before is not left there.
        let recorded = |word: u16, target: u16, name: &Option<String>| {
            let mut out = named(word, name.as_deref().unwrap_or_default())[..35].to_vec();
            out[1] = target;
            out
        };
        match self {
            Ask::Scan(name) => recorded(SCAN, 0, name),
            Ask::Calibrate(target, name) => recorded(CALIBRATE, *target as u16, name),
            Ask::Pose(pose) => {
                let scaled = |(k, x): (usize, &f64)| two(x * if k < 3 { PER_MM } else { PER_DEGREE });
                [2, 0, 0].into_iter().chain(pose.iter().enumerate().flat_map(scaled)).collect()
            }
            Ask::Find(name) => named(3, name)[..35].to_vec(),
            Ask::Give(which) => vec![4, *which, 0],
            Ask::Insert(name, sweep_mm) => {
                let mut out = named(5, name);
                out[35..].copy_from_slice(&two(sweep_mm.unwrap_or(0.0) * PER_MM));
                out
            }
            Ask::Stop => vec![6],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_is_read_as_the_table_has_it() {
        let mut jobs = vec![0u16; 33];
        let row = [0b11011, 2, 5, 5, 1, 4465, 5, 13, 3, 2, 1, 0, 0b100_0001, 0, 1, 4, 37856, 65535, 45536];
        jobs[..19].copy_from_slice(&row);
        jobs[27..33].copy_from_slice(&[213, 65535, 65535, 500, 65535, 0]);
        let mut answers = vec![0u16; 121];
        answers[7] = 913;
        let seen = seen(&answers, &jobs, &[7, 0x6e6f, 0x2072, 0x6f6f, 0x6d00], &[]);
        assert_eq!(seen.robot, Robot { linked: true, armed: true, attended: false, moves: true, look: true });
        let job = &seen.job;
        assert_eq!((job.number, job.stage, job.phase, job.asks), (70_001, Stage::Runs, "insert", "insert"));
        assert_eq!((job.procedure, job.error, job.words.as_str(), job.found), (5, 13, "no room", 1));
        assert_eq!((seen.ended, seen.inserted), (3, 2));
        assert_eq!((job.judged.clone(), job.passed.clone()), (vec!["score", "sigma_mm"], vec!["score"]));
        assert_eq!((job.pose[0], job.pose[1], job.score), (300.0, -20.0, 0.913));
        assert_eq!(job.sigma, [0.0213, f64::INFINITY, f64::INFINITY, 0.05, f64::INFINITY, 0.0]);
    }

    #[test]
    fn requests_are_written_as_the_table_has_them() {
        let insert = Ask::Insert("led".into(), Some(30.5)).registers();
        assert_eq!((insert[0], &insert[15..17], &insert[35..]), (5, &[0x6c65, 0x6400][..], &[0, 30_500][..]));
        assert_eq!(Ask::Find("led".into()).registers().len(), 35);
        let pose = Ask::Pose([300.0, -20.0, 420.0, 180.0, -0.0001, 90.0]).registers();
        assert_eq!(pose[3..], [4, 37856, 65535, 45536, 6, 26784, 27, 30528, 65535, 65535, 13, 48032]);
        assert_eq!(Ask::Give(2).registers(), [4, 2, 0]);
        let scan = Ask::Scan(Some("a/b".into())).registers();
        assert_eq!((scan.len(), &scan[..2], &scan[15..18]), (35, &[1, 0][..], &[0x612f, 0x6200, 0][..]));
        assert_eq!(Ask::Scan(None).registers()[15..], [0; 20], "the newest, whatever was named before");
        let plane = Ask::Calibrate(Target::LaserPlane, Some("a".into())).registers();
        assert_eq!((plane.len(), &plane[..3], plane[15]), (35, &[7, 3, 0][..], 0x6100));
        assert_eq!(Target::ALL.map(|t| t as u16), [1, 2, 3, 4, 5]);
        assert!(is_recording("a b/c(1)") && !is_recording("") && !is_recording("\u{fc}"));
        assert!(is_recording(&"x".repeat(40)) && !is_recording(&"x".repeat(41)) && !is_recording("a\0b"));
        assert!(is_name("led-2_b") && !is_name("../led") && !is_name("") && !is_name(&"x".repeat(41)));
    }

    #[test]
    fn what_was_made_of_a_recording_is_read_behind_the_rest() {
        let mut jobs = vec![0u16; 33];
        let read = |jobs: &[u16], made: &[u16]| seen(&[0; 121], jobs, &[], made).job;
        (jobs[1], jobs[6]) = (3, 1);
        let mut made = vec![0u16; 107];
        made[..9].copy_from_slice(&[0, 0, 0, 70, 1, 4465, 3, 0x612f, 0x6200]);
        let job = read(&jobs, &made);
        assert_eq!((job.shots, job.points, job.recording.as_str()), (70, 70_001, "a/b"));
        assert_eq!((job.target, job.verdict), (0, Verdict::None));
        for (number, verdict) in (1..).zip([Verdict::Good, Verdict::Usable, Verdict::BadlyDetermined, Verdict::Refused])
        {
            made[..2].copy_from_slice(&[4, number]);
            let job = read(&jobs, &made);
            assert_eq!((job.target, job.verdict, job.verdict.is_acceptable()), (4, verdict, number < 3));
        }
        let none = read(&jobs, &[]);
        assert_eq!((none.shots, none.recording.as_str(), none.verdict), (0, "", Verdict::None));
        assert!(makes(&jobs));
        jobs[6] = 5;
        assert!(!makes(&jobs) && Ask::Scan(None).makes() && !Ask::Stop.makes());
    }

    /// A station may show numbers that this program does not know yet.
    #[test]
    fn unknown_numbers_are_no_fault() {
        let all = vec![u16::MAX; 121];
        let seen = seen(&all, &all[..33], &all[..101], &all[..107]);
        assert_eq!((seen.job.phase, seen.job.stage), ("another phase", Stage::None));
        assert_eq!((seen.job.judged.len(), seen.job.words.len()), (32, 200));
        assert_eq!((seen.job.verdict, seen.job.target, seen.job.recording.len()), (Verdict::None, u16::MAX, 200));
    }
}
