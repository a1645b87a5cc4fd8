//! In: joint angles or a flange pose. Out: the other of the two, for the nominal Denso VS-060 or for one specimen.
//! Frame and unit: base_from_flange, mm; joints rad. Chain, limits and speeds: Denso's robot description of the
//! VS060A3.

use rs_opw_kinematics::glam::{DMat3, DQuat, DVec3};
use rs_opw_kinematics::kinematic_traits::{Kinematics, Pose};
use rs_opw_kinematics::kinematics_impl::OPWKinematics;
use rs_opw_kinematics::parameters::opw_kinematics::Parameters;
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use std::f64::consts::TAU;

/// Six joint angles, rad.
pub type Joints = [f64; 6];

/// Limits of the joints, degrees.
const LIMITS: [[f64; 2]; 6] =
    [[-170.0, 170.0], [-120.0, 120.0], [-125.0, 155.0], [-270.0, 270.0], [-120.0, 120.0], [-360.0, 360.0]];
/// Full speeds of the joints, degrees/s.
pub const SPEEDS: [f64; 6] = [213.75, 142.5, 155.58, 213.75, 164.47, 342.0];
/// Singular range of joint 5, rad: with joint 5 closer to 0, joints 4 and 6 turn against each other, and a straight
/// motion may need any speed.
const SINGULAR: f64 = 2e-3;

/// Why a pose cannot be reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unreachable {
    /// No joint angles reach the pose.
    TooFar,
    /// Joint angles reach the pose, but these joints are beyond their limits: bit 0 is joint 1.
    Limits(u8),
    /// Joint 5 is at 0.
    Singular,
}

/// Deviation of one specimen from the nominal arm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArmError {
    /// a1, a2, b, c1, c2, c3, c4 of the arm's model, mm.
    pub lengths_mm: [f64; 7],
    /// Zero offsets of the joints, degrees.
    pub zeros_deg: [f64; 6],
}

/// An arm's geometry.
pub struct Vs060(OPWKinematics);

impl Vs060 {
    /// The nominal geometry, with which the controller computes.
    pub fn drawn() -> Vs060 {
        Vs060::built(&ArmError::default())
    }

    /// The geometry of a specimen.
    pub fn built(off: &ArmError) -> Vs060 {
        let [a1, a2, b, c1, c2, c3, c4] = off.lengths_mm;
        Vs060(OPWKinematics::new(Parameters {
            a1: a1 * 1e-3,
            a2: (-10.0 + a2) * 1e-3,
            b: b * 1e-3,
            c1: (345.0 + c1) * 1e-3,
            c2: (305.0 + c2) * 1e-3,
            c3: (300.0 + c3) * 1e-3,
            c4: (70.0 + c4) * 1e-3,
            offsets: off.zeros_deg.map(f64::to_radians),
            sign_corrections: [1; 6],
            dof: 6,
        }))
    }

    /// Pose of the flange.
    pub fn forward(&self, joints: &Joints) -> Rigid<Base, Flange> {
        let pose = self.0.forward(joints);
        let m = DMat3::from_quat(pose.rotation);
        let column = |v: DVec3| Vec3::new(v.x, v.y, v.z);
        let rotation =
            sheetlight::geometry::Mat3::from_columns(&[column(m.x_axis), column(m.y_axis), column(m.z_axis)]);
        Rigid::new(rotation, column(pose.translation) * 1e3)
    }

    /// The joint angles that reach a pose and are closest to `near`, including whole turns of joints 4 and 6.
    pub fn inverse(&self, to: &Rigid<Base, Flange>, near: &Joints) -> Result<Joints, Unreachable> {
        let (t, r) = (to.translation * 1e-3, &to.rotation);
        let column = |k: usize| DVec3::new(r[(0, k)], r[(1, k)], r[(2, k)]);
        let rotation = DQuat::from_mat3(&DMat3::from_cols(column(0), column(1), column(2)));
        let pose = Pose::from_parts(DVec3::new(t.x, t.y, t.z), rotation);
        let (mut best, mut beyond) = (None::<(f64, Joints)>, None::<u8>);
        for joints in self.0.inverse_continuing(&pose, near).into_iter().flat_map(turns) {
            let out = out_of_limits(&joints);
            if out != 0 {
                beyond = Some(beyond.map_or(out, |b| if b.count_ones() <= out.count_ones() { b } else { out }));
                continue;
            }
            let far = joints.iter().zip(near).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if best.is_none_or(|(b, _)| far < b) {
                best = Some((far, joints));
            }
        }
        match (best, beyond) {
            (Some((_, joints)), _) if joints[4].abs() < SINGULAR => Err(Unreachable::Singular),
            (Some((_, joints)), _) => Ok(joints),
            (None, Some(bits)) => Err(Unreachable::Limits(bits)),
            (None, None) => Err(Unreachable::TooFar),
        }
    }
}

/// The same pose with joints 4 and 6 a whole turn further or back.
fn turns(joints: Joints) -> impl Iterator<Item = Joints> {
    [-TAU, 0.0, TAU].into_iter().flat_map(move |j4| {
        [-TAU, 0.0, TAU].into_iter().map(move |j6| {
            let mut other = joints;
            (other[3], other[5]) = (joints[3] + j4, joints[5] + j6);
            other
        })
    })
}

/// Bit k is set if joint k + 1 is beyond its limit.
pub fn out_of_limits(joints: &Joints) -> u8 {
    let out = |(j, [low, high]): (&f64, &[f64; 2])| !(low - 1e-9..=high + 1e-9).contains(&j.to_degrees());
    joints.iter().zip(&LIMITS).enumerate().map(|(k, pair)| u8::from(out(pair)) << k).sum()
}

/// A number for shoulder, elbow and wrist: 5 if the arm reaches forwards, elbow up, joint 5 positive. The numbering
/// is Sheetlight's, but it changes where a controller's changes.
pub fn figure(joints: &Joints) -> i32 {
    // Reach of the wrist's centre in front of joint 1's axis, mm; 305 and 300 are the lengths of the two arm links.
    let forwards = 305.0 * joints[1].sin() + 300.0 * (joints[1] + joints[2]).sin() >= 0.0;
    i32::from(forwards) | i32::from(joints[2] < -1.909f64.to_radians()) << 1 | i32::from(joints[4] >= 0.0) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference poses of the joint chain from other sources: docs/robots.md, VS-060.
    #[test]
    fn the_flange_is_where_the_joint_chain_puts_it() {
        for (joints, position) in [
            ([0.0, 0.0, 90.0, 0.0, 90.0, 0.0], [300.0, 0.0, 590.0]),
            ([30.0, 20.0, 70.0, 0.0, 90.0, 30.0], [350.1481, 202.1581, 571.6062]),
            ([-45.0, 10.0, 100.0, 15.0, 60.0, -120.0], [259.3969, -237.2078, 485.1618]),
            ([-120.0, 60.0, 40.0, 200.0, -80.0, -300.0], [-260.6004, -498.5284, 389.3478]),
            ([10.0, -60.0, 150.0, 5.0, -100.0, 0.0], [24.39, -1.8003, 576.1742]),
        ] {
            let (arm, joints) = (Vs060::drawn(), joints.map(f64::to_radians));
            let pose = arm.forward(&joints);
            assert!((pose.translation - Vec3::from(position)).norm() < 1e-3, "{:?}", pose.translation);
            let again = arm.inverse(&pose, &joints).unwrap();
            assert!(joints.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-6), "{joints:?} {again:?}");
        }
    }

    #[test]
    fn what_cannot_be_reached_is_told_apart() {
        let (arm, near) = (Vs060::drawn(), [0.0, 0.0, 90.0, 0.0, 90.0, 0.0].map(f64::to_radians));
        let down = arm.forward(&near);
        let at = |x: f64, z: f64| Rigid::new(down.rotation, Vec3::new(x, 0.0, z));
        assert_eq!(arm.inverse(&at(1400.0, 500.0), &near), Err(Unreachable::TooFar));
        assert!(matches!(
            arm.inverse(&at(-440.0, 300.0), &[0.0, -1.0, -1.5, 0.0, -1.0, 0.0]),
            Ok(_) | Err(Unreachable::Limits(_))
        ));
        assert_eq!(out_of_limits(&[0.0, 0.0, 160.0, 0.0, 90.0, 0.0].map(f64::to_radians)), 4);
        assert_eq!(figure(&near), 5);
    }
}
