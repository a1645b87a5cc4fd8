//! In: Execute calls of controller and robot, Speed and Change. Out: their answers.
//! Frame and unit: mm and degrees as Denso writes them; per cent.

use super::goal::{self, Goal};
use super::panel::text;
use super::{Connection, Done, Object, Outcome, TAKEN};
use crate::cell::kinematics::Unreachable;
use sheetlight::bcap::Variant;

impl Connection {
    pub(super) fn execute(&mut self, arguments: &[Variant]) -> Done {
        let object = self.object(arguments)?;
        let Some(Variant::Text(command)) = arguments.get(1) else { return Err(Outcome::BAD_ARGUMENT) };
        let (command, empty) = (command.to_ascii_lowercase(), Variant::Empty);
        let argument = arguments.get(2).unwrap_or(&empty);
        match object {
            Object::Controller => self.controller_command(&command, argument),
            Object::Robot => self.robot_command(&command, argument),
            Object::Variable(..) => Err(Outcome::BAD_HANDLE),
        }
    }

    fn controller_command(&mut self, command: &str, argument: &Variant) -> Done {
        let mut panel = self.controller.panel();
        match command {
            "clearerror" => {
                if !panel.emergency {
                    panel.errors.clear();
                }
                Ok(Some(Variant::Empty))
            }
            "getcurerrorcount" => Ok(Some(Variant::I32(panel.errors.len() as i32))),
            "getcurerrorinfo" => {
                let k = argument.as_f64().ok_or(Outcome::BAD_ARGUMENT)? as usize;
                let (code, text) = panel.errors.get(k).ok_or(Outcome::BAD_ARGUMENT)?;
                let zero = Variant::I32(0);
                let items = [Variant::I32(*code as i32), Variant::Text(text.clone()), zero.clone(), zero.clone()];
                let rest = [Variant::Text(String::new()), zero.clone(), zero];
                Ok(Some(Variant::Variants(items.into_iter().chain(rest).collect())))
            }
            "geterrordescription" => {
                let code = argument.as_f64().ok_or(Outcome::BAD_ARGUMENT)? as i64 as u32;
                Ok(Some(Variant::Text(text(code, panel.japanese))))
            }
            _ => Err(Outcome::UNKNOWN_COMMAND),
        }
    }

    fn robot_command(&mut self, command: &str, argument: &Variant) -> Done {
        let controller = self.controller.clone();
        let cell = controller.cell();
        let now = cell.clock().now();
        let (told, stamp) = {
            let panel = controller.panel();
            (panel.frozen.unwrap_or(now), panel.stamp)
        };
        let joints = cell.world().joints(told);
        let figure = controller.panel().figure.unwrap_or_else(|| goal::figure_of(&joints));
        let pose = || goal::position(&cell.world().reported(told), figure);
        let ms = stamp((now * 1e3).round());
        let timed = |values: Vec<f64>| Variant::F64s([ms].into_iter().chain(values).collect());
        match command {
            "curpos" => Ok(Some(Variant::F64s(pose()))),
            "curjnt" => Ok(Some(Variant::F64s(goal::joints(&joints)))),
            "curtrn" => Ok(Some(Variant::F64s(goal::transform(&cell.world().reported(now), figure)))),
            "highcurposex" => Ok(Some(timed(pose()))),
            "highcurjntex" => Ok(Some(timed(goal::joints(&joints)))),
            "curtool" => Ok(Some(Variant::I32(controller.panel().tool))),
            "curwork" => Ok(Some(Variant::I32(controller.panel().work))),
            "j2p" | "p2t" => self.convert(command, argument),
            "takearm" => self.take(argument),
            "givearm" => {
                let mut panel = controller.panel();
                panel.taken = panel.taken.filter(|by| *by != self.number);
                Ok(Some(Variant::Empty))
            }
            "motor" => {
                let on = argument.as_f64s().and_then(|a| a.first().copied()).ok_or(Outcome::BAD_ARGUMENT)? != 0.0;
                let mut panel = controller.panel();
                if on && !panel.errors.is_empty() {
                    return Err(Outcome::ERROR_PENDING);
                }
                if on && panel.emergency {
                    return Err(super::EMERGENCY);
                }
                panel.motor = on;
                Ok(Some(Variant::Empty))
            }
            "extspeed" => self.external_speed(argument),
            "outrange" => self.out_range(argument),
            "checkvirtualfence" => {
                let goal = goal::read(argument, &controller.panel().variables)?;
                let joints = controller.solve(&goal);
                let pose = joints.ok().map(|j| cell.world().drawn().forward(&j));
                Ok(Some(Variant::I32(i32::from(pose.is_some_and(|p| controller.fenced(&p))))))
            }
            _ => Err(Outcome::UNKNOWN_COMMAND),
        }
    }

    fn convert(&self, command: &str, argument: &Variant) -> Done {
        let goal = goal::read(argument, &self.controller.panel().variables)?;
        let world = self.controller.cell().world();
        Ok(Some(Variant::F64s(match (command, goal) {
            ("j2p", Goal::Joints(j)) => goal::position(&world.drawn().forward(&j), -1),
            ("p2t", Goal::Pose(pose)) => {
                let figure = match argument {
                    Variant::Variants(items) => {
                        items.first().and_then(Variant::as_f64s).and_then(|n| n.get(6).copied())
                    }
                    _ => None,
                };
                goal::transform(&pose, figure.unwrap_or(-1.0) as i32)
            }
            _ => return Err(super::BAD_POSE),
        })))
    }

    fn take(&mut self, argument: &Variant) -> Done {
        let mut panel = self.controller.panel();
        if !panel.errors.is_empty() {
            return Err(Outcome::ERROR_PENDING);
        }
        match panel.taken {
            Some(by) if by != self.number => Err(TAKEN),
            _ => {
                panel.taken = Some(self.number);
                let keep = argument.as_f64s().and_then(|a| a.get(1).copied()).unwrap_or(0.0) != 0.0;
                if !keep {
                    (panel.tool, panel.work, panel.internal) = (0, 0, 100.0);
                }
                Ok(Some(Variant::Empty))
            }
        }
    }

    fn external_speed(&mut self, argument: &Variant) -> Done {
        let wanted = argument.as_f64s().or_else(|| argument.as_f64().map(|x| vec![x])).ok_or(Outcome::BAD_TYPE)?;
        let mut panel = self.controller.panel();
        let mut next = panel.external;
        for (k, value) in wanted.iter().enumerate().take(3) {
            next[k] = match *value {
                -1.0 => panel.external[k],
                -2.0 if k > 0 => next[0] * next[0] / 100.0,
                v if v > 0.0 && v <= 100.0 => v,
                _ => return Err(Outcome::BAD_ARGUMENT),
            };
        }
        panel.external = next;
        Ok(Some(Variant::Empty))
    }

    fn out_range(&self, argument: &Variant) -> Done {
        let goal = goal::read(argument, &self.controller.panel().variables)?;
        Ok(Some(Variant::I32(match self.controller.solve(&goal) {
            Ok(_) => 0,
            Err(Unreachable::Limits(bits)) => i32::from(bits),
            Err(Unreachable::TooFar) => -1,
            Err(Unreachable::Singular) => -2,
        })))
    }

    pub(super) fn speed(&mut self, arguments: &[Variant]) -> Done {
        self.object(arguments)?;
        let percent = arguments.get(2).and_then(Variant::as_f64).ok_or(Outcome::BAD_TYPE)?;
        let mut panel = self.controller.panel();
        if panel.taken != Some(self.number) {
            return Err(super::NOT_TAKEN);
        }
        if !(percent > 0.0 && percent <= 100.0) {
            return Err(Outcome::BAD_ARGUMENT);
        }
        panel.internal = percent;
        Ok(None)
    }

    pub(super) fn change(&mut self, arguments: &[Variant]) -> Done {
        self.object(arguments)?;
        let Some(Variant::Text(name)) = arguments.get(1) else { return Err(Outcome::BAD_TYPE) };
        let name = name.to_ascii_lowercase();
        let numbered = |what: &str, most: i32| {
            name.strip_prefix(what).and_then(|n| n.parse::<i32>().ok()).filter(|n| (0..=most).contains(n))
        };
        let mut panel = self.controller.panel();
        match (numbered("tool", 63), numbered("work", 7)) {
            (Some(tool), _) => panel.tool = tool,
            (_, Some(work)) => panel.work = work,
            _ => return Err(Outcome::BAD_ARGUMENT),
        }
        Ok(None)
    }
}
