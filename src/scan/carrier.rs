//! In: a rig, the motion that moves the part past the light, and its position at a shot. Out: the pose of the camera
//! relative to the part, with its uncertainty.
//! Frame and unit: the cloud's frame ([`Motion::frame`]: base, flange of a robot that carries the part, axis); mm,
//! rad.

use crate::fault::{Fault, Result};
use crate::geometry::{Axis, AxisKind, Base, Camera, Ride, Rigid, Twist, Vec3};
use crate::recording::{Carries, Motion, Slip, Stand};
use crate::rig::{HandEye, Kind, Rig, axis_sigma};
use nalgebra::{DMatrix, Matrix3, Matrix6};

/// Pose of the camera relative to the part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Camera frame to the cloud's frame, mm. The type says `Base` for the cloud's frame, whatever moves.
    pub from_camera: Rigid<Base, Camera>,
    /// Covariance of a motion (v, w) of the cloud's points, mm and rad: the axis' share, and speed times the
    /// uncertainty of the time. `None`: the uncertainties of the robot and of the hand-eye are in the budget of the
    /// result, because all points of a part share them.
    pub covariance: Option<Matrix6<f64>>,
}

impl Place {
    /// The cloud's frame is the camera frame.
    pub fn camera() -> Place {
        Place { from_camera: Rigid::identity(), covariance: None }
    }
}

/// Converts the position of the motion into the pose of the camera.
#[derive(Clone, Debug)]
pub struct Carrier {
    way: Way,
}

#[derive(Clone, Debug)]
enum Way {
    /// The camera is on the flange.
    Sensor(HandEye),
    /// The part is on the flange, the camera is fixed in the base.
    Part(Rigid<Base, Camera>),
    Axis(Box<OnAxis>),
}

#[derive(Clone, Debug)]
struct OnAxis {
    axis: Axis,
    /// Covariance of dx dy dz pitch px py pz.
    covariance: DMatrix<f64>,
    /// Scatter of the axis from stop to stop, mm and rad.
    sigma: [f64; 2],
}

/// Farthest position from the axis frame's origin, mm. Beyond it single precision spoils the points: 0.002 mm at 30
/// m.
const FARTHEST: f64 = 3e4;

/// The parts of a rig that a scan with this motion depends on.
pub fn parts_for(rig: &Rig, motion: &Motion) -> Rig {
    let robot = |carries| motion.axis().is_none() && motion.carries == carries;
    Rig {
        hand_eye: rig.hand_eye.clone().filter(|_| robot(Carries::Sensor)),
        base_camera: rig.base_camera.clone().filter(|_| robot(Carries::Part)),
        linear_axis: rig.linear_axis.clone().filter(|_| motion.axis() == Some(AxisKind::Linear)),
        turntable: rig.turntable.clone().filter(|_| motion.axis() == Some(AxisKind::Turntable)),
        pointer: None,
        profile_hand_eye: None,
        ..rig.clone()
    }
}

/// The parts of a rig that a scan from profiles of a line-profile sensor on the flange depends on.
pub fn parts_for_profiles(rig: &Rig) -> Rig {
    Rig { profile_hand_eye: rig.profile_hand_eye.clone(), ..Rig::default() }
}

/// The calibrations that a scan with this motion needs.
pub fn needs(motion: &Motion) -> [Kind; 3] {
    let pose = match (motion.axis(), motion.carries) {
        (None, Carries::Sensor) => Kind::HandEye,
        (None, Carries::Part) => Kind::BaseCamera,
        (Some(AxisKind::Linear), _) => Kind::LinearAxis,
        (Some(AxisKind::Turntable), _) => Kind::Turntable,
    };
    [Kind::Camera, Kind::LaserPlane, pose]
}

impl Carrier {
    /// Refuses a rig that lacks what the motion needs (hand-eye, base camera or axis), and counts of another unit
    /// than that of the axis calibration.
    pub fn new(rig: &Rig, motion: &Motion) -> Result<Carrier> {
        let way = match (motion.axis(), motion.carries) {
            (None, Carries::Sensor) => Way::Sensor(rig.need_hand_eye()?.value),
            (None, Carries::Part) => Way::Part(rig.need_base_camera()?.value),
            (Some(kind), _) => {
                let found = rig.need_axis(kind)?;
                let (axis, unit) = (found.value, motion.unit);
                if unit != Some(axis.unit) {
                    let is = unit.map_or("not stated", |u| u.name());
                    return Err(Fault::input(format!(
                        "the recording's counts are in '{is}', the {} was calibrated in '{}'",
                        kind.words(),
                        axis.unit.name()
                    ))
                    .cause("another axis, or an encoder in one of them and the axis' own display in the other")
                    .next("record counts as the calibration has them, or calibrate the axis with such counts"));
                }
                let sigma = axis_sigma(&found.quality).unwrap_or([0.0; 2]);
                Way::Axis(Box::new(OnAxis { axis, covariance: found.covariance.to_matrix(), sigma }))
            }
        };
        Ok(Carrier { way })
    }

    /// Whether the points of the laser sheet move by different lengths from shot to shot.
    pub fn turns(&self) -> bool {
        matches!(&self.way, Way::Axis(on) if on.axis.kind == AxisKind::Turntable)
    }

    /// `slip` is how far the stated position may be off. `anchor` is where the light meets the part, camera frame,
    /// mm; the axis' rotation errors from stop to stop are taken about it.
    pub fn place(&self, stand: &Stand, slip: Option<&Slip>, anchor: &Vec3) -> Result<Place> {
        let mut place = self.stood(stand, anchor)?;
        if let Some(Twist { v, w }) = slip.and_then(|s| self.moved(stand, s)) {
            let moved = nalgebra::Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z);
            place.covariance = Some(place.covariance.unwrap_or_else(Matrix6::zeros) + moved * moved.transpose());
        }
        Ok(place)
    }

    /// The motion of the cloud's points, in the cloud's frame, that a slip causes.
    fn moved(&self, stand: &Stand, slip: &Slip) -> Option<Twist> {
        match (&self.way, stand, slip) {
            (Way::Sensor(_), _, Slip::Flange([x, y, z, a, b, c])) => {
                Some(Twist { v: Vec3::new(*x, *y, *z), w: Vec3::new(*a, *b, *c) })
            }
            // Seen from the flange, the world moves in the opposite direction.
            (Way::Part(_), Stand::Robot(base_from_flange), Slip::Flange([x, y, z, a, b, c])) => {
                let (v, w) = (Vec3::new(*x, *y, *z), Vec3::new(*a, *b, *c));
                let at_flange = v + w.cross(&base_from_flange.translation);
                let into = base_from_flange.rotation.transpose();
                Some(Twist { v: -(into * at_flange), w: -(into * w) })
            }
            (Way::Axis(on), _, Slip::Count(counts)) => {
                let by = on.axis.pitch * counts;
                Some(match on.axis.kind {
                    AxisKind::Linear => Twist { v: Vec3::x() * by, w: Vec3::zeros() },
                    AxisKind::Turntable => Twist { v: Vec3::zeros(), w: Vec3::z() * by },
                })
            }
            _ => None,
        }
    }

    fn stood(&self, stand: &Stand, anchor: &Vec3) -> Result<Place> {
        match (&self.way, stand) {
            (Way::Sensor(flange_from_camera), Stand::Robot(base_from_flange)) => {
                Ok(Place { from_camera: *base_from_flange * *flange_from_camera, covariance: None })
            }
            (Way::Part(base_from_camera), Stand::Robot(base_from_flange)) => {
                let flange_from_camera = base_from_flange.inverse() * *base_from_camera;
                // The cloud's frame is the flange's: the type `Base` stands for the cloud's frame.
                let from_camera = Rigid::new(flange_from_camera.rotation, flange_from_camera.translation);
                Ok(Place { from_camera, covariance: None })
            }
            (Way::Axis(on), Stand::Count(count)) => on.place(*count, anchor),
            _ => Err(Fault::input("a shot has the pose of something else than what moves")
                .cause("the recording's motion and its shots do not belong together")
                .next("restore the motion of meta.json")),
        }
    }
}

impl OnAxis {
    fn place(&self, count: f64, anchor: &Vec3) -> Result<Place> {
        let far = (self.axis.pitch * count).abs();
        if self.axis.kind == AxisKind::Linear && far > FARTHEST {
            return Err(Fault::input(format!(
                "the axis stands {far:.0} mm from its zero, at most {FARTHEST:.0} is accepted"
            ))
            .cause("an encoder that counts on for days")
            .next("state a \"zero\" in meta.json's motion that lies near the part's counts"));
        }
        let at: Rigid<Ride, Camera> = self.axis.axis_from_camera(count);
        let errors = self.axis.errors(count);
        let mut covariance = Matrix6::zeros();
        if self.covariance.nrows() == errors.len() {
            let j = DMatrix::from_fn(6, errors.len(), |i, k| if i < 3 { errors[k].v[i] } else { errors[k].w[i - 3] });
            covariance.copy_from(&(&j * &self.covariance * j.transpose()));
        }
        let [mm, rad] = self.sigma.map(|s| s * s);
        let lever = Twist::lever(&at.point(anchor));
        let turns = lever.fixed_view::<3, 3>(0, 3).into_owned() * -1.0;
        // A rotation w about the anchor is the twist (anchor x w, w).
        covariance += block(Matrix3::identity() * mm + turns * turns.transpose() * rad, turns * rad, rad);
        Ok(Place { from_camera: Rigid::new(at.rotation, at.translation), covariance: Some(covariance) })
    }
}

fn block(vv: Matrix3<f64>, vw: Matrix3<f64>, rad: f64) -> Matrix6<f64> {
    let mut c = Matrix6::zeros();
    c.fixed_view_mut::<3, 3>(0, 0).copy_from(&vv);
    c.fixed_view_mut::<3, 3>(0, 3).copy_from(&vw);
    c.fixed_view_mut::<3, 3>(3, 0).copy_from(&vw.transpose());
    c.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * rad));
    c
}

impl Place {
    /// Variance that the pose adds to a point of the cloud along its worst direction, mm².
    pub fn variance_at(&self, p: &Vec3) -> f64 {
        let Some(c) = &self.covariance else { return 0.0 };
        let lever = Twist::lever(p);
        (lever * c * lever.transpose()).symmetric_eigenvalues().max().max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::CountUnit;
    use crate::recording::MotionKind;
    use crate::rig::{AXIS_SIGMA_DEG, AXIS_SIGMA_MM, Calibration, Covariance, Kind, Quality, Verdict};

    fn rig(kind: AxisKind, sigma_mm: f64) -> Rig {
        let camera_from_axis = Rigid::from_vectors(&Vec3::new(2.2, 0.3, -0.4), Vec3::new(12.0, -7.0, 310.0));
        let axis = Axis { kind, unit: CountUnit::Count, pitch: 0.004, camera_from_axis };
        let quality = Quality {
            verdict: Verdict::Good,
            reasons: vec![],
            advice: vec![],
            figures: [(AXIS_SIGMA_MM.into(), sigma_mm), (AXIS_SIGMA_DEG.into(), 0.0)].into(),
            per_picture: vec![],
        };
        let linear = kind == AxisKind::Linear;
        let of = if linear { Kind::LinearAxis } else { Kind::Turntable };
        let names = of.parameters().0;
        let mut c = DMatrix::zeros(names.len(), names.len());
        c[(3, 3)] = 1e-12;
        let found = Some(Calibration::new(of, axis, None, Covariance::new(names, &c), quality));
        match kind {
            AxisKind::Linear => Rig { linear_axis: found, ..Rig::default() },
            AxisKind::Turntable => Rig { turntable: found, ..Rig::default() },
        }
    }

    fn motion(kind: MotionKind) -> Motion {
        Motion { kind, carries: Carries::Part, unit: Some(CountUnit::Count), ..Motion::default() }
    }

    #[test]
    fn a_points_variance_is_the_pitchs_and_the_axis_own() {
        let anchor = Vec3::new(0.0, 0.0, 300.0);
        let linear = Carrier::new(&rig(AxisKind::Linear, 0.03), &motion(MotionKind::Linear)).unwrap();
        let at = |n: f64| {
            linear.place(&Stand::Count(n), None, &anchor).unwrap().variance_at(&Vec3::new(1.0, 2.0, 3.0)).sqrt()
        };
        assert!((at(0.0) - 0.03).abs() < 1e-12);
        assert!((at(50_000.0) - 0.03f64.hypot(0.05)).abs() < 1e-9, "{}", at(50_000.0));
        // 50 mm from a turntable's axis, 1e-6 rad a count.
        let table = Carrier::new(&rig(AxisKind::Turntable, 0.0), &motion(MotionKind::Turntable)).unwrap();
        let place = table.place(&Stand::Count(300.0), None, &anchor).unwrap();
        assert!((place.variance_at(&Vec3::new(30.0, 40.0, 9.0)).sqrt() - 50.0 * 300.0 * 1e-6).abs() < 1e-9);
        assert!(place.variance_at(&Vec3::new(0.0, 0.0, 9.0)).sqrt() < 1e-9);
    }

    #[test]
    fn what_does_not_belong_together_is_refused() {
        let rig = rig(AxisKind::Linear, 0.0);
        let other = Motion { unit: Some(CountUnit::Mm), ..motion(MotionKind::Linear) };
        assert!(Carrier::new(&rig, &other).unwrap_err().what.contains("'mm'"));
        assert!(Carrier::new(&rig, &Motion::default()).unwrap_err().next.contains("calibrate hand-eye"));
        assert!(Carrier::new(&rig, &motion(MotionKind::Turntable)).unwrap_err().next.contains("calibrate axis"));
        let carrier = Carrier::new(&rig, &motion(MotionKind::Linear)).unwrap();
        assert!(carrier.place(&Stand::Robot(Rigid::identity()), None, &Vec3::zeros()).is_err());
        let far = carrier.place(&Stand::Count(1e9), None, &Vec3::zeros()).unwrap_err();
        assert!(far.next.contains("zero"), "{far}");
    }

    #[test]
    fn a_carried_part_is_measured_in_the_flange() {
        let base_from_camera = Rigid::from_vectors(&Vec3::new(0.3, 0.1, 2.0), Vec3::new(500.0, 20.0, 700.0));
        let flange = Rigid::from_vectors(&Vec3::new(1.1, -0.4, 0.3), Vec3::new(400.0, 10.0, 500.0));
        let quality = Quality {
            verdict: Verdict::Good,
            reasons: vec![],
            advice: vec![],
            figures: Default::default(),
            per_picture: vec![],
        };
        let base_camera =
            Some(Calibration::new(Kind::BaseCamera, base_from_camera, None, Covariance::default(), quality));
        let rig = Rig { base_camera, ..Rig::default() };
        let motion = Motion { carries: Carries::Part, ..Motion::default() };
        assert_eq!(motion.frame(), "flange");
        let carrier = Carrier::new(&rig, &motion).unwrap();
        let place = carrier.place(&Stand::Robot(flange), None, &Vec3::zeros()).unwrap();
        let on_part = Vec3::new(3.0, 4.0, 5.0);
        let seen = base_from_camera.inverse().point(&flange.point(&on_part));
        assert!((place.from_camera.point(&seen) - on_part).norm() < 1e-9);
        // The robot stood a little farther on its path: the point lies elsewhere on the part, by the distance that
        // its sigma states.
        let (v, w) = (Vec3::new(0.03, 0.0, 0.02), Vec3::new(0.0, 4e-4, 1e-4));
        let slip = Slip::Flange([v.x, v.y, v.z, w.x, w.y, w.z]);
        let place = carrier.place(&Stand::Robot(flange), Some(&slip), &Vec3::zeros()).unwrap();
        let moved: Rigid<crate::geometry::Base, crate::geometry::Base> = Rigid::from_vectors(&w, v);
        let turned = moved.rotation * flange.rotation;
        let farther = Rigid::new(turned, moved.point(&flange.translation));
        let there = carrier.place(&Stand::Robot(farther), None, &Vec3::zeros()).unwrap().from_camera.point(&seen);
        let (is, want) = (place.variance_at(&on_part).sqrt(), (there - on_part).norm());
        assert!((is / want - 1.0).abs() < 0.01, "{is} {want}");
    }
}
