//! In: a controller's address. Out: one connection with its handles; poses, errors and numbers read over it.
//! Frame and unit: mm and degrees on the wire, base_from_flange in mm here.

use super::words;
use crate::arm::state::stamp;
use crate::arm::{ControllerError, PoseSource, TimedPose};
use crate::bcap::{Call, Client, ClientOptions, Handle, Network, Outcome, Variant};
use crate::fault::{Fault, Result};
use std::time::Instant;

/// Most errors that are read from a controller's list; further ones add nothing.
const MOST_ERRORS: i32 = 10;

/// One connection to a controller.
pub struct Session {
    pub client: Client,
    pub controller: Handle,
    pub robot: Handle,
    /// The controller sends its own time with a pose.
    timed: bool,
}

impl Session {
    pub fn open(address: &str, network: Network) -> Result<Session> {
        Session::with(address, ClientOptions { network, ..ClientOptions::default() })
    }

    pub fn with(address: &str, options: ClientOptions) -> Result<Session> {
        let mut client = Client::connect(address, options)?;
        let controller = client.controller()?;
        let robot = client.robot(controller)?;
        let mut session = Session { client, controller, robot, timed: false };
        session.timed = session.try_execute("HighCurPosEx", Variant::Empty)?.is_some();
        Ok(session)
    }

    pub fn execute(&mut self, command: &str, argument: Variant) -> Result<Variant> {
        self.client.execute(self.robot, command, argument).map_err(|e| self.in_its_words(e))
    }

    /// Executes a command; `None` if the controller does not know it.
    pub fn try_execute(&mut self, command: &str, argument: Variant) -> Result<Option<Variant>> {
        let request = vec![self.robot.into(), Variant::Text(command.into()), argument.clone()];
        match self.client.call(Call::RobotExecute, request)? {
            Ok(value) => Ok(Some(value)),
            Err(Outcome::UNKNOWN_COMMAND | Outcome::NOT_IMPLEMENTED) => Ok(None),
            // Executed again, to get the fault in words.
            Err(_) => self.execute(command, argument).map(Some),
        }
    }

    /// The whole number that a command answers; `None` if the controller does not know the command.
    pub fn number(&mut self, command: &str) -> Result<Option<i32>> {
        Ok(self.try_execute(command, Variant::Empty)?.and_then(|v| v.as_f64()).map(|x| x as i32))
    }

    fn controller_execute(&mut self, command: &str, argument: Variant) -> Result<Variant> {
        let request = vec![self.controller.into(), Variant::Text(command.into()), argument];
        self.client.ask(Call::ControllerExecute, request).map_err(|e| e.at(command))
    }

    /// The errors that are active on the controller, in its own words.
    pub fn errors(&mut self) -> Result<Vec<ControllerError>> {
        let count = self.controller_execute("GetCurErrorCount", Variant::Empty)?.as_f64().unwrap_or(0.0) as i32;
        let mut errors = Vec::new();
        for k in 0..count.min(MOST_ERRORS) {
            if let Variant::Variants(items) = self.controller_execute("GetCurErrorInfo", Variant::I32(k))? {
                let code = items.first().and_then(Variant::as_f64).map_or(0, |x| x as i64 as u32);
                let text = match items.get(1) {
                    Some(Variant::Text(text)) => words::plain(text),
                    _ => String::new(),
                };
                errors.push(ControllerError { code, text });
            }
        }
        Ok(errors)
    }

    /// The state of an input or output.
    pub fn signal(&mut self, number: u16) -> Result<bool> {
        let value = self.client.read(Call::ControllerGetVariable, self.controller, &format!("IO{number}"))?;
        value.as_f64().map(|x| x != 0.0).ok_or_else(|| {
            Fault::device(format!("IO{number} is {value:?}, true or false was expected"))
                .next("use the number of a digital input or output")
        })
    }

    /// Adds the controller's own errors to a refusal.
    pub fn in_its_words(&mut self, mut fault: Fault) -> Fault {
        let said = self.errors().unwrap_or_default();
        let said: Vec<String> = said.iter().map(|e| format!("{:08X} {}", e.code, e.text)).collect();
        if !said.is_empty() {
            fault.what = format!("{}; on the controller stands: {}", fault.what, said.join(", "));
        }
        fault
    }
}

impl PoseSource for Session {
    fn pose(&mut self) -> Result<TimedPose> {
        let asked = Instant::now();
        let command = if self.timed { "HighCurPosEx" } else { "CurPos" };
        let answer = self.execute(command, Variant::Empty)?;
        let here = Instant::now();
        let numbers = answer.as_f64s().unwrap_or_default();
        let (device, numbers) = match numbers.split_first() {
            Some((ms, pose)) if self.timed => (Some(stamp(ms * 1e-3).map_err(|e| e.at(command))?), pose),
            _ => (None, &numbers[..]),
        };
        let (base_from_flange, figure) = words::read_position(numbers).map_err(|e| e.at(command))?;
        Ok(TimedPose { base_from_flange, figure, asked, here, device })
    }
}
