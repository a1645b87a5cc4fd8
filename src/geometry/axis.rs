//! In: direction and pitch of a linear axis or turntable before a camera. Out: the pose of a part that rides on it at a
//! count, and how an error of each parameter moves the part.
//! Frame and unit: camera, axis (the part's side at count 0), mm, rad; docs/math.md, Axis.

use super::{Board, Camera, Mat3, Ride, Rigid, Twist, Vec3, exp, log};

/// What moves the part past the light, or the light past the part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisKind {
    /// It moves along a straight line.
    Linear,
    /// It turns about a fixed line.
    Turntable,
}

impl AxisKind {
    /// Name for people.
    pub fn words(self) -> &'static str {
        match self {
            AxisKind::Linear => "linear axis",
            AxisKind::Turntable => "turntable",
        }
    }
}

/// Unit of a recording's counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, strum::IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum CountUnit {
    /// An encoder's steps.
    Count,
    /// Millimetres of motion, as the axis reports.
    Mm,
    /// Degrees of rotation, as the turntable reports.
    Deg,
}

impl CountUnit {
    /// Name in files and messages.
    pub fn name(self) -> &'static str {
        self.into()
    }
    /// Stated size of one unit, mm or rad; `None` for an encoder's step.
    pub fn stated(self) -> Option<f64> {
        match self {
            CountUnit::Count => None,
            CountUnit::Mm => Some(1.0),
            CountUnit::Deg => Some(1f64.to_radians()),
        }
    }
}

/// A linear axis or turntable as seen by a fixed camera. The same description holds where the axis carries the sensor:
/// the part moves relative to the camera.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Whether it moves or turns.
    pub kind: AxisKind,
    /// Unit of its counts.
    pub unit: CountUnit,
    /// Linear: mm a count along the frame's x. Turntable: rad a count about the frame's z, right-handed.
    pub pitch: f64,
    /// The frame of the part at count 0. Linear: x is the direction of growing counts. Turntable: z is the axis.
    #[serde(rename = "camera_T_axis")]
    pub camera_from_axis: Rigid<Camera, Ride>,
}

/// A motion as measured: its direction and where it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Riding {
    /// Whether it moves or turns.
    pub kind: AxisKind,
    /// Unit of its counts.
    pub unit: CountUnit,
    /// Linear: direction of growing counts. Turntable: along the axis, either way. Camera frame, unit length.
    pub direction: Vec3,
    /// A point on a turntable's axis, camera frame, mm.
    pub point: Vec3,
    /// mm or rad a count, right-handed about `direction`.
    pub pitch: f64,
}

/// Least cosine at which a direction counts as along another rather than across it.
const ALONG: f64 = std::f64::consts::FRAC_1_SQRT_2;

impl Axis {
    /// The axis frame, from the pose of the board at count 0 (docs/conventions.md). Its z points out of the board's
    /// face, on a turntable to the camera's side.
    pub fn from_board(r: &Riding, camera_from_board: &Rigid<Camera, Board>) -> Axis {
        let at = camera_from_board.translation;
        let column = |k: usize| -> Vec3 { camera_from_board.rotation.column(k).into() };
        let across = |v: Vec3, along: &Vec3| v - along * along.dot(&v);
        // The second direction is used only where the first points along the axis, as for an upright board. The choice
        // of the one that lies more across would depend on noise, and the next calibration could give another frame.
        let cleaner = |a: Vec3, b: Vec3, along: &Vec3| if a.dot(along).abs() < ALONG { a } else { b };
        let forward = r.pitch >= 0.0;
        let (rotation, origin, pitch) = match r.kind {
            AxisKind::Linear => {
                let x = if forward { r.direction } else { -r.direction };
                let z = across(cleaner(-column(2), -column(1), &x), &x).normalize();
                (Mat3::from_columns(&[x, z.cross(&x), z]), at, r.pitch.abs())
            }
            AxisKind::Turntable => {
                let foot = r.point + r.direction * r.direction.dot(&(at - r.point));
                let down = r.direction.dot(&at) > 0.0;
                let z = if down { -r.direction } else { r.direction };
                let x = across(cleaner(column(0), column(1), &z), &z).normalize();
                (Mat3::from_columns(&[x, z.cross(&x), z]), foot, if down { -r.pitch } else { r.pitch })
            }
        };
        Axis { kind: r.kind, unit: r.unit, pitch, camera_from_axis: Rigid::new(rotation, origin) }
    }

    /// The direction of motion, or the axis of rotation; unit length, camera frame.
    pub fn direction(&self) -> Vec3 {
        let column = if self.kind == AxisKind::Linear { 0 } else { 2 };
        self.camera_from_axis.rotation.column(column).into()
    }

    /// The frame's origin at count 0; for a turntable a point on the axis. Camera frame, mm.
    pub fn origin(&self) -> Vec3 {
        self.camera_from_axis.translation
    }

    /// Motion of the part at a count, camera frame.
    pub fn moved(&self, count: f64) -> Rigid<Camera, Camera> {
        let (along, by) = (self.direction(), self.pitch * count);
        match self.kind {
            AxisKind::Linear => Rigid::new(Mat3::identity(), along * by),
            AxisKind::Turntable => {
                let turn = exp(&(along * by));
                Rigid::new(turn, self.origin() - turn * self.origin())
            }
        }
    }

    /// Pose of the camera relative to the part at a count.
    pub fn axis_from_camera(&self, count: f64) -> Rigid<Ride, Camera> {
        self.camera_from_axis.inverse() * self.moved(count).inverse()
    }

    /// The count at which the camera has this pose; for a turntable within half a turn of 0.
    pub fn count_of(&self, axis_from_camera: &Rigid<Ride, Camera>) -> f64 {
        let moved = (self.camera_from_axis * *axis_from_camera).inverse();
        let by = match self.kind {
            AxisKind::Linear => moved.translation,
            AxisKind::Turntable => log(&moved.rotation),
        };
        by.dot(&self.direction()) / self.pitch
    }

    /// Error of the pose of a part measured at a count, in axis coordinates, for a unit error in each parameter. These
    /// are dx dy dz (direction, camera frame), pitch, and for a turntable px py pz (origin, camera frame, mm). The
    /// frame at count 0 is unchanged.
    pub fn errors(&self, count: f64) -> Vec<Twist> {
        let (d, p, by) = (self.direction(), self.origin(), self.pitch * count);
        let unit = |k: usize| Vec3::from_fn(|i, _| if i == k { 1.0 } else { 0.0 });
        let none = Vec3::zeros();
        let about = |w: Vec3| Twist { v: p.cross(&w), w };
        let in_camera: Vec<Twist> = match self.kind {
            AxisKind::Linear => {
                (0..3).map(|k| Twist { v: unit(k) * -by, w: none }).chain([Twist { v: d * -count, w: none }]).collect()
            }
            // The derivative of exp(-by d), by the left Jacobian of the rotation group, for a step perpendicular to d.
            AxisKind::Turntable => (0..3)
                .map(|k| about(unit(k) * -by.sin() + d.cross(&unit(k)) * (1.0 - by.cos())))
                .chain([about(d * -count)])
                .chain((0..3).map(|k| Twist { v: unit(k) - exp(&(d * -by)) * unit(k), w: none }))
                .collect(),
        };
        let back = self.camera_from_axis.rotation.transpose();
        in_camera.into_iter().map(|t| Twist { v: back * (t.v + t.w.cross(&p)), w: back * t.w }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(kind: AxisKind) -> Axis {
        let camera_from_axis = Rigid::from_vectors(&Vec3::new(2.2, 0.3, -0.4), Vec3::new(12.0, -7.0, 310.0));
        Axis { kind, unit: CountUnit::Count, pitch: 0.004, camera_from_axis }
    }

    #[test]
    fn a_part_rides_along_x_or_about_z() {
        for kind in [AxisKind::Linear, AxisKind::Turntable] {
            let a = axis(kind);
            let p = Vec3::new(3.0, 4.0, 5.0);
            // What the camera sees at a count, mapped back, is the point in the part's own frame.
            let seen = a.moved(250.0).point(&a.camera_from_axis.point(&p));
            assert!((a.axis_from_camera(250.0).point(&seen) - p).norm() < 1e-9);
            let there = a.camera_from_axis.inverse().point(&seen);
            let want = match kind {
                AxisKind::Linear => p + Vec3::x(),
                AxisKind::Turntable => exp(&Vec3::z()) * p,
            };
            assert!((there - want).norm() < 1e-9, "{there}");
            assert!((a.count_of(&a.axis_from_camera(250.0)) - 250.0).abs() < 1e-7);
        }
    }

    /// A board tilted equally about its x and its y, measured with a small error each time: the frame is the same.
    #[test]
    fn the_frame_is_the_same_after_the_next_calibration() {
        for kind in [AxisKind::Linear, AxisKind::Turntable] {
            let unit = CountUnit::Count;
            let direction = if kind == AxisKind::Linear { Vec3::new(0.7, 0.714, 0.0) } else { -Vec3::z() };
            let riding = Riding { kind, unit, direction, point: Vec3::zeros(), pitch: 0.01 };
            let frame = |by: f64| {
                let lies = exp(&Vec3::new(0.1 + by, 0.1 - by, 0.0));
                Axis::from_board(&riding, &Rigid::new(lies, Vec3::new(3.0, 2.0, 300.0))).camera_from_axis
            };
            let (rad, _) = frame(1e-4).difference(&frame(-1e-4));
            assert!(rad < 1e-3, "{kind:?}: turned by {rad} rad");
        }
    }

    #[test]
    fn errors_are_derivatives() {
        for kind in [AxisKind::Linear, AxisKind::Turntable] {
            let (a, count, h) = (axis(kind), 330.0, 1e-6);
            let seen = Vec3::new(15.0, 22.0, 290.0);
            let here = a.axis_from_camera(count).point(&seen);
            let errors = a.errors(count);
            assert_eq!(errors.len(), if kind == AxisKind::Linear { 4 } else { 7 });
            // The frame at count 0 is unchanged: only the motion differs.
            let measured = |d: Vec3, k: f64, p: Vec3| {
                let by = k * count;
                let back = match kind {
                    AxisKind::Linear => seen - d * by,
                    AxisKind::Turntable => p + exp(&(d * -by)) * (seen - p),
                };
                a.camera_from_axis.inverse().point(&back)
            };
            let unit = |k: usize| Vec3::from_fn(|i, _| if i == k { h } else { 0.0 });
            let (d, k, p) = (a.direction(), a.pitch, a.origin());
            for (i, e) in errors.iter().enumerate() {
                let (there, want) = match i {
                    // A direction cannot have an error along itself.
                    0..=2 => {
                        let step = unit(i) - d * d.dot(&unit(i));
                        let along: Vec3 = (0..3).map(|j| errors[j].at(&here) * (step[j] / h)).sum();
                        (measured(d + step, k, p), along)
                    }
                    3 => (measured(d, k + h, p), e.at(&here)),
                    _ => (measured(d, k, p + unit(i - 4)), e.at(&here)),
                };
                let found = (there - here) / h;
                assert!((found - want).norm() < 1e-3 * (1.0 + want.norm()), "{kind:?} {i}: {found} {want}");
            }
        }
    }
}
