//! In: a line from a robot's program. Out: its request, or the error in it; answers as lines. Pure.
//! Frame and unit: the numbers of a pose in its notation.

use crate::robot::Convention;

/// Most bytes of a request without its line end; controllers' own strings are shorter.
pub const MOST_BYTES: usize = 512;
/// Most characters of an answer: FANUC's and Denso's strings are hardly longer. A full matrix is longer.
const MOST_WORDS: usize = 200;

/// A request of a robot's program.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Asks for program and notation.
    Hello,
    /// Asks for the state of the session.
    Status,
    /// Begins a scan; an earlier result is discarded. Of a station that runs jobs: scans the recording of this name,
    /// or the newest one.
    Scan(Option<String>),
    /// The flange stands at this pose and the line is on: take the picture.
    Pose(Vec<f64>),
    /// The scan is complete: find the part of that recipe.
    Find(String),
    /// Asks for a pose of the found part.
    Give(Which, Of),
    /// Orders an insertion by a station that moves the robot itself; only over registers.
    Insert {
        /// The recipe.
        recipe: String,
        /// Length of the sweep, mm; `None`: the program chooses it.
        sweep_mm: Option<f64>,
    },
    /// Stops what the station does; only over registers.
    Stop,
    /// Orders a calibration from a recording, or from the newest one; only over registers of a station that runs jobs.
    Calibrate(Target, Option<String>),
    /// Ends the connection.
    Bye,
}

/// What a request came to.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// The program and its notation.
    Hello,
    /// No scan was begun.
    Idle,
    /// A scan with this many shots was begun.
    Scanning(usize),
    /// The part of this recipe was found.
    Found(String),
    /// Number of shots of the scan.
    Shots(usize),
    /// Score of the found part, 0 to 1.
    Score(f64),
    /// A pose in the session's notation.
    Pose(Vec<f64>),
    /// A job of this name was ordered.
    Ordered(String),
    /// A job runs.
    Works,
    /// What ran or waited was stopped.
    Stopped,
    /// The connection ends.
    Bye,
}

/// Which pose of an insertion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// Above the insertion pose.
    Approach,
    /// The insertion pose itself.
    Insertion,
    /// Back above it.
    Retract,
}

/// What a pose belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// The inserting tool that the controller has selected.
    Tool,
    /// The flange: tool 0.
    Flange,
}

/// Target of a calibration, with its number in the registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Camera and lens.
    Camera = 1,
    /// Pose of the camera on the flange.
    HandEye = 2,
    /// The laser plane.
    LaserPlane = 3,
    /// The pointer's beam.
    Pointer = 4,
    /// A linear axis or turntable.
    Axis = 5,
}

impl Target {
    /// All of them, in the order of their numbers.
    pub const ALL: [Target; 5] = [Target::Camera, Target::HandEye, Target::LaserPlane, Target::Pointer, Target::Axis];
}

/// Why a request is not executed; the answer contains the number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Unknown word.
    Word = 1,
    /// Numbers that are not a pose.
    Numbers = 2,
    /// Not possible now: no scan was begun, or nothing was found.
    Order = 3,
    /// The part was not found, or not well enough.
    Refused = 4,
    /// A fault on our side, for example no picture or a full disk.
    Failed = 5,
    /// Another robot is connected, or a job runs or waits.
    Busy = 6,
    /// A line that is too long.
    Long = 7,
    /// Nothing was received for too long.
    Late = 8,
    /// The robot of a station is not armed.
    Unarmed = 9,
    /// No screen operates, or not the one that armed the robot.
    Unattended = 10,
    /// A person has to look at the robot first.
    Look = 11,
    /// STOP was pressed, or the job was ended.
    Stopped = 12,
    /// A result could not be written.
    Full = 13,
    /// The station or the request lacks something, or contradicts itself.
    Station = 14,
    /// The program ended while the job ran.
    CutOff = 15,
}

/// An error in a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wrong {
    /// Its code.
    pub code: Code,
    /// In words.
    pub words: String,
}

impl Wrong {
    /// A refusal.
    pub fn new(code: Code, words: impl Into<String>) -> Wrong {
        Wrong { code, words: words.into() }
    }
}

/// Reads a request. Words may be in lower case. Numbers may be separated by blanks, commas, semicolons or the
/// brackets that UR and ABB write around their poses (`p[0.1, ...]`, `[1,2,3],[...]`).
///
/// # Errors
/// The error in a few words.
pub fn read(line: &str) -> Result<Request, Wrong> {
    let line = line.trim();
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let rest = rest.trim();
    let alone = |request: Request| match rest {
        "" => Ok(request),
        _ => Err(Wrong::new(Code::Word, format!("{} stands alone, '{}' follows it", word.to_uppercase(), shown(rest)))),
    };
    match word.to_ascii_uppercase().as_str() {
        "HELLO" => alone(Request::Hello),
        "STATUS" => alone(Request::Status),
        "SCAN" => alone(Request::Scan(None)),
        "BYE" => alone(Request::Bye),
        "POSE" => numbers(rest).map(Request::Pose),
        "FIND" => recipe(rest).map(Request::Find),
        "GIVE" => give(rest),
        "" => Err(Wrong::new(Code::Word, "an empty line")),
        _ => Err(Wrong::new(
            Code::Word,
            format!("'{}' is not a word; HELLO, STATUS, SCAN, POSE, FIND, GIVE and BYE are", shown(word)),
        )),
    }
}

fn numbers(text: &str) -> Result<Vec<f64>, Wrong> {
    let text = text.strip_prefix("p[").unwrap_or(text);
    let parts = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '[' | ']' | '(' | ')');
    let read = |word: &str| match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(Wrong::new(Code::Numbers, format!("'{}' is not a number", shown(word)))),
    };
    text.split(parts).filter(|w| !w.is_empty()).map(read).collect()
}

/// A recipe's name becomes a file name: letters, digits, - and _ only.
///
/// # Errors
/// Another name.
pub fn recipe(name: &str) -> Result<String, Wrong> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    if (1..=40).contains(&name.len()) && name.chars().all(plain) {
        return Ok(name.to_owned());
    }
    Err(Wrong::new(
        Code::Word,
        format!("'{}' is not a recipe's name: 1 to 40 letters, digits, - and _ are", shown(name)),
    ))
}

/// A recording's path in registers; none if it is empty. What such a path may be is decided where the folder is known.
///
/// # Errors
/// Characters whose encoding registers do not state.
pub fn recording(name: &str) -> Result<Option<String>, Wrong> {
    if !name.chars().all(|c| c.is_ascii_graphic() || c == ' ') {
        let what = format!("'{}' is not a recording's name in registers: plain ASCII characters are", shown(name));
        return Err(Wrong::new(Code::Word, what));
    }
    Ok((!name.is_empty()).then(|| name.to_owned()))
}

fn give(rest: &str) -> Result<Request, Wrong> {
    let lower = rest.to_ascii_lowercase();
    let mut words = lower.split_whitespace();
    let which = match words.next() {
        Some("approach") => Which::Approach,
        Some("insertion") => Which::Insertion,
        Some("retract") => Which::Retract,
        other => {
            let what = format!("GIVE approach, insertion or retract, not '{}'", shown(other.unwrap_or("")));
            return Err(Wrong::new(Code::Word, what));
        }
    };
    match (words.next(), words.next()) {
        (None | Some("tool"), None) => Ok(Request::Give(which, Of::Tool)),
        (Some("flange"), None) => Ok(Request::Give(which, Of::Flange)),
        (other, _) => {
            Err(Wrong::new(Code::Word, format!("a pose is of tool or flange, not of '{}'", shown(other.unwrap_or("")))))
        }
    }
}

/// Received text in printable form, cut to 24 characters.
fn shown(text: &str) -> String {
    text.chars().take(24).map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' }).collect()
}

/// A positive answer, without its line end.
pub fn yes(reply: &Reply, notation: Convention) -> String {
    let words = match reply {
        Reply::Hello => format!("sheetlight 1 {}", notation.name()),
        Reply::Idle => "idle".into(),
        Reply::Scanning(shots) => format!("scanning {shots}"),
        Reply::Found(recipe) => format!("found {recipe}"),
        Reply::Shots(shots) => shots.to_string(),
        Reply::Score(score) => format!("{score:.3}"),
        Reply::Pose(numbers) => pose(notation, numbers),
        Reply::Ordered(job) => format!("ordered {job}"),
        Reply::Works => "works".into(),
        Reply::Stopped => "stopped".into(),
        Reply::Bye => "bye".into(),
    };
    format!("OK {words}")
}

/// A negative answer: one line of plain characters.
pub fn no(wrong: &Wrong) -> String {
    format!("ERROR {} {}", wrong.code as u8, plain(&wrong.words)).trim_end().to_owned()
}

/// Words in plain characters, as many as a controller's string holds.
pub fn plain(words: &str) -> String {
    let plain = |c: char| if c.is_ascii_graphic() || c == ' ' { c } else { '?' };
    words.chars().map(plain).take(MOST_WORDS).collect()
}

/// A pose's numbers: to 0.1 um, 1e-5 degrees, 1e-7 rad, 1e-6 of a quaternion or matrix.
fn pose(notation: Convention, numbers: &[f64]) -> String {
    let digits = |label: &str| match label.split_once(' ').map(|(_, unit)| unit) {
        Some("mm") => 4,
        Some("deg") => 5,
        Some("m" | "rad") => 7,
        // Six digits: a pose of ABB then fits into one of its strings of 80 characters.
        _ => 6,
    };
    let one = |(label, x): (&&str, &f64)| {
        let digits = digits(label);
        // -0.0000 would surprise programs that compare texts.
        format!("{:.digits$}", if x.abs() < 0.5 * 10f64.powi(-digits) { 0.0 } else { *x }, digits = digits as usize)
    };
    notation.labels().iter().zip(numbers).map(one).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn words_are_read_as_controllers_write_them() {
        let pose = |n: &[f64]| Ok(Request::Pose(n.to_vec()));
        assert_eq!(read("find led\r"), Ok(Request::Find("led".into())));
        assert_eq!(read(" POSE p[0.1, -0.2, 3e-1, 0, 3.1, 0]"), pose(&[0.1, -0.2, 0.3, 0.0, 3.1, 0.0]));
        assert_eq!(read("POSE [1,2,3],[1,0,0,0]"), pose(&[1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0]));
        assert_eq!(read("Give Approach flange"), Ok(Request::Give(Which::Approach, Of::Flange)));
        let says = |line: &str| no(&read(line).unwrap_err());
        assert_eq!(
            says("FIND ../led"),
            "ERROR 1 '../led' is not a recipe's name: 1 to 40 letters, digits, - and _ are"
        );
        assert_eq!(says("POSE 1 2 nan"), "ERROR 2 'nan' is not a number");
        assert!(says("GET / HTTP/1.1").starts_with("ERROR 1 'GET' is not a word"));
        assert!(says("SCAN now").contains("stands alone") && says("GIVE up").contains("not 'up'"));
        assert!(says("\u{8d64}\u{7}").starts_with("ERROR 1 '??' is not a word"));
    }

    proptest! {
        #[test]
        fn whatever_comes_is_read_or_answered_by_one_plain_line(line in "\\PC{0,80}|(pose|find|give|scan) \
            [\\x00-\\x7f]{0,60}") {
            let answer = match read(&line) {
                Ok(_) => yes(&Reply::Shots(1), Convention::Ur),
                Err(wrong) => no(&wrong),
            };
            prop_assert!(answer.len() <= MOST_WORDS + 10 && answer.chars().all(|c| c.is_ascii_graphic() || c == ' '));
        }
    }
}
