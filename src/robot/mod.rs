//! In: poses as robots print them. Out: rigid transforms, and back. The convention is always named, never guessed
//! (docs/conventions.md has the table).
//! Frame and unit: the frames that the caller names; each convention states its units.

pub mod fanuc_tp;
pub mod program;
mod written;

pub use written::Written;

use crate::fault::{Fault, Result};
use crate::geometry::{Frame, Mat3, Rigid, Vec3, exp, log, repair};

/// Denso's figures: -1 to -3 leave the choice to the controller; five bits state shoulder, elbow, wrist, joints 6
/// and 4.
const FIGURES: std::ops::RangeInclusive<f64> = -3.0..=31.0;

/// How a robot writes a pose as numbers.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Convention {
    /// X Y Z RX RY RZ: mm, degrees, R = Rz·Ry·Rx.
    Denso,
    /// X Y Z RX RY RZ: metres and a rotation vector in radians.
    Ur,
    /// X Y Z A B C: mm, degrees, R = Rz(A)·Ry(B)·Rx(C).
    Kuka,
    /// X Y Z W P R: mm, degrees, R = Rz(R)·Ry(P)·Rx(W).
    Fanuc,
    /// X Y Z q1 q2 q3 q4: mm, quaternion with the real part first.
    Abb,
    /// X Y Z Rx Ry Rz: mm, degrees, R = Rz·Ry·Rx.
    Yaskawa,
    /// x y z qx qy qz qw: metres, quaternion with the real part last.
    Ros,
    /// x y z qw qx qy qz: mm, quaternion with the real part first.
    Quaternion,
    /// 16 numbers, row-major 4x4, mm.
    Matrix,
    /// X Y Z, orient vector (the y axis), approach vector (the z axis): Denso's type T without its figure; mm.
    DensoT,
    /// X Y Z rx ry rz: mm, degrees, R = Rx·Ry·Rz: Staubli, HALCON's `gba`.
    Gba,
    /// X Y Z O A T: mm, degrees, R = Rz(O)·Ry(A)·Rz(T).
    Kawasaki,
}

impl Convention {
    /// All conventions.
    pub const ALL: &[Convention] = <Convention as strum::VariantArray>::VARIANTS;

    /// The name in options and files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Labels of the numbers with their units, in order.
    pub fn labels(self) -> &'static [&'static str] {
        match self {
            Convention::Denso => &["X mm", "Y mm", "Z mm", "RX deg", "RY deg", "RZ deg"],
            Convention::Ur => &["X m", "Y m", "Z m", "RX rad", "RY rad", "RZ rad"],
            Convention::Kuka => &["X mm", "Y mm", "Z mm", "A deg", "B deg", "C deg"],
            Convention::Fanuc => &["X mm", "Y mm", "Z mm", "W deg", "P deg", "R deg"],
            Convention::Abb => &["X mm", "Y mm", "Z mm", "q1", "q2", "q3", "q4"],
            Convention::Yaskawa => &["X mm", "Y mm", "Z mm", "Rx deg", "Ry deg", "Rz deg"],
            Convention::Ros => &["x m", "y m", "z m", "qx", "qy", "qz", "qw"],
            Convention::Quaternion => &["x mm", "y mm", "z mm", "qw", "qx", "qy", "qz"],
            Convention::Matrix => &[
                "m00", "m01", "m02", "m03", "m10", "m11", "m12", "m13", "m20", "m21", "m22", "m23", "m30", "m31",
                "m32", "m33",
            ],
            Convention::DensoT => &["X mm", "Y mm", "Z mm", "Ox", "Oy", "Oz", "Ax", "Ay", "Az"],
            Convention::Gba => &["X mm", "Y mm", "Z mm", "rx deg", "ry deg", "rz deg"],
            Convention::Kawasaki => &["X mm", "Y mm", "Z mm", "O deg", "A deg", "T deg"],
        }
    }

    /// The range of the angles among the numbers, and whether they are degrees; `None` for quaternions and
    /// matrices.
    pub fn angles(self) -> Option<(std::ops::Range<usize>, bool)> {
        match self {
            Convention::Denso | Convention::Kuka | Convention::Fanuc | Convention::Yaskawa => Some((3..6, true)),
            Convention::Gba | Convention::Kawasaki => Some((3..6, true)),
            Convention::Ur => Some((3..6, false)),
            Convention::Abb | Convention::Ros | Convention::Quaternion | Convention::Matrix => None,
            Convention::DensoT => None,
        }
    }

    /// Denso appends the figure to a pose: the configuration of shoulder, elbow and wrist. A pose without joints
    /// does not need it. But the number there must be a valid figure, or the numbers are in another order.
    fn without_figure(self, numbers: &[f64]) -> Result<&[f64]> {
        let (pose, figure) = match (self, numbers.split_last()) {
            (Convention::Denso, Some((figure, pose))) if pose.len() == 6 => (pose, *figure),
            (Convention::DensoT, Some((figure, pose))) if pose.len() == 9 => (pose, *figure),
            _ => return Ok(numbers),
        };
        if figure.fract() == 0.0 && FIGURES.contains(&figure) {
            return Ok(pose);
        }
        Err(Fault::input(format!(
            "the figure behind a {} pose is {figure:?}, a whole number from {} to {} is one",
            self.name(),
            FIGURES.start(),
            FIGURES.end()
        ))
        .cause("numbers in another order, or one too many")
        .next("write X Y Z RX RY RZ and the figure, or leave the figure out"))
    }

    /// Returns an error for numbers that no robot's pose has.
    fn believe(self, numbers: &[f64]) -> Result<()> {
        if numbers.iter().any(|x| !x.is_finite()) {
            return Err(Fault::input("a pose holds a number that is not finite")
                .cause("NaN in the pose file")
                .next("export the pose again"));
        }
        if let Some((place, degrees)) = self.angles() {
            // No wrist turns further, even if its count continues over several turns.
            let (limit, unit) = if degrees { (3600.0, "degrees") } else { (63.0, "radians") };
            if let Some(angle) = numbers[place].iter().find(|a| a.abs() > limit) {
                return Err(Fault::input(format!("an angle of {angle:?} {unit}, at most {limit} are accepted"))
                    .cause("a spoilt file, or numbers in another order or unit")
                    .next("export the pose again"));
            }
        }
        let limits = self.labels().iter().zip(numbers).filter_map(|(label, x)| Some((label, x, most(label)?)));
        if let Some((label, x, most)) = limits.into_iter().find(|(_, x, most)| x.abs() > *most) {
            return Err(Fault::input(format!("a pose holds {label} = {x:e}, limit {most:e}"))
                .cause("a slipped decimal point, another unit, or a damaged file")
                .next("export the pose again, or name the convention that the robot really writes"));
        }
        Ok(())
    }

    /// Reads a pose. Returns an error for a wrong count, numbers that are not finite, quaternions whose length is
    /// off by more than 1e-2, and angles of more than ten turns.
    pub fn read<To: Frame, From: Frame>(self, numbers: &[f64]) -> Result<Rigid<To, From>> {
        let want = self.labels().len();
        let numbers = self.without_figure(numbers)?;
        if numbers.len() != want {
            return Err(Fault::input(format!(
                "a {} pose has {want} numbers ({}), {} given",
                self.name(),
                self.labels().join(", "),
                numbers.len()
            ))
            .cause("another convention than the one named")
            .next("name the convention that the robot really writes"));
        }
        self.believe(numbers)?;
        if self == Convention::Matrix {
            let rows: [f64; 16] = numbers.try_into().expect("counted above");
            return Rigid::from_rows(&rows).map(|(pose, _)| pose);
        }
        let unit = if matches!(self, Convention::Ur | Convention::Ros) { 1000.0 } else { 1.0 };
        let t = Vec3::new(numbers[0], numbers[1], numbers[2]) * unit;
        let r = &numbers[3..];
        let rotation = match self {
            Convention::Denso | Convention::Fanuc | Convention::Yaskawa => zyx_deg(r[2], r[1], r[0]),
            Convention::Kuka => zyx_deg(r[0], r[1], r[2]),
            Convention::Ur => exp(&Vec3::new(r[0], r[1], r[2])),
            Convention::Abb | Convention::Quaternion => quaternion(r[0], r[1], r[2], r[3])?,
            Convention::Ros => quaternion(r[3], r[0], r[1], r[2])?,
            Convention::DensoT => {
                let (y, z) = (Vec3::new(r[0], r[1], r[2]), Vec3::new(r[3], r[4], r[5]));
                repair(&Mat3::from_columns(&[y.cross(&z), y, z]))?.rotation
            }
            // The transpose of Rz·Ry·Rx with the opposite angles.
            Convention::Gba => zyx_deg(-r[2], -r[1], -r[0]).transpose(),
            Convention::Kawasaki => zyx_deg(r[0], r[1], 0.0) * zyx_deg(r[2], 0.0, 0.0),
            Convention::Matrix => unreachable!("returned above"),
        };
        Ok(Rigid::new(rotation, t))
    }

    /// Writes a pose in this convention. Angles lie in (-180, 180]; where Ry is ±90 degrees the
    /// split between Rz and Rx is free and Rx is set to 0.
    pub fn write<To: Frame, From: Frame>(self, pose: &Rigid<To, From>) -> Vec<f64> {
        if self == Convention::Matrix {
            return pose.to_rows().to_vec();
        }
        let unit = if matches!(self, Convention::Ur | Convention::Ros) { 1e-3 } else { 1.0 };
        let t = pose.translation * unit;
        let mut out = vec![t.x, t.y, t.z];
        let [z, y, x] = zyx_of(&pose.rotation);
        let q =
            nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(pose.rotation));
        let s = if q.w < 0.0 { -1.0 } else { 1.0 };
        let (qw, qx, qy, qz) = (s * q.w, s * q.i, s * q.j, s * q.k);
        out.extend(match self {
            Convention::Denso | Convention::Fanuc | Convention::Yaskawa => vec![x, y, z],
            Convention::Kuka => vec![z, y, x],
            Convention::Ur => log(&pose.rotation).iter().copied().collect(),
            Convention::Abb | Convention::Quaternion => vec![qw, qx, qy, qz],
            Convention::Ros => vec![qx, qy, qz, qw],
            Convention::DensoT => pose.rotation.columns(1, 2).iter().copied().collect(),
            Convention::Gba => zyx_of(&pose.rotation.transpose()).iter().rev().map(|a| -a).collect(),
            Convention::Kawasaki => zyz_of(&pose.rotation).to_vec(),
            Convention::Matrix => unreachable!("returned above"),
        });
        out
    }
}

/// Largest magnitude of a length with this label: one kilometre; `None` if the label is not a length.
fn most(label: &str) -> Option<f64> {
    match label.split_once(' ')?.1 {
        "mm" => Some(1e6),
        "m" => Some(1e3),
        _ => None,
    }
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Convention>("pose convention", word)
}

/// Rz(z)·Ry(y)·Rx(x), degrees (the paper's Table 2).
pub fn zyx_deg(z: f64, y: f64, x: f64) -> Mat3 {
    exp(&(Vec3::z() * z.to_radians())) * exp(&(Vec3::y() * y.to_radians())) * exp(&(Vec3::x() * x.to_radians()))
}

/// The angles [z, y, x] in degrees with `zyx_deg(z, y, x) == r`.
pub fn zyx_of(r: &Mat3) -> [f64; 3] {
    let cos_y = r[(0, 0)].hypot(r[(1, 0)]);
    let y = (-r[(2, 0)]).atan2(cos_y);
    let (z, x) = if cos_y > 1e-9 {
        (r[(1, 0)].atan2(r[(0, 0)]), r[(2, 1)].atan2(r[(2, 2)]))
    } else {
        ((-r[(0, 1)]).atan2(r[(1, 1)]), 0.0)
    };
    [z, y, x].map(f64::to_degrees)
}

/// O, A, T in degrees of Rz(O)·Ry(A)·Rz(T), A in 0..=180; where A is 0 or 180 the split is free and T is set to 0.
fn zyz_of(r: &Mat3) -> [f64; 3] {
    let a = r[(0, 2)].hypot(r[(1, 2)]).atan2(r[(2, 2)]);
    let (o, t) = if a.sin() > 1e-9 {
        (r[(1, 2)].atan2(r[(0, 2)]), r[(2, 1)].atan2(-r[(2, 0)]))
    } else {
        // At 180 degrees the x axis is reversed.
        let s = a.cos().signum();
        ((s * r[(1, 0)]).atan2(s * r[(0, 0)]), 0.0)
    };
    [o, a, t].map(f64::to_degrees)
}

fn quaternion(w: f64, x: f64, y: f64, z: f64) -> Result<Mat3> {
    let q = nalgebra::Quaternion::new(w, x, y, z);
    if (q.norm() - 1.0).abs() > 1e-2 {
        return Err(Fault::input(format!("a quaternion has length {:.4}, limit 1 ± 0.01", q.norm()))
            .cause("numbers in another order, or another convention")
            .next("check where the convention puts the real part"));
    }
    let m = nalgebra::UnitQuaternion::from_quaternion(q).to_rotation_matrix().into_inner();
    repair(&m).map(|r| r.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Base, Camera, Flange};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_convention_reads_what_it_writes(
            w in proptest::array::uniform3(-1.8f64..1.8), t in proptest::array::uniform3(-900.0f64..900.0)
        ) {
            let pose: Rigid<Base, Flange> = Rigid::from_vectors(&Vec3::from(w), Vec3::from(t));
            for &c in Convention::ALL {
                let (angle, shift) = c.read(&c.write(&pose)).unwrap().difference(&pose);
                prop_assert!(angle < 1e-7 && shift < 1e-9, "{} {angle} {shift}", c.name());
            }
        }
    }

    /// The paper's Table 2: its angles against its printed matrix, which has four decimals and is a rotation only
    /// after it is made orthonormal.
    #[test]
    fn table_2_of_the_paper() {
        let angles = [-46.2089, 1.38484, 93.631, 359.941, 1.00457, 267.802];
        let from_angles: Rigid<Flange, Camera> = Convention::Denso.read(&angles).unwrap();
        let printed = Mat3::new(-0.0383, 0.9992, 0.0003, -0.9991, -0.0383, -0.0175, -0.0175, -0.0010, 0.9998);
        let from_matrix = repair(&printed).unwrap();
        assert!(from_matrix.departure > 1e-5, "the printed digits are truncated");
        assert!((from_angles.rotation - from_matrix.rotation).amax() < 1e-4);
    }

    #[test]
    fn a_gimbal_locked_pose_survives() {
        let pose: Rigid<Base, Flange> = Rigid::new(zyx_deg(30.0, 90.0, 20.0), Vec3::zeros());
        let again: Rigid<Base, Flange> = Convention::Denso.read(&Convention::Denso.write(&pose)).unwrap();
        assert!(again.difference(&pose).0 < 1e-7);
    }

    #[test]
    fn a_wrong_count_is_refused() {
        assert!(Convention::Abb.read::<Base, Flange>(&[0.0; 6]).is_err());
        let read = |n: &[f64]| Convention::Denso.read::<Base, Flange>(n);
        let pose = [300.0, 0.0, 590.0, 180.0, 0.0, 180.0];
        assert_eq!(read(&[&pose[..], &[5.0]].concat()).unwrap(), read(&pose).unwrap());
        for figure in [5.5, 32.0, f64::NAN] {
            assert!(read(&[&pose[..], &[figure]].concat()).unwrap_err().what.contains("figure"));
        }
    }
}
