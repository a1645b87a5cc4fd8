//! In: calls as decoded from b-CAP frames. Out: the simulated controller's answers, and its actions on the cell. No
//! sockets here: the servers pass calls in and send the answers.
//! Frame and unit: mm and degrees as Denso writes them; s of the cell.

mod commands;
mod goal;
mod hands;
mod motion;
mod panel;
mod variables;

use super::cell::Cell;
pub use motion::Ticket;
use panel::{Object, Panel};
use sheetlight::bcap::{Call, Outcome, Variant};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The arm is taken by another client. This code and those below are chosen by Sheetlight, in Denso's range.
pub const TAKEN: Outcome = Outcome(0x8320_F001);
/// The arm was not taken.
pub const NOT_TAKEN: Outcome = Outcome(0x8320_F002);
/// Out of reach.
pub const OUT_OF_REACH: Outcome = Outcome(0x8320_F003);
/// Not a pose.
pub const BAD_POSE: Outcome = Outcome(0x8320_F004);
/// Emergency stop.
pub const EMERGENCY: Outcome = Outcome(0x8320_F005);
/// Programs may not move the arm in this mode.
pub const WRONG_MODE: Outcome = Outcome(0x8320_F006);
/// The goal is in the virtual fence.
pub const FENCE: Outcome = Outcome(0x8320_F007);

/// Result of a call.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// The call is complete: the outcome and the returned value.
    Done(Outcome, Option<Variant>),
    /// A motion was begun; [`Controller::motion`] returns its outcome once it has ended.
    Moving(Ticket),
}

/// The returned value, or the outcome of a refusal.
type Done = Result<Option<Variant>, Outcome>;

/// The controller of a cell. Cheap to clone.
#[derive(Clone)]
pub struct Controller {
    cell: Cell,
    panel: Arc<Mutex<Panel>>,
    connections: Arc<AtomicU64>,
}

/// One client's connection.
pub struct Connection {
    controller: Controller,
    /// Number of the connection in the log.
    pub number: u64,
    started: bool,
    /// Interval of interim replies, ms.
    pub watchdog_ms: Option<u64>,
}

impl Controller {
    /// The controller of a cell: automatic mode, motor off, no error.
    pub fn new(cell: Cell) -> Controller {
        Controller { cell, panel: Arc::new(Mutex::new(Panel::default())), connections: Arc::default() }
    }

    /// A new client.
    pub fn connect(&self) -> Connection {
        let number = self.connections.fetch_add(1, Ordering::Relaxed);
        Connection { controller: self.clone(), number, started: false, watchdog_ms: None }
    }

    fn panel(&self) -> MutexGuard<'_, Panel> {
        self.panel.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The controller's cell.
    pub fn cell(&self) -> &Cell {
        &self.cell
    }
}

impl Connection {
    /// The controller of this connection.
    pub fn controller(&self) -> Controller {
        self.controller.clone()
    }

    /// Answers a call. On failure, a call that has a result returns one empty value, others return none.
    pub fn answer(&mut self, number: u32, arguments: &[Variant]) -> Answer {
        let Some(call) = Call::of(number) else { return Answer::Done(Outcome::NOT_IMPLEMENTED, None) };
        if call == Call::RobotMove {
            return match if self.started { self.begin_move(arguments) } else { Err(Outcome::NOT_STARTED) } {
                Ok(answer) => answer,
                Err(outcome) => {
                    let now = self.controller.cell.clock().now();
                    self.controller.cell.world().note(now, super::log::Event::Refused { code: outcome.0 });
                    Answer::Done(outcome, None)
                }
            };
        }
        match self.done(call, arguments) {
            Ok(value) => Answer::Done(Outcome::OK, value),
            Err(outcome) => Answer::Done(outcome, returns(call).then_some(Variant::Empty)),
        }
    }

    fn done(&mut self, call: Call, arguments: &[Variant]) -> Done {
        if call == Call::ServiceStart {
            return self.start(arguments);
        }
        if !self.started {
            return Err(Outcome::NOT_STARTED);
        }
        self.controller.settle();
        match call {
            Call::ServiceStop => {
                self.controller.leave(self.number);
                self.started = false;
                Ok(None)
            }
            Call::ControllerConnect => match arguments.get(1) {
                Some(Variant::Text(provider)) if provider.eq_ignore_ascii_case("CaoProv.DENSO.VRC") => {
                    self.grant(Object::Controller)
                }
                _ => Err(Outcome::NO_SUCH_OBJECT),
            },
            Call::ControllerDisconnect | Call::RobotRelease | Call::VariableRelease => {
                self.object(arguments)?;
                self.controller.panel().objects.remove(&key(arguments));
                Ok(None)
            }
            Call::ControllerGetRobot => match arguments.get(1) {
                Some(Variant::Text(name)) if name.eq_ignore_ascii_case("Arm") => self.grant(Object::Robot),
                _ => Err(Outcome::NO_SUCH_OBJECT),
            },
            Call::ControllerGetRobotNames => Ok(Some(Variant::Variants(vec![Variant::Text("Arm".into())]))),
            Call::ControllerGetTaskNames => Ok(Some(Variant::Variants(vec![]))),
            Call::ControllerGetVariable | Call::RobotGetVariable => {
                self.variable(arguments, call == Call::RobotGetVariable)
            }
            Call::VariableGetValue => self.get_value(arguments),
            Call::VariablePutValue => self.put_value(arguments),
            Call::ControllerExecute | Call::RobotExecute => self.execute(arguments),
            Call::RobotHalt => {
                self.object(arguments)?;
                self.controller.halt(Some(self.number), Outcome::ABORTED);
                Ok(None)
            }
            Call::RobotSpeed => self.speed(arguments),
            Call::RobotChange => self.change(arguments),
            _ => Err(Outcome::NOT_IMPLEMENTED),
        }
    }

    fn start(&mut self, arguments: &[Variant]) -> Done {
        let Some(Variant::Text(words)) = arguments.first() else { return Err(Outcome::BAD_ARGUMENT) };
        let said =
            words.split(',').filter_map(|w| w.split_once('=')).find(|(k, _)| k.trim().eq_ignore_ascii_case("WDT"));
        let watchdog =
            said.map(|(_, v)| v.trim().parse::<u64>().ok().filter(|ms| *ms >= 80).ok_or(Outcome::BAD_ARGUMENT));
        self.watchdog_ms = watchdog.transpose()?;
        self.started = true;
        Ok(None)
    }

    /// Assigns the lowest free number as the handle.
    fn grant(&mut self, object: Object) -> Done {
        let mut panel = self.controller.panel();
        let handle = (1..).find(|k| !panel.objects.contains_key(k)).expect("some number is free");
        panel.objects.insert(handle, (self.number, object));
        Ok(Some(Variant::I32(handle)))
    }

    /// The object that the first argument refers to, on this connection.
    fn object(&self, arguments: &[Variant]) -> Result<Object, Outcome> {
        let panel = self.controller.panel();
        let found = panel.objects.get(&key(arguments)).filter(|(owner, _)| *owner == self.number);
        found.map(|(_, object)| object.clone()).ok_or(Outcome::BAD_HANDLE)
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.controller.leave(self.number);
    }
}

fn key(arguments: &[Variant]) -> i32 {
    match arguments.first() {
        Some(Variant::I32(handle)) => *handle,
        _ => 0,
    }
}

/// Whether a call has a result.
fn returns(call: Call) -> bool {
    use Call::*;
    matches!(
        call,
        ControllerConnect
            | ControllerGetRobot
            | ControllerGetVariable
            | ControllerGetRobotNames
            | ControllerGetTaskNames
            | ControllerExecute
            | RobotGetVariable
            | RobotExecute
            | VariableGetValue
    )
}
