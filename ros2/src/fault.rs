//! In: what went wrong. Out: what ends the program: what happened, the likely cause, the next step, the exit code.

/// What ends the program.
#[derive(Debug)]
pub struct Fault {
    /// 1: failed; 2: wrong use.
    pub code: u8,
    pub what: String,
    pub cause: &'static str,
    pub next: &'static str,
}

pub fn fault(what: impl Into<String>, cause: &'static str, next: &'static str) -> Fault {
    Fault { code: 1, what: what.into(), cause, next }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "error: {}\n  likely cause: {}\n  next step: {}", self.what, self.cause, self.next)
    }
}
