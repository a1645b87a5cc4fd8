//! A change that would make pairs fit that do not, in words.

use super::present::Fits;
use crate::fault::Fault;

/// A change that would make the pairs fit. It is reported but never applied.
pub struct Explanation {
    /// The fault, if the fit does not state it.
    pub what: String,
    /// The change that would make them fit, and the misfit with it.
    pub cause: String,
    /// What the user can do about it.
    pub next: String,
    /// Misfit with the change and without it.
    pub fits: Fits,
    /// Size of the change; smaller changes are likelier.
    pub changes: u32,
    /// True if the fault makes the transform wrong, rather than only excluding some pairs.
    pub refuses: bool,
    /// Indices of the pairs that are changed, if they are a part of all.
    pub part: Vec<usize>,
}

impl Explanation {
    /// A refusal with this explanation; `measured` is its fault if `what` is empty.
    pub fn fault(self, measured: String) -> Fault {
        let what = if self.what.is_empty() { measured } else { self.what };
        Fault::input(what).cause(self.cause).next(self.next)
    }
}
