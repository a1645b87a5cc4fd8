//! In: the address of a Denso controller (RC8). Out: its arm as a link that reads, moves, switches and halts.
//! Frame and unit: mm and degrees on the wire, base_from_flange in mm here; tool 0 and work 0 are required.

use super::halt::DensoHalt;
use super::session::Session;
use super::spare::Spare;
use super::words;
use crate::arm::{Allowed, Arm, Halt, Mode, Pace, PoseSource, Reach, SIMULATED, State, Switch, TimedPose, Way};
use crate::bcap::{Call, Network, Variant};
use crate::fault::{Fault, Kind, Result};
use crate::geometry::{Base, Flange, Rigid};
use std::sync::Arc;

/// Speed of the flange when all joints run at 100 %, mm/s: an upper bound for the VS-060 (joint 1 at 213.75
/// degrees/s, 0.92 m out).
const JOINTS_FULL_MM_S: f64 = 3500.0;
/// Turning rate of the flange then, degrees/s: the sum of the VS-060's joint rates, which no motion exceeds.
const JOINTS_FULL_DEG_S: f64 = 1240.0;
/// Slowest speed that is sent, %; controllers round smaller ones to zero.
const LEAST_PERCENT: f64 = 0.1;

/// Smallest acceleration that is requested, %.
const LEAST_RAMP: f32 = 5.0;

/// Speeds of a straight motion at 100 %.
#[derive(Clone, Copy, Debug)]
pub struct Full {
    /// Speed of the flange, mm/s.
    pub mm_s: f64,
    /// Turning rate of the flange, degrees/s.
    pub deg_s: f64,
}

/// A Denso arm with one connection for reading and moving and one that only halts; connections that switch outputs
/// are opened on request.
pub struct Denso {
    name: String,
    address: String,
    network: Network,
    full: Full,
    session: Session,
    halt: Arc<DensoHalt>,
    taken: bool,
}

impl Denso {
    pub fn open(name: &str, address: &str, network: Network, full: Full) -> Result<Denso> {
        let session = Session::open(address, network)?;
        let halt = Arc::new(DensoHalt::open(address)?);
        let (name, address) = (name.to_owned(), address.to_owned());
        Ok(Denso { name, address, network, full, session, halt, taken: false })
    }

    fn robot_variable(&mut self, name: &str) -> Result<Variant> {
        self.session.client.read(Call::RobotGetVariable, self.session.robot, name)
    }
    fn controller_variable(&mut self, name: &str) -> Result<Variant> {
        self.session.client.read(Call::ControllerGetVariable, self.session.controller, name)
    }

    /// Share of the full speeds, %. On a straight path translation and turn end together: whichever takes longer
    /// determines the time.
    fn percent(&self, way: Way, pace: &Pace) -> Result<f64> {
        let share = match way {
            Way::Straight => (pace.flange_mm_s / self.full.mm_s).max(pace.turn_deg_s / self.full.deg_s),
            Way::Joint => {
                let fastest = JOINTS_FULL_MM_S.max(self.full.mm_s) + JOINTS_FULL_DEG_S.to_radians() * pace.lever_mm;
                (pace.flange_mm_s / fastest).min(pace.turn_deg_s / JOINTS_FULL_DEG_S)
            }
        };
        of_full(100.0 * share, pace.flange_mm_s)
    }
}

/// A share of the full speeds, as it is sent. A smaller one than the controller knows is refused: the least would be
/// faster than what was confirmed.
fn of_full(percent: f64, flange_mm_s: f64) -> Result<f64> {
    // A share that is the least but for rounding is the least.
    if !(percent >= LEAST_PERCENT * (1.0 - 1e-6)) {
        return Err(Fault::refused(format!(
            "{flange_mm_s:.2} mm/s is {percent:.3} % of the controller's full speed, the least is {LEAST_PERCENT} %"
        ))
        .cause("controllers round smaller shares to zero, and a larger one would be faster than was confirmed")
        .next("move faster, or state a lower full speed for the link (?full=) and set the same on the controller"));
    }
    Ok(percent.clamp(LEAST_PERCENT, 100.0))
}

impl PoseSource for Denso {
    fn pose(&mut self) -> Result<TimedPose> {
        self.session.pose()
    }
}

impl Arm for Denso {
    fn name(&self) -> &str {
        &self.name
    }

    fn state(&mut self) -> Result<State> {
        let flag = |v: Variant| v.as_f64().map(|x| x != 0.0);
        let mode = match self.controller_variable("@MODE")?.as_f64() {
            Some(1.0) => Mode::Manual,
            Some(2.0) => Mode::Teach,
            Some(3.0) => Mode::Automatic,
            _ => Mode::Unknown,
        };
        let model = match self.robot_variable("@TYPE_NAME")? {
            Variant::Text(name) => words::plain(&name),
            other => format!("{other:?}"),
        };
        Ok(State {
            model,
            mode,
            motor: flag(self.robot_variable("@SERVO_ON")?),
            busy: flag(self.robot_variable("@BUSY_STATUS")?),
            emergency_stop: flag(self.controller_variable("@EMERGENCY_STOP")?),
            errors: self.session.errors()?,
            tool: self.session.number("CurTool")?,
            work: self.session.number("CurWork")?,
        })
    }

    fn simulated(&mut self) -> Result<bool> {
        let [variable, says] = SIMULATED;
        match self.controller_variable(variable) {
            Ok(value) => Ok(matches!(value, Variant::Text(text) if text == says)),
            // A real controller does not know the variable.
            Err(e) if e.kind == Kind::Refused => Ok(false),
            Err(e) => Err(e),
        }
    }

    fn watch(&self) -> Result<Box<dyn PoseSource>> {
        Ok(Box::new(Session::open(&self.address, self.network)?))
    }

    fn stop(&self) -> Result<Arc<dyn Halt>> {
        Ok(self.halt.clone())
    }

    fn reach(&mut self, to: &Rigid<Base, Flange>) -> Result<Reach> {
        let pose = Variant::Variants(vec![words::position(to), Variant::Text("P".into())]);
        let asked = Variant::Variants(vec![pose.clone(), Variant::I32(-1), Variant::I32(-1)]);
        if let Some(range) = self.session.try_execute("OutRange", asked)? {
            let code = range.as_f64().map_or(i64::MIN, |x| x as i64);
            if code != 0 {
                return Ok(Reach::Refused(words::out_of_range(code)));
            }
        }
        Ok(match self.session.try_execute("CheckVirtualFence", pose)?.and_then(|v| v.as_f64()) {
            Some(0.0) => Reach::Free,
            Some(fence) => Reach::Refused(format!("it lies in the controller's virtual fence {fence}, limit 0")),
            None => Reach::Unasked,
        })
    }

    fn take(&mut self) -> Result<()> {
        if !self.taken {
            self.session.execute("TakeArm", Variant::I32s(vec![0, 0]))?;
            self.taken = true;
        }
        Ok(())
    }

    fn give(&mut self) -> Result<()> {
        if std::mem::take(&mut self.taken) {
            self.session.execute("GiveArm", Variant::Empty)?;
        }
        Ok(())
    }

    fn make(&mut self, allowed: Allowed) -> Result<()> {
        let motion = allowed.motion();
        let percent = self.percent(motion.way, allowed.pace())? as f32;
        // By default a controller uses the square of the speed (0.25 % at 50 mm/s). Steps of less than a millimetre
        // then take as long as steps of many millimetres.
        let ramps = (2.0 * percent).clamp(LEAST_RAMP, 100.0);
        self.session.execute("ExtSpeed", Variant::F32s(vec![percent, ramps, ramps]))?;
        let way = Variant::I32(if motion.way == Way::Straight { 2 } else { 1 });
        let pose = vec![words::position(&motion.to), Variant::Text("P".into()), Variant::Text("@E".into())];
        let robot = self.session.robot.into();
        self.session
            .client
            .ask(Call::RobotMove, vec![robot, way, Variant::Variants(pose), Variant::Text(String::new())])
            .map(|_| ())
            .map_err(|e| self.session.in_its_words(e))
    }

    fn switch(&self) -> Result<Box<dyn Switch>> {
        Ok(Box::new(Spare::open(&self.address)?))
    }

    fn signal(&mut self, number: u16) -> Result<bool> {
        self.session.signal(number).map_err(|e| e.at(&self.name))
    }
}

impl Drop for Denso {
    fn drop(&mut self) {
        // Releases the arm for other programs; the controller does the same when the connection ends.
        let _ = self.give();
    }
}

#[cfg(test)]
mod tests {
    use super::of_full;

    #[test]
    fn a_motion_is_never_made_faster_than_it_was_confirmed() {
        assert_eq!(of_full(0.1, 1.0).unwrap(), 0.1);
        assert_eq!(of_full(250.0, 2500.0).unwrap(), 100.0);
        let fault = of_full(0.01, 0.1).unwrap_err();
        assert!(fault.what.contains("0.10 mm/s is 0.010 %") && fault.next.contains("?full="), "{fault}");
        assert!(of_full(f64::NAN, 1.0).is_err());
    }
}
