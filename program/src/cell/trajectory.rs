//! In: joints at the start, a pose or joints at the end, speeds. Out: the joints at any time of the motion, with
//! limited speed and acceleration; or why the motion is not possible.
//! Frame and unit: base_from_flange, mm; joints rad; times s from the motion's start.

use super::kinematics::{Joints, SPEEDS, Unreachable, Vs060, out_of_limits};
use sheetlight::geometry::{Base, Flange, Rigid, exp, log};

/// Full speed and acceleration of straight motions, mm/s and mm/s².
pub const STRAIGHT: [f64; 2] = [1000.0, 5000.0];
/// The same for rotation, rad/s and rad/s².
const TURNING: [f64; 2] = [3.5, 17.0];
/// Time in which joints reach their full speed, s.
const RAMP: f64 = 0.25;
/// A halted arm brakes at this multiple of its full acceleration: a real arm stops from 1 m/s in about 80 ms.
const BRAKE: f64 = 2.5;
/// Distance between knots of a straight path, mm and rad. The arc that interpolated joint angles make between knots
/// deviates by less than 0.001 mm.
const KNOTS: [f64; 2] = [2.0, 0.01];
/// Joints that turn more than this between two knots, rad, have changed the arm's figure.
const JUMP: f64 = 0.35;

/// Fractions of the full speeds and accelerations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// 0 to 1.
    pub speed: f64,
    /// 0 to 1.
    pub acceleration: f64,
}

/// Trapezoidal profile from 0 to 1 over time; a halt cuts it short.
#[derive(Clone, Copy, Debug)]
struct Profile {
    speed: f64,
    acceleration: f64,
    /// Time, position and speed when it was halted.
    halted: Option<(f64, f64, f64)>,
}

impl Profile {
    fn new(speed: f64, acceleration: f64) -> Profile {
        Profile { speed: speed.min(acceleration.sqrt()), acceleration, halted: None }
    }
    fn ramp(&self) -> f64 {
        self.speed / self.acceleration
    }
    fn whole(&self) -> f64 {
        1.0 / self.speed + self.ramp()
    }
    fn brake(&self) -> f64 {
        BRAKE * self.acceleration.max(4.0 * self.speed)
    }
    fn duration(&self) -> f64 {
        self.halted.map_or_else(|| self.whole(), |(t, _, v)| t + v / self.brake())
    }
    /// Position and speed.
    fn at(&self, t: f64) -> (f64, f64) {
        if let Some((since, u, v)) = self.halted.filter(|h| t > h.0) {
            let dt = (t - since).min(v / self.brake());
            return (u + v * dt - 0.5 * self.brake() * dt * dt, v - self.brake() * dt);
        }
        let (whole, ramp, a) = (self.whole(), self.ramp(), self.acceleration);
        let t = t.clamp(0.0, whole);
        if t < ramp {
            (0.5 * a * t * t, a * t)
        } else if t <= whole - ramp {
            (self.speed * (t - 0.5 * ramp), self.speed)
        } else {
            let left = whole - t;
            (1.0 - 0.5 * a * left * left, a * left)
        }
    }
}

/// A motion of the joints.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Evenly spaced along the path.
    knots: Vec<Joints>,
    profile: Profile,
}

impl Trajectory {
    /// All joints at once, each within its limits.
    pub fn joint(from: &Joints, to: &Joints, share: Share) -> Result<Trajectory, Unreachable> {
        match out_of_limits(to) {
            0 => {}
            bits => return Err(Unreachable::Limits(bits)),
        }
        // Fraction of the path per second at full speed.
        let slowest = from.iter().zip(to).zip(SPEEDS).map(|((a, b), full)| full.to_radians() / (b - a).abs().max(1e-9));
        let full = slowest.fold(1e9, f64::min);
        let profile = Profile::new(full * share.speed, full / RAMP * share.acceleration);
        Ok(Trajectory { knots: vec![*from, *to], profile })
    }

    /// A straight line of the flange, with rotation at a constant rate.
    pub fn straight(
        arm: &Vs060,
        from: &Joints,
        to: &Rigid<Base, Flange>,
        share: Share,
    ) -> Result<Trajectory, Unreachable> {
        let start = arm.forward(from);
        let (way, turn) = (to.translation - start.translation, log(&(to.rotation * start.rotation.transpose())));
        let steps = (way.norm() / KNOTS[0]).max(turn.norm() / KNOTS[1]).ceil().max(1.0) as usize;
        let mut knots = vec![*from];
        for k in 1..=steps {
            let u = k as f64 / steps as f64;
            let pose = Rigid::new(exp(&(turn * u)) * start.rotation, start.translation + way * u);
            let before = knots[k - 1];
            let joints = arm.inverse(&pose, &before)?;
            if joints.iter().zip(&before).any(|(a, b)| (a - b).abs() > JUMP) {
                return Err(Unreachable::Singular);
            }
            knots.push(joints);
        }
        let full = |k: usize| (STRAIGHT[k] / way.norm().max(1e-6)).min(TURNING[k] / turn.norm().max(1e-9));
        let joints = knots
            .windows(2)
            .flat_map(|w| (0..6).map(|j| SPEEDS[j].to_radians() / (w[1][j] - w[0][j]).abs().max(1e-12)));
        let by_joints = joints.fold(f64::INFINITY, f64::min) / steps as f64;
        let profile = Profile::new((full(0) * share.speed).min(by_joints), full(1) * share.acceleration);
        Ok(Trajectory { knots, profile })
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.profile.duration()
    }

    /// Fraction of the path that is done, 0 to 1.
    pub fn done(&self, t: f64) -> f64 {
        self.profile.at(t).0
    }

    /// The joints, rad.
    pub fn joints(&self, t: f64) -> Joints {
        let last = self.knots.len() - 1;
        let place = self.done(t).clamp(0.0, 1.0) * last as f64;
        let k = (place as usize).min(last.saturating_sub(1));
        let f = place - k as f64;
        std::array::from_fn(|j| self.knots[k][j] + f * (self.knots[(k + 1).min(last)][j] - self.knots[k][j]))
    }

    /// Brakes from time `t` on; no effect on a motion that has ended or is already braking.
    pub fn halt(&mut self, t: f64) {
        if t < self.duration() && self.profile.halted.is_none() {
            let (u, v) = self.profile.at(t);
            self.profile.halted = Some((t, u, v));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::geometry::Vec3;

    const START: [f64; 6] = [0.0, 0.0, 90.0, 0.0, 90.0, 0.0];

    #[test]
    fn a_straight_motion_is_straight_and_keeps_its_speed() {
        let (arm, from) = (Vs060::drawn(), START.map(f64::to_radians));
        let start = arm.forward(&from);
        let to = Rigid::new(
            exp(&Vec3::new(0.1, -0.1, 0.3)) * start.rotation,
            start.translation + Vec3::new(90.0, 60.0, -80.0),
        );
        let share = Share { speed: 0.05, acceleration: 0.1 };
        let motion = Trajectory::straight(&arm, &from, &to, share).unwrap();
        let (n, way) = (400, (to.translation - start.translation).normalize());
        let mut last = start.translation;
        for i in 1..=n {
            let t = motion.duration() * f64::from(i) / f64::from(n);
            let at = arm.forward(&motion.joints(t)).translation;
            let off = at - start.translation;
            assert!((off - way * off.dot(&way)).norm() < 0.002, "{}", (off - way * off.dot(&way)).norm());
            let speed = (at - last).norm() * f64::from(n) / motion.duration();
            assert!(speed < 50.5, "{speed}");
            last = at;
        }
        assert!(arm.forward(&motion.joints(motion.duration())).difference(&to).1 < 1e-6);
    }

    #[test]
    fn a_halted_motion_stops_soon_and_stays() {
        let from = START.map(f64::to_radians);
        let to = [60.0, 10.0, 80.0, 5.0, 80.0, 30.0].map(f64::to_radians);
        let mut motion = Trajectory::joint(&from, &to, Share { speed: 0.5, acceleration: 0.5 }).unwrap();
        let at = 0.5 * motion.duration();
        motion.halt(at);
        assert!(motion.duration() - at < 0.12, "{}", motion.duration() - at);
        let (end, later) = (motion.joints(motion.duration()), motion.joints(motion.duration() + 9.0));
        assert!(end.iter().zip(&later).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(motion.done(motion.duration()) < 0.6);
    }
}
