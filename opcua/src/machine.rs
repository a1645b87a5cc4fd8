//! In: what clients ask for and what the station does. Out: the states of a vision system and the transitions between
//! them [opc-mv, OPC 40100-1, 8.2 and 8.3]. Pure.
//!
//! The states are this program's: the station has jobs, a recipe is prepared here. A lost station is the state Error.
//! When it is back, a client has to select automatic mode again, so that nothing goes on that nobody asked for.

use crate::model::ids::transition as tr;

/// The states of both machines as one: the automatic ones are within Operational.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    Preoperational,
    Halted,
    Error,
    Initialized,
    Ready,
    SingleExecution,
}

impl State {
    /// Whether the vision system is operational.
    pub fn is_operational(self) -> bool {
        matches!(self, State::Initialized | State::Ready | State::SingleExecution)
    }
}

/// What ends an execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The job itself.
    Auto,
    Stop,
    Abort,
}

/// The number of a transition's node.
pub type Transition = u32;

/// The machine.
#[derive(Debug)]
pub struct Machine {
    state: State,
    /// The prepared recipe.
    recipe: Option<String>,
    end: End,
}

impl Default for Machine {
    fn default() -> Machine {
        Machine { state: State::Preoperational, recipe: None, end: End::Auto }
    }
}

impl Machine {
    pub fn state(&self) -> State {
        self.state
    }

    pub fn recipe(&self) -> Option<&str> {
        self.recipe.as_deref()
    }

    fn goes(&mut self, to: State, by: Transition) -> Option<Transition> {
        self.state = to;
        if !to.is_operational() {
            self.recipe = None;
        }
        Some(by)
    }

    /// The station is lost. Halted has no way to Error.
    pub fn lost(&mut self) -> Option<Transition> {
        match self.state {
            State::Preoperational => self.goes(State::Error, tr::PREOPERATIONAL_TO_ERROR_AUTO),
            State::Error | State::Halted => None,
            _ => self.goes(State::Error, tr::OPERATIONAL_TO_ERROR_AUTO),
        }
    }

    /// The station is back.
    pub fn back(&mut self) -> Option<Transition> {
        match self.state {
            State::Error => self.goes(State::Preoperational, tr::ERROR_TO_PREOPERATIONAL_AUTO),
            _ => None,
        }
    }

    pub fn select_automatic(&mut self) -> Option<Transition> {
        match self.state {
            State::Preoperational => self.goes(State::Initialized, tr::PREOPERATIONAL_TO_OPERATIONAL),
            _ => None,
        }
    }

    pub fn halt(&mut self) -> Option<Transition> {
        match self.state {
            State::Halted => None,
            State::Preoperational => self.goes(State::Halted, tr::PREOPERATIONAL_TO_HALTED),
            State::Error => self.goes(State::Halted, tr::ERROR_TO_HALTED),
            _ => self.goes(State::Halted, tr::OPERATIONAL_TO_HALTED),
        }
    }

    /// Always possible; of Preoperational there is nothing to reset.
    pub fn reset(&mut self) -> Option<Transition> {
        match self.state {
            State::Preoperational => None,
            State::Halted => self.goes(State::Preoperational, tr::HALTED_TO_PREOPERATIONAL),
            State::Error => self.goes(State::Preoperational, tr::ERROR_TO_PREOPERATIONAL),
            _ => self.goes(State::Preoperational, tr::OPERATIONAL_TO_PREOPERATIONAL),
        }
    }

    /// Whether a recipe may be prepared or given up now.
    pub fn takes_recipes(&self) -> bool {
        matches!(self.state, State::Initialized | State::Ready)
    }

    /// Prepares a recipe instead of the one before; in Ready that is no transition.
    pub fn prepare(&mut self, recipe: &str) -> Option<Transition> {
        self.recipe = Some(recipe.to_owned());
        match self.state {
            State::Initialized => self.goes(State::Ready, tr::INITIALIZED_TO_READY_RECIPE),
            _ => None,
        }
    }

    pub fn unprepare(&mut self) -> Option<Transition> {
        match self.state {
            State::Ready => {
                self.recipe = None;
                self.goes(State::Initialized, tr::READY_TO_INITIALIZED_RECIPE)
            }
            _ => None,
        }
    }

    /// A job was started here.
    pub fn starts(&mut self) -> Option<Transition> {
        self.runs(tr::READY_TO_SINGLE_EXECUTION)
    }

    /// A job runs that was started elsewhere, for example at the station's screen.
    pub fn started_elsewhere(&mut self) -> Option<Transition> {
        self.runs(tr::READY_TO_SINGLE_EXECUTION_AUTO)
    }

    fn runs(&mut self, by: Transition) -> Option<Transition> {
        if self.state != State::Ready {
            return None;
        }
        self.end = End::Auto;
        self.goes(State::SingleExecution, by)
    }

    /// The station was asked to end the job.
    pub fn ends_by(&mut self, end: End) {
        self.end = end;
    }

    /// No job runs any more.
    pub fn ended(&mut self) -> Option<Transition> {
        let by = match self.end {
            End::Auto => tr::SINGLE_EXECUTION_TO_READY_AUTO,
            End::Stop => tr::SINGLE_EXECUTION_TO_READY_STOP,
            End::Abort => tr::SINGLE_EXECUTION_TO_READY_ABORT,
        };
        match self.state {
            State::SingleExecution => self.goes(State::Ready, by),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ids::{TRANSITIONS, state};

    type Step = fn(&mut Machine) -> Option<Transition>;

    const STEPS: [Step; 12] = [
        Machine::lost,
        Machine::back,
        Machine::select_automatic,
        Machine::halt,
        Machine::reset,
        Machine::unprepare,
        Machine::starts,
        Machine::started_elsewhere,
        Machine::ended,
        |m| if m.takes_recipes() { m.prepare("led") } else { None },
        |m| {
            m.ends_by(End::Stop);
            m.ended()
        },
        |m| {
            m.ends_by(End::Abort);
            m.ended()
        },
    ];

    /// The node of a state, in the machine that a transition belongs to.
    fn node(of: State, vision: bool) -> u32 {
        match of {
            State::Preoperational => state::PREOPERATIONAL,
            State::Halted => state::HALTED,
            State::Error => state::ERROR,
            _ if vision => state::OPERATIONAL,
            State::Initialized => state::INITIALIZED,
            State::Ready => state::READY,
            State::SingleExecution => state::SINGLE_EXECUTION,
        }
    }

    /// Every transition that is made is one of the specification, from the state before to the state after; and a
    /// state changes only by one.
    #[test]
    fn whatever_happens_the_machine_makes_transitions_of_the_specification() {
        let mut taken = std::collections::BTreeSet::new();
        let mut chance = 1u64;
        let mut machine = Machine::default();
        for _ in 0..20_000 {
            chance = chance.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let before = machine.state();
            let by = STEPS[(chance >> 33) as usize % STEPS.len()](&mut machine);
            let after = machine.state();
            assert_eq!(by.is_some(), before != after, "{before:?} {after:?}");
            assert_eq!(machine.recipe().is_some(), matches!(after, State::Ready | State::SingleExecution));
            let Some(by) = by else { continue };
            let row = TRANSITIONS.iter().find(|t| t.id == by).expect("a transition of the specification");
            let vision = row.vision;
            assert_eq!((row.from, row.to), (node(before, vision), node(after, vision)), "{}", row.name);
            taken.insert(by);
        }
        assert_eq!(taken.len(), 17, "{taken:?}");
    }

    /// The station shows a job as running until it has ended: that is not another one, which nobody stopped.
    #[test]
    fn a_stop_is_remembered_until_the_job_has_ended() {
        let mut machine = Machine::default();
        machine.select_automatic();
        machine.prepare("led");
        machine.starts();
        machine.ends_by(End::Stop);
        assert_eq!(machine.started_elsewhere(), None);
        assert_eq!(machine.ended(), Some(tr::SINGLE_EXECUTION_TO_READY_STOP));
        machine.started_elsewhere();
        assert_eq!(machine.ended(), Some(tr::SINGLE_EXECUTION_TO_READY_AUTO));
    }
}
