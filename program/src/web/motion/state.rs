//! Who uses the robot, and the state of the motion that is shown.

use crate::web::guard::Tab;
use crate::web::message::Asked;
use sheetlight::arm::rules::Guard;
use std::time::Instant;

/// State of the robot. The guard is stored here only while nothing uses the robot.
#[derive(Default)]
pub(super) enum Robot {
    /// Not armed.
    #[default]
    Away,
    /// Armed and free.
    Rests(Box<Guard>),
    /// A request has it: it tries an output, or reads the pose after a person has looked.
    Lent,
    /// A job has it.
    Job(Step),
}

/// Activity of the job that has the robot.
pub(super) enum Step {
    /// No motion is shown.
    Works,
    /// A motion is shown, and nobody has answered yet.
    Shown(Box<Asked>),
    /// The motion was refused; the job has not noticed yet.
    Refused(Box<Asked>),
    /// The motion was confirmed and is under way.
    Moves(Box<Asked>),
}

/// A button that is held. It may stay pressed from one motion to the next.
pub(super) struct Hold {
    pub tab: Tab,
    pub grant: String,
    pub heard: Instant,
}

/// What pages show beside the robot's state.
#[derive(Clone, Default)]
pub(super) struct Told {
    pub job: Option<String>,
    pub said: Vec<String>,
    pub silence_ms: Option<f64>,
    pub expected: Vec<(usize, f64)>,
}

/// The data under the desk's lock.
#[derive(Default)]
pub(super) struct At {
    pub robot: Robot,
    /// The tab that armed the robot; `None` after another tab has taken over.
    pub by: Option<Tab>,
    pub hold: Option<Hold>,
    pub told: Told,
}

impl At {
    /// The motion that is shown, refused or under way.
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

    /// Moves the job from a shown motion to the next step.
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

    /// During a motion, updates the longest time since the held button last reported.
    pub fn silent(&mut self) {
        if let (true, Some(hold)) = (self.moves(), &self.hold) {
            let ms = hold.heard.elapsed().as_secs_f64() * 1e3;
            self.told.silence_ms = self.told.silence_ms.map(|longest| longest.max(ms));
        }
    }
}
