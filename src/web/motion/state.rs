//! Who has the robot, and what becomes of the motion that is shown.

use crate::arm::rules::Guard;
use crate::web::guard::Tab;
use crate::web::message::Asked;
use std::time::Instant;

/// Where the robot is. Its guard is here only while nobody has it.
#[derive(Default)]
pub(super) enum Robot {
    /// Not armed.
    #[default]
    Away,
    /// Armed, and nobody has it.
    Rests(Box<Guard>),
    /// A request has it: it tries an output, or reads the pose after somebody has looked.
    Lent,
    /// A job has it.
    Job(Step),
}

/// What the job that has the robot does.
pub(super) enum Step {
    /// No motion is shown.
    Works,
    /// A motion is shown, and nobody has answered.
    Shown(Box<Asked>),
    /// It was refused; the job does not know yet.
    Refused(Box<Asked>),
    /// It was confirmed, and is made.
    Moves(Box<Asked>),
}

/// A button that is down. It may stay down from one motion to the next.
pub(super) struct Hold {
    pub tab: Tab,
    pub grant: String,
    pub heard: Instant,
}

/// What pages are told beside the robot's own state.
#[derive(Clone, Default)]
pub(super) struct Told {
    pub job: Option<String>,
    pub said: Vec<String>,
    pub silence_ms: Option<f64>,
    pub expected: Vec<(usize, f64)>,
}

/// What the desk's lock holds.
#[derive(Default)]
pub(super) struct At {
    pub robot: Robot,
    /// The tab that armed it; none once another one operates.
    pub by: Option<Tab>,
    pub hold: Option<Hold>,
    pub told: Told,
}

impl At {
    /// The motion that is shown, or made.
    pub fn asked(&self) -> Option<&Asked> {
        match &self.robot {
            Robot::Job(Step::Shown(asked) | Step::Refused(asked) | Step::Moves(asked)) => Some(asked.as_ref()),
            _ => None,
        }
    }

    pub fn moves(&self) -> bool {
        matches!(self.robot, Robot::Job(Step::Moves(_)))
    }

    pub fn armed(&self) -> bool {
        !matches!(self.robot, Robot::Away)
    }

    /// The motion that waits for an answer becomes something else.
    pub fn answer(&mut self, with: impl FnOnce(Box<Asked>) -> Step) {
        self.robot = match std::mem::take(&mut self.robot) {
            Robot::Job(Step::Shown(asked)) => Robot::Job(with(asked)),
            other => other,
        };
    }

    /// The job shows no motion any more.
    pub fn works(&mut self) {
        if let Robot::Job(step) = &mut self.robot {
            *step = Step::Works;
        }
    }

    /// Counts the time since the held button was heard, while something moves.
    pub fn silent(&mut self) {
        if let (true, Some(hold)) = (self.moves(), &self.hold) {
            let ms = hold.heard.elapsed().as_secs_f64() * 1e3;
            self.told.silence_ms = self.told.silence_ms.map(|longest| longest.max(ms));
        }
    }
}
