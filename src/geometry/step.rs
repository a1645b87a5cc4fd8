//! In: six small numbers. Out: a pose moved by them, the six that lead from one pose to another, and how a point moves.
//! The two meanings of six numbers are two types, so that a covariance of one is not mistaken for the other's.
//! Frame and unit: the frame that the pose leads to; mm, rad (docs/math.md, Board pose).

use super::{Frame, Mat3, Rigid, Vec3, exp, log, skew};
use nalgebra::{Matrix3x6, Vector6};

/// A motion of the whole body: a point P goes to exp(w) P + v, a pose to (exp(w), v) * pose. For small motions, the
/// point goes to P + v + w x P.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Translation, mm.
    pub v: Vec3,
    /// Rotation vector about the frame's origin, rad.
    pub w: Vec3,
}

impl Twist {
    /// From (v, w); panics for fewer than six numbers.
    pub fn new(s: &[f64]) -> Twist {
        Twist { v: Vec3::new(s[0], s[1], s[2]), w: Vec3::new(s[3], s[4], s[5]) }
    }
    /// The twist that leads from `from` to `to`.
    pub fn between<To: Frame, From: Frame>(from: &Rigid<To, From>, to: &Rigid<To, From>) -> Twist {
        let rotation = to.rotation * from.rotation.transpose();
        Twist { v: to.translation - rotation * from.translation, w: log(&rotation) }
    }
    /// The steady motion that leads to `to` within one unit of time, turning and shifting together. For two places on
    /// one screw, the nearer one's motion is a share of the farther one's. Rotations below half a turn.
    pub fn steady<F: Frame>(to: &Rigid<F, F>) -> Twist {
        let w = log(&to.rotation);
        let (a, k) = (w.norm(), skew(&w));
        // 1/12 is the limit at 0; below 1e-3 rad the exact value differs from it by less than 2e-9.
        let c = if a < 1e-3 { 1.0 / 12.0 } else { (1.0 - 0.5 * a / (0.5 * a).tan()) / (a * a) };
        Twist { v: to.translation - 0.5 * k * to.translation + c * k * k * to.translation, w }
    }
    /// The six numbers (v, w).
    pub fn vector(&self) -> Vector6<f64> {
        Vector6::new(self.v.x, self.v.y, self.v.z, self.w.x, self.w.y, self.w.z)
    }
    /// The pose after this motion.
    pub fn moved<To: Frame, From: Frame>(&self, pose: &Rigid<To, From>) -> Rigid<To, From> {
        let e = exp(&self.w);
        Rigid::new(e * pose.rotation, e * pose.translation + self.v)
    }
    /// Displacement of a point, to first order.
    pub fn at(&self, p: &Vec3) -> Vec3 {
        self.v + self.w.cross(p)
    }
    /// Derivative of a point by (v, w), at the point `p`.
    pub fn lever(p: &Vec3) -> Matrix3x6<f64> {
        translation_and_turn(p)
    }
}

/// A pose's two halves moved separately: t = t̂ + d, R = exp(r) R̂. The turn is about axes of the frame through the
/// origin of the posed object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftStep {
    /// Shift, mm.
    pub d: Vec3,
    /// Rotation vector, rad.
    pub r: Vec3,
}

impl LeftStep {
    /// From (d, r); panics for fewer than six numbers.
    pub fn new(s: &[f64]) -> LeftStep {
        LeftStep { d: Vec3::new(s[0], s[1], s[2]), r: Vec3::new(s[3], s[4], s[5]) }
    }
    /// The pose after this step.
    pub fn moved<To: Frame, From: Frame>(&self, pose: &Rigid<To, From>) -> Rigid<To, From> {
        Rigid::new(exp(&self.r) * pose.rotation, pose.translation + self.d)
    }
    /// Derivative of a point by (d, r), where `rotated` = R X is the point after the rotation alone.
    pub fn lever(rotated: &Vec3) -> Matrix3x6<f64> {
        translation_and_turn(rotated)
    }
}

/// The matrix [1 | -p x].
fn translation_and_turn(p: &Vec3) -> Matrix3x6<f64> {
    let mut j = Matrix3x6::zeros();
    j.fixed_view_mut::<3, 3>(0, 0).copy_from(&Mat3::identity());
    j.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(p));
    j
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Board, Camera};

    /// Levers compared with differences, for a pose far from the origin, where the two meanings differ most.
    #[test]
    fn points_follow_their_levers() {
        let pose: Rigid<Camera, Board> = Rigid::from_vectors(&Vec3::new(0.4, -0.9, 1.3), Vec3::new(30.0, -40.0, 300.0));
        let (x, h) = (Vec3::new(12.0, 34.0, 0.0), 1e-5);
        let (twist, left) = (Twist::lever(&pose.point(&x)), LeftStep::lever(&(pose.rotation * x)));
        for k in 0..6 {
            let by = |sign: f64| {
                let mut s = [0.0; 6];
                s[k] = sign * h;
                (Twist::new(&s).moved(&pose).point(&x), LeftStep::new(&s).moved(&pose).point(&x))
            };
            let (up, down) = (by(1.0), by(-1.0));
            assert!(((up.0 - down.0) / (2.0 * h) - twist.column(k)).norm() < 1e-5, "twist {k}");
            assert!(((up.1 - down.1) / (2.0 * h) - left.column(k)).norm() < 1e-5, "step {k}");
        }
        assert!((twist.column(4) - left.column(4)).norm() > 100.0, "two readings, two types");
    }

    /// Repeated steps of one screw.
    #[test]
    fn places_on_a_screw_lie_in_proportion() {
        for turn in [Vec3::new(0.02, -0.05, 0.01), Vec3::new(1e-4, 0.0, 0.0), Vec3::zeros()] {
            let step: Rigid<Camera, Camera> = Rigid::from_vectors(&turn, Vec3::new(0.3, -2.0, 5.0));
            let first = Twist::steady(&step).vector();
            let mut place = step;
            for k in 2..12 {
                place = place * step;
                let all = Twist::steady(&place).vector();
                assert!((all - first * f64::from(k)).norm() < 1e-9 * all.norm(), "{turn}: {k}: {all} of {first}");
            }
        }
    }

    #[test]
    fn the_twist_between_two_poses_leads_from_one_to_the_other() {
        let pose = |k: f64| -> Rigid<Camera, Board> {
            Rigid::from_vectors(&Vec3::new(0.4 * k, -0.9, 1.3), Vec3::new(30.0, -40.0 * k, 300.0))
        };
        let there = Twist::between(&pose(1.0), &pose(1.5)).moved(&pose(1.0));
        assert!((there.translation - pose(1.5).translation).norm() < 1e-10);
        assert!((there.rotation - pose(1.5).rotation).norm() < 1e-12);
    }
}
