//! In: a line as a robot's program writes it. Out: what it asks for, or what is wrong with it; answers as lines. Pure.
//! Frame and unit: the numbers of a pose as its notation has them.

use crate::geometry::{Frame, Rigid};
use crate::robot::Convention;

/// Bytes of a request, its end left out; controllers' own strings are shorter.
pub const MOST_BYTES: usize = 512;
/// Characters of an answer: FANUC's and Denso's strings end soon after. A matrix in full is longer.
const MOST_WORDS: usize = 200;

/// What a robot's program asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Who answers, and in which notation.
    Hello,
    /// What was done so far.
    Status,
    /// A scan begins; what was found before is forgotten.
    Scan,
    /// The flange stands there, the line is on: take the picture.
    Pose(Vec<f64>),
    /// The scan is complete: look for the part of that recipe.
    Find(String),
    /// A pose of the part that was found.
    Give(Which, Of),
    /// The connection ends.
    Bye,
}

/// Which pose of an insertion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// Above it.
    Approach,
    /// Down.
    Insertion,
    /// Back up.
    Retract,
}

/// Of what a pose is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// The inserting tool, which the controller has selected.
    Tool,
    /// The flange: tool 0.
    Flange,
}

/// Why a request is not done; the numbers stand in the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// No such word.
    Word = 1,
    /// Numbers that are no pose.
    Numbers = 2,
    /// Not at this time: no scan was begun, nothing was found.
    Order = 3,
    /// The part was not found, or not well enough.
    Refused = 4,
    /// No picture, or the disk is full: something on our side.
    Failed = 5,
    /// Another robot is connected.
    Busy = 6,
    /// A line without end.
    Long = 7,
    /// Nothing came for too long.
    Late = 8,
}

/// What is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wrong {
    /// Its number.
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

/// Reads a request. Words may be in small letters; what parts numbers may be blanks, commas, semicolons or the
/// brackets that UR and ABB write around their poses (`p[0.1, ...]`, `[1,2,3],[...]`).
///
/// # Errors
/// What is wrong, in a few words.
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
        "SCAN" => alone(Request::Scan),
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

/// A recipe's name becomes the name of a file: letters, digits, - and _ alone.
fn recipe(name: &str) -> Result<String, Wrong> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    if (1..=40).contains(&name.len()) && name.chars().all(plain) {
        return Ok(name.to_owned());
    }
    Err(Wrong::new(
        Code::Word,
        format!("'{}' is not a recipe's name: 1 to 40 letters, digits, - and _ are", shown(name)),
    ))
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

/// Something that came over the wire, as far as it can be shown.
fn shown(text: &str) -> String {
    text.chars().take(24).map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' }).collect()
}

/// An answer that says yes, without its end.
pub fn yes(words: &str) -> String {
    format!("OK {words}").trim_end().to_owned()
}

/// An answer that says no: one line of plain characters.
pub fn no(wrong: &Wrong) -> String {
    let plain = wrong.words.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' });
    format!("ERROR {} {}", wrong.code as u8, plain.take(MOST_WORDS).collect::<String>()).trim_end().to_owned()
}

/// A pose's numbers: to 0.1 um, 1e-5 degrees, 1e-7 rad, 1e-6 of a quaternion or matrix.
pub fn pose<To: Frame, From: Frame>(convention: Convention, pose: &Rigid<To, From>) -> String {
    let digits = |label: &str| match label.split_once(' ').map(|(_, unit)| unit) {
        Some("mm") => 4,
        Some("deg") => 5,
        Some("m" | "rad") => 7,
        // A pose of ABB fits into one of its strings, 80 characters.
        _ => 6,
    };
    let one = |(label, x): (&&str, f64)| {
        let digits = digits(label);
        // -0.0000 surprises programs that compare texts.
        format!("{:.digits$}", if x.abs() < 0.5 * 10f64.powi(-digits) { 0.0 } else { x }, digits = digits as usize)
    };
    convention.labels().iter().zip(convention.write(pose)).map(one).collect::<Vec<_>>().join(" ")
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
                Ok(_) => yes("1"),
                Err(wrong) => no(&wrong),
            };
            prop_assert!(answer.len() <= MOST_WORDS + 10 && answer.chars().all(|c| c.is_ascii_graphic() || c == ' '));
        }
    }
}
