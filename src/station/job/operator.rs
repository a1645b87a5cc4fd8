//! In: what a job is about to do. Out: a person's yes or no; what he is told.
//! Frame and unit: none.

use crate::arm::rules::{Confirmation, Proposal};
use crate::fault::Result;

/// What a person is asked.
#[derive(Clone, Debug)]
pub struct Ask<'a> {
    /// One or two words, as the steps are called.
    pub step: &'static str,
    /// What was found, a sentence a line.
    pub says: Vec<String>,
    /// The question.
    pub question: &'static str,
    /// The motion, with its gates; all of them are met.
    pub proposal: &'a Proposal,
}

/// A person, or what stands for one.
pub trait Operator {
    /// Shows a motion and asks. `None` is a no.
    fn confirm(&mut self, ask: &Ask) -> Result<Option<Confirmation>>;
    /// Whether the last question was left without an answer for so long that it is to be asked anew, from how things
    /// are then.
    fn again(&mut self) -> bool {
        false
    }
    /// The motion that was confirmed has ended, or was stopped.
    fn over(&mut self) {}
    /// Asks whether a person has looked at the robot; `why` says what was not known. Only a person's own act makes
    /// this true, or a robot that is a simulated one.
    fn looked(&mut self, why: &str) -> Result<bool>;
    /// Says what happens.
    fn tell(&mut self, line: &str);
}
