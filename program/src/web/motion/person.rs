//! In: what a job is about to do. Out: the confirmation of the person who holds the button at the screen.
//! Frame and unit: base frame, in the station's notation.

use super::button::Answer;
use super::desk::Desk;
use crate::web::message::{Asked, GateLight};
use sheetlight::arm::rules::Confirmation;
use sheetlight::fault::{Fault, Result};
use sheetlight::robot::Convention;
use sheetlight::station::job::{Ask, Operator};
use std::sync::atomic::AtomicBool;

/// Steps that only measure, far from the part: the button may stay pressed from one to the next.
const LOOKING: [&str; 3] = ["touch", "scan", "calibrate"];

/// The person who operates.
pub struct Person<'a> {
    /// The person's desk.
    pub desk: &'a Desk,
    /// The job that asks for confirmation.
    pub job: &'a str,
    /// Ends that job.
    pub stop: &'a AtomicBool,
    /// Notation of the poses that are shown.
    pub robot: Convention,
    /// How long a shown motion stays valid, s.
    pub within_s: f64,
    /// Called at every step.
    pub step: &'a dyn Fn(&str),
    /// True if nobody answered in time.
    pub late: bool,
}

impl Person<'_> {
    fn asked(&self, ask: &Ask) -> Asked {
        let plan = &ask.proposal.plan;
        let unjudged = ask.proposal.unjudged.iter().map(|what| format!("not judged: {what}"));
        let ends = plan.legs.last().map_or(ask.proposal.from, |leg| leg.to);
        Asked {
            job: self.job.to_owned(),
            step: ask.step.to_owned(),
            says: ask.says.iter().cloned().chain(unjudged).collect(),
            question: ask.question.to_owned(),
            hash: ask.proposal.hash.clone(),
            gates: ask.proposal.gates.iter().map(GateLight::from).collect(),
            motions: plan.legs.len(),
            speed_mm_s: plan.legs.iter().map(|l| l.speed_mm_s).fold(0.0, f64::max),
            convention: self.robot.name().into(),
            labels: self.robot.labels().iter().map(|l| (*l).to_owned()).collect(),
            numbers: self.robot.write(&ends),
            stays_down: LOOKING.contains(&ask.step),
            within_s: self.within_s,
        }
    }
}

impl Operator for Person<'_> {
    fn confirm(&mut self, ask: &Ask) -> Result<Option<Confirmation>> {
        (self.step)(ask.step);
        let answer = self.desk.ask(self.asked(ask), self.stop);
        self.late = answer == Answer::Late;
        match answer {
            Answer::Yes => Ok(Some(Confirmation::of(&*ask.proposal.hash))),
            Answer::No | Answer::Late => Ok(None),
            Answer::Over => {
                Err(Fault::refused(format!("stopped at '{}': STOP was pressed, or the job was ended", ask.step))
                    .next("look at the cell, then begin again"))
            }
        }
    }

    fn again(&mut self) -> bool {
        self.late
    }

    fn over(&mut self) {
        self.desk.over();
    }

    /// A person must have looked since the last halt. No job has the robot before a person pressed Arm beside it
    /// and, after a halt, confirmed that he has looked.
    fn looked(&mut self, why: &str) -> Result<bool> {
        self.tell(why);
        Ok(self.desk.state().look.is_none())
    }

    fn tell(&mut self, line: &str) {
        self.desk.say(line);
    }
}
