//! In: a situation that bad input, a bad machine or a weak measurement led to.
//! Out: one error type with its four sentences (what, numbers, cause, next step) and the exit code.
//! Frame and unit: none; numbers inside the text carry their own units.

mod gate;

pub use gate::Gate;
use std::fmt;
use std::path::Path;

/// Category of the error. It decides the exit code, and tests compare it instead of the wording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The command or its options make no sense. Exit code 2.
    Usage,
    /// A file or its content is missing, malformed or contradicts another.
    Input,
    /// The input is well formed but does not determine the answer well enough to give one.
    Refused,
    /// A result could not be written.
    Output,
    /// The GPU or its driver failed.
    Device,
}

/// An error that a user can act on: what happened (with the value and the limit), the likely cause, and the next
/// step. A bug is a panic, never a `Fault`. Missing laser pixels are neither.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Decides the exit code.
    pub kind: Kind,
    /// What happened, with the value and the limit.
    pub what: String,
    /// The likely cause, in one sentence; empty if no cause is likely.
    pub cause: String,
    /// The next step, in one sentence; empty if there is none.
    pub next: String,
}

/// The cause stated when a result does not fit on the disk.
const FULL: &str = "the disk is full";

/// Result of every function that bad input can stop.
pub type Result<T> = std::result::Result<T, Fault>;

/// Message for a word that names no value of `T`; it lists all valid names.
///
/// ```
/// #[derive(Clone, Copy, strum::IntoStaticStr, strum::VariantArray)]
/// #[strum(serialize_all = "lowercase")]
/// enum Side { Left, Right }
/// assert_eq!(sheetlight::fault::unknown::<Side>("side", "up"), "unknown side 'up': left, right");
/// ```
pub fn unknown<T: strum::VariantArray + Copy + Into<&'static str>>(what: &str, word: &str) -> String {
    let names: Vec<&str> = T::VARIANTS.iter().map(|v| (*v).into()).collect();
    format!("unknown {what} '{word}': {}", names.join(", "))
}

impl Fault {
    /// An error without cause and next step; [`Fault::cause`] and [`Fault::next`] add them.
    pub fn new(kind: Kind, what: impl Into<String>) -> Fault {
        Fault { kind, what: what.into(), cause: String::new(), next: String::new() }
    }
    /// The command or its options are invalid.
    pub fn usage(what: impl Into<String>) -> Fault {
        Fault::new(Kind::Usage, what)
    }
    /// A file or its content is wrong.
    pub fn input(what: impl Into<String>) -> Fault {
        Fault::new(Kind::Input, what)
    }
    /// The input does not determine the answer well enough.
    pub fn refused(what: impl Into<String>) -> Fault {
        Fault::new(Kind::Refused, what)
    }
    /// A result could not be written.
    pub fn output(what: impl Into<String>) -> Fault {
        Fault::new(Kind::Output, what)
    }
    /// The GPU or its driver failed.
    pub fn device(what: impl Into<String>) -> Fault {
        Fault::new(Kind::Device, what)
    }
    /// The likely cause, in one sentence.
    pub fn cause(mut self, cause: impl Into<String>) -> Fault {
        self.cause = cause.into();
        self
    }
    /// What to do next, in one sentence.
    pub fn next(mut self, next: impl Into<String>) -> Fault {
        self.next = next.into();
        self
    }
    /// Puts the location (a file, a shot, a key) in front of what happened.
    pub fn at(mut self, place: impl fmt::Display) -> Fault {
        self.what = format!("{place}: {}", self.what);
        self
    }
    /// True if a result could not be written because the disk is full.
    pub fn is_full_disk(&self) -> bool {
        self.kind == Kind::Output && self.cause == FULL
    }
    /// 2 for misuse, 1 for everything else.
    pub fn exit_code(&self) -> u8 {
        if self.kind == Kind::Usage { 2 } else { 1 }
    }
    /// A file that could not be read.
    pub fn read(path: &Path, e: std::io::Error) -> Fault {
        Fault::input(format!("{}: cannot be read: {e}", path.display()))
            .cause(match e.kind() {
                std::io::ErrorKind::NotFound => "the path is wrong, or the file was moved",
                std::io::ErrorKind::InvalidData => "it is not text: a picture, a cloud, or a file in another encoding",
                _ => "no permission, or a disk fault",
            })
            .next(if e.kind() == std::io::ErrorKind::InvalidData {
                "give the text file that is meant here, in UTF-8"
            } else {
                "check the path and its permissions"
            })
    }
    /// A thread could not be started.
    pub fn threads(e: &std::io::Error) -> Fault {
        Fault::device(format!("no further thread can be started: {e}"))
            .cause("the memory ran out, or the number of processes is limited")
            .next("close other programs, or raise the limits (ulimit -v, ulimit -u)")
    }
    /// A file or folder that could not be written.
    pub fn write(path: &Path, e: std::io::Error) -> Fault {
        let full = e.kind() == std::io::ErrorKind::StorageFull;
        Fault::output(format!("{}: cannot be written: {e}", path.display()))
            .cause(if full { FULL } else { "the folder is missing or not writable" })
            .next(if full {
                "free some space or choose another --out, then run the same command again"
            } else {
                "choose an --out folder that you may write to"
            })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.what)?;
        if !self.cause.is_empty() {
            write!(f, "\n  likely cause: {}", self.cause)?;
        }
        if !self.next.is_empty() {
            write!(f, "\n  next step: {}", self.next)?;
        }
        Ok(())
    }
}

impl std::error::Error for Fault {}
