//! In: a Move or a Halt. Out: one motion of the cell's arm; when and with which outcome it ended.
//! Frame and unit: base_from_flange, mm; s of the cell; fractions of the full speed.

use super::goal::{Goal, read};
use super::panel::AUTOMATIC;
use super::{Answer, Connection, Controller, FENCE, NOT_TAKEN, Object, Outcome, WRONG_MODE};
use crate::cell::kinematics::{Joints, Unreachable};
use crate::cell::trajectory::{Share, Trajectory};
use sheetlight::bcap::Variant;
use sheetlight::geometry::{Base, Flange, Rigid};

/// A motion that was begun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket(u64);

/// The controller's answer for a pose that cannot be reached.
pub fn unreachable(why: Unreachable) -> Outcome {
    match why {
        Unreachable::TooFar => super::OUT_OF_REACH,
        Unreachable::Singular => super::OUT_OF_REACH,
        // The first joint that is out of its limits.
        Unreachable::Limits(bits) => Outcome(0x8320_4071 + bits.trailing_zeros()),
    }
}

impl Controller {
    /// Joints that reach a goal from the arm's current joints.
    pub(super) fn solve(&self, goal: &Goal) -> Result<Joints, Unreachable> {
        let world = self.cell.world();
        match goal {
            Goal::Joints(joints) => match crate::cell::kinematics::out_of_limits(joints) {
                0 => Ok(*joints),
                bits => Err(Unreachable::Limits(bits)),
            },
            Goal::Pose(pose) => world.drawn().inverse(pose, &world.joints(self.cell.clock().now())),
        }
    }

    /// Whether a flange pose lies in the virtual fence.
    pub(super) fn fenced(&self, pose: &Rigid<Base, Flange>) -> bool {
        let p = pose.translation;
        self.panel().fence.is_some_and(|[low, high]| (0..3).all(|k| p[k] >= low[k] && p[k] <= high[k]))
    }

    /// Stops the motion under way; its Move is answered with `why`.
    pub(super) fn halt(&self, connection: Option<u64>, why: Outcome) {
        self.settle();
        let mut panel = self.panel();
        let moving = self.cell.world().halt(self.cell.clock().now(), connection);
        if let Some((_, stopped)) = panel.motion.as_mut().filter(|_| moving) {
            stopped.get_or_insert(why);
        }
    }

    /// Records the outcome of a motion that has ended.
    pub(super) fn settle(&self) {
        let mut panel = self.panel();
        let Some((number, stopped)) = panel.motion else { return };
        let now = self.cell.clock().now();
        let mut world = self.cell.world();
        if world.moving_until(now).is_none() {
            world.arrived(now);
            panel.motion = None;
            panel.ended.insert(number, stopped.unwrap_or(Outcome::OK));
        }
    }

    /// Outcome of a motion; `None` while it is under way.
    pub fn motion(&self, ticket: Ticket) -> Option<Outcome> {
        self.settle();
        let mut panel = self.panel();
        match panel.motion {
            Some((number, _)) if number == ticket.0 => None,
            _ => Some(panel.ended.remove(&ticket.0).unwrap_or(Outcome::OK)),
        }
    }
}

impl Connection {
    pub(super) fn begin_move(&mut self, arguments: &[Variant]) -> Result<Answer, Outcome> {
        let controller = self.controller.clone();
        controller.settle();
        if !matches!(self.object(arguments)?, Object::Robot) {
            return Err(Outcome::BAD_HANDLE);
        }
        let goal = {
            let panel = controller.panel();
            may_move(&panel, self.number)?;
            read(arguments.get(2).ok_or(Outcome::BAD_ARGUMENT)?, &panel.variables)?
        };
        let straight = match arguments.get(1).and_then(Variant::as_f64) {
            Some(1.0) => false,
            Some(2.0) => true,
            _ => return Err(Outcome::BAD_ARGUMENT),
        };
        let words = match arguments.get(3) {
            Some(Variant::Text(words)) => words.to_ascii_uppercase(),
            _ => String::new(),
        };
        let joints = controller.solve(&goal).map_err(unreachable)?;
        let to = controller.cell.world().drawn().forward(&joints);
        if controller.fenced(&to) {
            return Err(FENCE);
        }
        let mut panel = controller.panel();
        if panel.motion.is_some() {
            return Err(Outcome::BUSY);
        }
        let share = share(&panel, &words)?;
        let mut world = controller.cell.world();
        let now = controller.cell.clock().now();
        let from = world.joints(now);
        let trajectory = match (&goal, straight) {
            (Goal::Pose(pose), true) => Trajectory::straight(world.drawn(), &from, pose, share),
            (Goal::Joints(_), true) => Trajectory::straight(world.drawn(), &from, &to, share),
            _ => Trajectory::joint(&from, &joints, share),
        };
        world.begin(now, trajectory.map_err(unreachable)?, straight, self.number);
        panel.motions += 1;
        if let Some(figure) = panel.next_figure.take() {
            panel.figure = Some(figure);
        }
        let number = panel.motions;
        panel.motion = Some((number, None));
        if words.split(',').any(|w| w.trim() == "NEXT") {
            return Ok(Answer::Done(Outcome::OK, None));
        }
        Ok(Answer::Moving(Ticket(number)))
    }
}

/// Checks motor, errors, mode and arm in the order in which a controller checks them.
fn may_move(panel: &super::Panel, connection: u64) -> Result<(), Outcome> {
    match () {
        () if panel.emergency => Err(super::EMERGENCY),
        () if !panel.errors.is_empty() => Err(Outcome::ERROR_PENDING),
        () if !panel.motor => Err(Outcome::MOTOR_OFF),
        () if panel.mode != AUTOMATIC => Err(WRONG_MODE),
        () if panel.taken != Some(connection) => Err(NOT_TAKEN),
        () => Ok(()),
    }
}

/// Product of the speeds: external, internal, and the motion's (`SPEED=50`, `SPEED=F2`).
fn share(panel: &super::Panel, words: &str) -> Result<Share, Outcome> {
    let own = words.split(',').filter_map(|w| w.split_once('=')).find(|(k, _)| matches!(k.trim(), "SPEED" | "S"));
    let own = match own.map(|(_, v)| v.trim()) {
        None => 100.0,
        Some(v) => match v.parse::<f64>() {
            Ok(percent) => percent,
            Err(_) => panel.variables.get(v).and_then(Variant::as_f64).ok_or(Outcome::BAD_ARGUMENT)?,
        },
    };
    if !(own > 0.0 && own <= 100.0) {
        return Err(Outcome::BAD_ARGUMENT);
    }
    let [speed, acceleration, _] = panel.external;
    let speed = speed * panel.internal * own / 1e6;
    Ok(Share { speed: speed.max(1e-4), acceleration: (acceleration / 100.0).max(1e-3) })
}
