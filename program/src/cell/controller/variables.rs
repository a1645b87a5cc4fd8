//! In: names and values of variables. Out: variables of the controller and the robot, inputs and outputs.
//! Frame and unit: mm and degrees as Denso writes them.

use super::{Connection, Done, Object, Outcome, goal};
use sheetlight::arm::SIMULATED;
use sheetlight::bcap::Variant;

/// Kinds of program variables by their letters, longer ones first.
const KINDS: [&str; 8] = ["IO", "I", "F", "D", "S", "P", "J", "T"];

fn kind(name: &str) -> Option<&'static str> {
    KINDS
        .into_iter()
        .find(|k| name.strip_prefix(k).is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit())))
}

/// Initial value of a variable.
fn fresh(kind: &str) -> Variant {
    match kind {
        "I" => Variant::I32(0),
        "F" => Variant::F32(0.0),
        "D" => Variant::F64(0.0),
        "S" => Variant::Text(String::new()),
        "P" => Variant::F32s(vec![0.0; 7]),
        "J" => Variant::F32s(vec![0.0; 8]),
        "T" => Variant::F32s(vec![0.0; 10]),
        _ => Variant::Bool(false),
    }
}

/// The value as a variable of this kind stores it; `None` if the kind does not accept it.
fn fits(kind: &str, value: &Variant) -> Option<Variant> {
    let numbers = |n: usize| Some(value.as_f64s().filter(|v| v.len() <= n)?.into_iter().map(|x| x as f32).collect());
    match kind {
        "I" => Some(Variant::I32(value.as_f64()? as i32)),
        "F" => Some(Variant::F32(value.as_f64()? as f32)),
        "D" => Some(Variant::F64(value.as_f64()?)),
        "S" => matches!(value, Variant::Text(_)).then(|| value.clone()),
        "P" => numbers(7).map(Variant::F32s),
        "J" => numbers(8).map(Variant::F32s),
        "T" => numbers(10).map(Variant::F32s),
        _ => Some(Variant::Bool(value.as_f64()? != 0.0)),
    }
}

/// Names of the system variables: of the robot, of the controller.
const OF_ROBOT: [&str; 6] =
    ["@BUSY_STATUS", "@SERVO_ON", "@CURRENT_POSITION", "@CURRENT_ANGLE", "@TYPE_NAME", "@EXTSPEED"];
const OF_CONTROLLER: [&str; 4] = ["@MODE", "@ERROR_CODE", "@EMERGENCY_STOP", SIMULATED[0]];

impl Connection {
    pub(super) fn variable(&mut self, arguments: &[Variant], of_robot: bool) -> Done {
        match (self.object(arguments)?, of_robot) {
            (Object::Robot, true) | (Object::Controller, false) => {}
            _ => return Err(Outcome::BAD_HANDLE),
        }
        let Some(Variant::Text(name)) = arguments.get(1) else { return Err(Outcome::BAD_ARGUMENT) };
        let name = name.to_ascii_uppercase();
        let known = if of_robot {
            OF_ROBOT.contains(&&*name)
        } else {
            OF_CONTROLLER.contains(&&*name) || kind(&name).is_some()
        };
        if !known || (name == SIMULATED[0] && self.controller.panel().as_real) {
            return Err(Outcome::NO_SUCH_OBJECT);
        }
        self.grant(Object::Variable(name))
    }

    pub(super) fn get_value(&mut self, arguments: &[Variant]) -> Done {
        let Object::Variable(name) = self.object(arguments)? else { return Err(Outcome::BAD_HANDLE) };
        let controller = self.controller.clone();
        let cell = controller.cell();
        let now = cell.clock().now();
        let joints = cell.world().joints(now);
        let panel = controller.panel();
        Ok(Some(match &*name {
            name if name == SIMULATED[0] => Variant::Text(SIMULATED[1].into()),
            "@MODE" => Variant::I32(panel.mode),
            "@ERROR_CODE" => Variant::I32(panel.errors.first().map_or(0, |e| e.0 as i32)),
            "@EMERGENCY_STOP" => Variant::Bool(panel.emergency),
            "@BUSY_STATUS" => Variant::Bool(cell.world().moving_until(now).is_some()),
            "@SERVO_ON" => Variant::Bool(panel.motor),
            "@CURRENT_POSITION" => Variant::F64s(goal::position(&cell.world().reported(now), goal::figure_of(&joints))),
            "@CURRENT_ANGLE" => Variant::F64s(goal::joints(&joints)),
            "@TYPE_NAME" => Variant::Text("VS060A3-AV6-NNN-NNN".into()),
            "@EXTSPEED" => Variant::F32(panel.external[0] as f32),
            other => match kind(other) {
                Some("IO") => Variant::Bool(cell.world().output(number(other), now)),
                Some(k) => panel.variables.get(other).cloned().unwrap_or_else(|| fresh(k)),
                None => return Err(Outcome::NO_SUCH_OBJECT),
            },
        }))
    }

    pub(super) fn put_value(&mut self, arguments: &[Variant]) -> Done {
        let Object::Variable(name) = self.object(arguments)? else { return Err(Outcome::BAD_HANDLE) };
        let value = arguments.get(1).ok_or(Outcome::BAD_ARGUMENT)?;
        let flag = || value.as_f64().map(|x| x != 0.0).ok_or(Outcome::BAD_TYPE);
        match &*name {
            "@SERVO_ON" => self.controller.panel().motor = flag()?,
            "@EXTSPEED" => {
                let percent = value.as_f64().ok_or(Outcome::BAD_TYPE)?;
                if !(percent > 0.0 && percent <= 100.0) {
                    return Err(Outcome::BAD_ARGUMENT);
                }
                self.controller.panel().external[0] = percent;
            }
            other => match kind(other) {
                None => return Err(Outcome::NOT_WRITABLE),
                Some("IO") => {
                    let (on, cell) = (flag()?, self.controller.cell());
                    let now = cell.clock().now();
                    cell.world().switch(now, number(other), on);
                }
                Some(k) => {
                    let value = fits(k, value).ok_or(Outcome::BAD_TYPE)?;
                    self.controller.panel().variables.insert(name, value);
                }
            },
        }
        Ok(None)
    }
}

fn number(name: &str) -> u16 {
    name[2..].parse().unwrap_or(u16::MAX)
}
