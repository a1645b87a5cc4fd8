//! In: a robot behind its rules, a camera with its lights, a person who confirms. Out: the cell that a calibration
//! drives.
//! Frame and unit: base_from_flange, mm, mm/s. Every move is shown and confirmed; moves that the rules do not allow
//! are not made.

use super::cell::{Cell, Light, Went};
use crate::arm::rules::{Confirmation, Guard, Limits, Plan, Proposal, Straight};
use crate::arm::{Motion, Outputs, Reach, Switchboard, Way};
use crate::camera::Readout;
use crate::capture::PictureSource;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::Image;
use crate::recording::Beam;
use crate::station::job::eye::Eye;
use crate::station::job::{Ask, Operator};
use std::time::Duration;

/// Waiting time after a move, while arm and camera still swing.
const SETTLE: Duration = Duration::from_millis(200);
/// Share of the rules' longest step and widest turn that a leg uses at most.
const BELOW: f64 = 0.95;
/// Number of poses along a straight path for which the controller is asked about reach.
const ASKED: usize = 4;

/// A real cell, or one that is simulated at its network interfaces.
pub struct ArmCell<'a> {
    guard: &'a mut Guard,
    eye: Eye,
    operator: &'a mut dyn Operator,
    speed_mm_s: Option<f64>,
    stops: usize,
}

impl<'a> ArmCell<'a> {
    /// `guard` is armed; `speed_mm_s` is the requested speed, which the rules' own limit also bounds.
    ///
    /// # Errors
    /// The outputs cannot be switched.
    pub fn new(
        guard: &'a mut Guard,
        camera: Box<dyn PictureSource>,
        outputs: Outputs,
        operator: &'a mut dyn Operator,
        speed_mm_s: Option<f64>,
    ) -> Result<ArmCell<'a>> {
        let lights = Switchboard::of(guard.link(), outputs)?;
        Ok(ArmCell { guard, eye: Eye::new(camera, lights), operator, speed_mm_s, stops: 0 })
    }

    fn limits(&self) -> Result<Limits> {
        self.guard.limits().cloned().ok_or_else(|| {
            Fault::refused("no workspace is stated: the limits of the arm are unknown")
                .cause("station.toml has no [motion]")
                .next("write [motion] with workspace = { from_mm = [...], to_mm = [...] } (docs/robots.md)")
        })
    }

    /// Proposes until a person has answered yes or no.
    fn agreed(&mut self, plan: Plan, to: &Rigid<Base, Flange>) -> Result<(Proposal, Confirmation)> {
        let t = to.translation;
        let says = vec![format!("stop {}: flange to {:.1} {:.1} {:.1} mm", self.stops, t.x, t.y, t.z)];
        loop {
            let proposal = self.guard.propose(plan.clone())?;
            if !proposal.passed() {
                return Err(Fault::refused(proposal.missed().join("; "))
                    .cause("a condition named above is not met")
                    .next("correct it and begin again; the arm stands still"));
            }
            let ask = Ask { step: "calibrate", says: says.clone(), question: "go there?", proposal: &proposal };
            if let Some(confirmation) = self.operator.confirm(&ask)? {
                return Ok((proposal, confirmation));
            }
            if !self.operator.again() {
                return Err(Fault::refused("the move was not confirmed")
                    .cause("somebody said no")
                    .next("begin again where the arm may move"));
            }
        }
    }
}

/// Divides a straight path into legs that meet the rules.
fn legs(way: &Straight, limits: &Limits, speed_mm_s: f64) -> Vec<Motion> {
    let steps = way.shift.norm() / (BELOW * limits.max_step_mm);
    let turns = way.turn.norm().to_degrees() / (BELOW * limits.max_turn_deg);
    let n = steps.max(turns).ceil().max(1.0) as usize;
    let leg = |k: usize| Motion { to: way.at(k as f64 / n as f64), way: Way::Straight, speed_mm_s };
    (1..=n).map(leg).collect()
}

impl Cell for ArmCell<'_> {
    fn pose(&mut self) -> Result<Rigid<Base, Flange>> {
        Ok(self.guard.link().pose()?.base_from_flange)
    }

    fn may(&mut self, to: &Rigid<Base, Flange>) -> Result<bool> {
        let from = self.pose()?;
        if !self.guard.keeps_clear(&from, to) {
            return Ok(false);
        }
        let way = Straight::new(&from, to);
        // The end may be within reach although the path to it is not.
        for k in (1..=ASKED).rev() {
            if matches!(self.guard.link().reach(&way.at(k as f64 / ASKED as f64))?, Reach::Refused(_)) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn go(&mut self, to: &Rigid<Base, Flange>) -> Result<Went> {
        let (limits, from) = (self.limits()?, self.pose()?);
        let speed = self.speed_mm_s.map_or(limits.speed_mm_s, |s| s.min(limits.speed_mm_s));
        let legs = legs(&Straight::new(&from, to), &limits, speed);
        let last = *legs.last().expect("one or more");
        let plan = Plan { legs, ..Plan::single("calibrate", "the next picture of the board", last) };
        self.stops += 1;
        let (proposal, confirmation) = self.agreed(plan, to)?;
        let made = self.guard.attempt(&proposal, confirmation, &mut |_, _| Ok(()));
        self.operator.over();
        if let Some(refusal) = made? {
            return Ok(Went::NotBegun(refusal.what));
        }
        std::thread::sleep(SETTLE);
        Ok(Went::There(self.pose()?))
    }

    fn readout(&self) -> Option<Readout> {
        self.eye.pictures().readout
    }

    fn picture(&mut self, light: Light) -> Result<Image> {
        let beam = match light {
            Light::Room => None,
            Light::Line => Some(Beam::Line),
            Light::Pointer => Some(Beam::Pointer),
        };
        // A laser is on only for its picture: between two stops a person is asked, and may take time.
        let picture = self.eye.picture(beam);
        self.eye.lights.after(picture)
    }
}
