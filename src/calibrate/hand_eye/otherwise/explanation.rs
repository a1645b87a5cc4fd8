//! Something with which pairs would fit that do not, in words.

use super::present::Fits;
use crate::fault::Fault;

/// Something with which the pairs would fit. It is told, and never done.
pub struct Explanation {
    /// What is wrong, where the fit itself does not say it.
    pub what: String,
    /// What they would fit with, and how well.
    pub cause: String,
    /// What a person does about it.
    pub next: String,
    /// How well they would fit, and how well they do.
    pub fits: Fits,
    /// How much is changed by it: the fewer the likelier.
    pub changes: u32,
    /// The transform would be wrong, not only some pairs left out.
    pub refuses: bool,
}

impl Explanation {
    /// A refusal that says it; `measured` is what is wrong where it has no words of its own.
    pub fn fault(self, measured: String) -> Fault {
        let what = if self.what.is_empty() { measured } else { self.what };
        Fault::input(what).cause(self.cause).next(self.next)
    }
}
