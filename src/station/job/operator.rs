//! In: the next action of a job. Out: a person's yes or no; messages for that person.
//! Frame and unit: none.

use crate::arm::rules::{Confirmation, Proposal};
use crate::fault::Result;

/// A question for a person.
#[derive(Clone, Debug)]
pub struct Ask<'a> {
    /// Name of the step, one or two words.
    pub step: &'static str,
    /// The findings, one sentence a line.
    pub says: Vec<String>,
    /// The question.
    pub question: &'static str,
    /// The motion, with its gates; all of them are met.
    pub proposal: &'a Proposal,
}

/// A person, or a program that replaces one.
pub trait Operator {
    /// Shows a motion and asks for confirmation. `None` means no.
    fn confirm(&mut self, ask: &Ask) -> Result<Option<Confirmation>>;
    /// Whether the last question remained unanswered for so long that it has to be asked again with the situation
    /// then.
    fn again(&mut self) -> bool {
        false
    }
    /// The confirmed motion has ended, or was stopped.
    fn over(&mut self) {}
    /// Asks whether a person has looked at the robot; `why` says what was unknown. Only an act of a person, or a
    /// simulated robot, makes this true.
    fn looked(&mut self, why: &str) -> Result<bool>;
    /// Reports an event.
    fn tell(&mut self, line: &str);
}
