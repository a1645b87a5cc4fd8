//! The button that is held during a motion: it confirms the shown motion once, and releasing it halts the arm.

use super::desk::Desk;
use super::state::{At, Hold, Robot, Step};
use crate::web::guard::Tab;
use crate::web::message::{Asked, Confirmed};
use sheetlight::arm::rules::StopButton;
use sheetlight::fault::{Fault, Result};
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// During a motion the tab that holds the button reports so repeatedly; silence for this long halts the arm.
pub const SILENCE: Duration = Duration::from_secs(1);
/// Interval at which a shown motion checks whether its job was stopped.
const LOOK: Duration = Duration::from_millis(100);

/// Decision about a motion that was shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// Confirmed; it is made.
    Yes,
    /// Refused; the job ends.
    No,
    /// Nobody answered while the motion was valid.
    Late,
    /// The job was ended.
    Over,
}

fn no(what: impl Into<String>) -> Fault {
    Fault::refused(what).cause("nothing was moved").next("look at the motion that is shown and hold its button again")
}

impl Desk {
    /// The button is pressed on the shown motion. Returns the name under which the confirmation can be redeemed
    /// once.
    pub fn press(&self, tab: &Tab, what: &Confirmed) -> Result<String> {
        let at = self.at();
        let asked = self.may(&at, tab, what)?;
        let down = at.hold.as_ref().is_some_and(|h| h.heard.elapsed() < SILENCE);
        if down && !asked.stays_down {
            return Err(no(format!("'{}': the button is still held; release it and press it again", asked.step)));
        }
        Ok(self.grants.give(tab, what.clone()))
    }

    /// The button was held long enough: the motion is confirmed, once.
    pub fn go(&self, tab: &Tab, grant: &str, what: &Confirmed) -> Result<()> {
        self.grants.redeem(grant, tab, what)?;
        let mut at = self.at();
        self.may(&at, tab, what)?;
        if let Some(button) = self.brake.button() {
            button.lease(SILENCE);
        }
        at.hold = Some(Hold { tab: tab.clone(), grant: grant.to_owned(), heard: Instant::now() });
        at.told.silence_ms = Some(0.0);
        at.answer(Step::Moves);
        self.tell(&at);
        self.wake.notify_all();
        Ok(())
    }

    /// The shown motion, if this tab may confirm it as `what`.
    fn may<'a>(&self, at: &'a At, tab: &Tab, what: &Confirmed) -> Result<&'a Asked> {
        if at.by.as_ref() != Some(tab) {
            return Err(no("the robot is not armed from this screen"));
        }
        if let Some(why) = self.brake.look() {
            return Err(no(format!("somebody has to look at the robot first: {why}")));
        }
        match (&at.robot, at.asked()) {
            (_, None) => Err(no("no motion waits for a confirmation")),
            (_, Some(asked)) if asked.hash != what.hash || asked.job != what.job => {
                Err(no("the motion is not the one that is shown now"))
            }
            (Robot::Job(Step::Shown(_)), Some(asked)) => Ok(asked),
            _ => Err(no("this motion was confirmed already")),
        }
    }

    /// Refuses the motion: the job that proposed it ends.
    pub fn refuse(&self, what: &Confirmed) -> Result<()> {
        let mut at = self.at();
        match &at.robot {
            Robot::Job(Step::Shown(asked)) if asked.hash == what.hash => {
                at.answer(Step::Refused);
                self.wake.notify_all();
                Ok(())
            }
            _ => Err(no("that motion is not asked for")),
        }
    }

    /// The tab reports that it still holds the button. Returns false if it holds none.
    pub fn held(&self, tab: &Tab, grant: &str) -> bool {
        let mut at = self.at();
        at.silent();
        let Some(hold) = at.hold.as_mut().filter(|h| h.tab == *tab && h.grant == grant) else { return false };
        hold.heard = Instant::now();
        self.brake.button().iter().for_each(StopButton::renew);
        true
    }

    /// Shows a motion and waits for the decision; `stop` ends the job that proposed it.
    pub(super) fn ask(&self, asked: Asked, stop: &AtomicBool) -> Answer {
        let until = Instant::now() + Duration::from_secs_f64(asked.within_s);
        let mut at = self.at();
        at.robot = Robot::Job(Step::Shown(Box::new(asked)));
        self.tell(&at);
        let answer = loop {
            if stop.load(Ordering::SeqCst) {
                break Answer::Over;
            }
            match &at.robot {
                Robot::Job(Step::Moves(_)) => return Answer::Yes,
                Robot::Job(Step::Shown(_)) if Instant::now() < until => {}
                Robot::Job(Step::Shown(_)) => break Answer::Late,
                Robot::Job(_) => break Answer::No,
                _ => break Answer::Over,
            }
            at = self.wake.wait_timeout(at, LOOK).unwrap_or_else(PoisonError::into_inner).0;
        };
        at.works();
        self.tell(&at);
        answer
    }

    /// The confirmed motion has ended.
    pub(super) fn over(&self) {
        let mut at = self.at();
        at.silent();
        at.works();
        self.brake.button().iter().for_each(StopButton::end_lease);
        self.tell(&at);
    }
}
