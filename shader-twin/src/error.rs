//! In: what went wrong. Out: a message with the number against its limit, the likely cause, and the next step.

use std::fmt;

/// What kind of trouble an [`Error`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// This machine has no adapter at all. Only this kind can be skipped ([`crate::Device::open_or_skip`]).
    NoAdapter,
    /// There are adapters, but not the one that was asked for, or one that computes nothing.
    WrongAdapter,
    /// The shader and its declaration disagree, or a case does not fit the declaration.
    Contract,
    /// The device refused a pipeline or a buffer.
    Refused,
    /// The device gave no answer in time.
    TimedOut,
    /// The device was lost.
    Lost,
    /// The cases, the twin or an explanation are used wrongly.
    Usage,
    /// A report could not be written.
    File,
}

/// A refusal: what happened, the likely cause, the next step.
#[derive(Clone, PartialEq, Eq)]
pub struct Error {
    kind: Kind,
    what: String,
    cause: String,
    next: String,
}

/// The result of everything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(crate) fn new(kind: Kind, what: impl Into<String>) -> Error {
        Error { kind, what: what.into(), cause: String::new(), next: String::new() }
    }

    pub(crate) fn cause(mut self, cause: impl Into<String>) -> Error {
        self.cause = cause.into();
        self
    }

    pub(crate) fn next(mut self, next: impl Into<String>) -> Error {
        self.next = next.into();
        self
    }

    /// What kind of trouble it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// What happened, without cause and next step.
    pub fn what(&self) -> &str {
        &self.what
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)?;
        if !self.cause.is_empty() {
            write!(f, "; likely cause: {}", self.cause)?;
        }
        if !self.next.is_empty() {
            write!(f, "; next: {}", self.next)?;
        }
        Ok(())
    }
}

/// As [`fmt::Display`]: `unwrap` and a `main` that returns an error show it, and a person reads it there.
impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_says_what_why_and_what_next() {
        let error = Error::new(Kind::Refused, "2 of 1").cause("too many").next("take one");
        assert_eq!(error.to_string(), "2 of 1; likely cause: too many; next: take one");
        assert_eq!(format!("{error:?}"), error.to_string());
        assert_eq!(Error::new(Kind::Refused, "2 of 1").to_string(), "2 of 1");
    }
}
