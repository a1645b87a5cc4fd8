//! All possible meanings of an orientation's numbers: angles about any axes in any order, rotation vectors,
//! quaternions, orient and approach vectors, matrices. In degrees or radians.

use crate::geometry::{Mat3, Vec3, exp, log};
use crate::robot::{Convention, Written, zyx_of};

/// One factor of a product of rotations: its axis, and the number that gives its angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Axis of the rotation: 0 is x.
    pub axis: usize,
    /// Index of the angle among the three numbers.
    pub number: usize,
}

/// How numbers form a rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Orientation {
    /// R is the product of these factors, from left to right.
    Turns { factors: [Turn; 3], degrees: bool },
    /// Axis times angle.
    Vector { degrees: bool },
    /// Four numbers.
    Quaternion { real_first: bool },
    /// The second and third column of R. Other pairs of columns differ only by a rotation of the flange, which no
    /// picture shows.
    OrientApproach,
    /// Nine numbers, row by row.
    Matrix,
}

/// How a program converted numbers into the matrices of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Made {
    /// R = Rz·Ry·Rx, degrees.
    Zyx,
    /// R = Rx·Ry·Rz, degrees.
    Xyz,
    /// A quaternion, real part first.
    Quaternion,
}

/// One way to read orientations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// For a file of matrices: how another program computed them from its numbers.
    pub made: Option<Made>,
    /// The meaning of the numbers.
    pub orientation: Orientation,
}

fn turns(axes: [usize; 3], numbers: [usize; 3]) -> [Turn; 3] {
    std::array::from_fn(|k| Turn { axis: axes[k], number: numbers[k] })
}

const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
/// Products of rotations whose first and last axes are equal.
const PROPER: [[usize; 3]; 6] = [[2, 1, 2], [2, 0, 2], [0, 1, 0], [0, 2, 0], [1, 0, 1], [1, 2, 1]];

impl Orientation {
    /// The meaning by a convention.
    pub fn of(convention: Convention) -> Orientation {
        let angles = |axes, numbers| Orientation::Turns { factors: turns(axes, numbers), degrees: true };
        match convention {
            Convention::Denso | Convention::Fanuc | Convention::Yaskawa => angles([2, 1, 0], [2, 1, 0]),
            Convention::Kuka => angles([2, 1, 0], [0, 1, 2]),
            Convention::Gba => angles([0, 1, 2], [0, 1, 2]),
            Convention::Kawasaki => angles([2, 1, 2], [0, 1, 2]),
            Convention::Ur => Orientation::Vector { degrees: false },
            Convention::Abb | Convention::Quaternion => Orientation::Quaternion { real_first: true },
            Convention::Ros => Orientation::Quaternion { real_first: false },
            Convention::DensoT => Orientation::OrientApproach,
            Convention::Matrix => Orientation::Matrix,
        }
    }

    /// All possible meanings of three angles.
    fn of_angles(degrees: bool) -> impl Iterator<Item = Orientation> {
        let products = ORDERS.into_iter().flat_map(|axes| ORDERS.map(|numbers| turns(axes, numbers)));
        let proper = PROPER.into_iter().flat_map(|axes| [turns(axes, [0, 1, 2]), turns(axes, [2, 1, 0])]);
        let turns = products.chain(proper).map(move |factors| Orientation::Turns { factors, degrees });
        turns.chain([Orientation::Vector { degrees }])
    }

    /// The rotation that the numbers represent; `None` if they represent none.
    pub fn rotation(self, n: &[f64]) -> Option<Mat3> {
        let rotation = match self {
            Orientation::Turns { factors, degrees } => factors.iter().fold(Mat3::identity(), |product, t| {
                let angle = if degrees { n[t.number].to_radians() } else { n[t.number] };
                product * exp(&(Vec3::ith(t.axis, 1.0) * angle))
            }),
            Orientation::Vector { degrees } => {
                exp(&(Vec3::new(n[0], n[1], n[2]) * if degrees { 1f64.to_radians() } else { 1.0 }))
            }
            Orientation::Quaternion { real_first } => {
                let [w, x, y, z] = if real_first { [n[0], n[1], n[2], n[3]] } else { [n[3], n[0], n[1], n[2]] };
                let q = nalgebra::Quaternion::new(w, x, y, z);
                nalgebra::UnitQuaternion::from_quaternion(q).to_rotation_matrix().into_inner()
            }
            Orientation::OrientApproach => {
                let (y, z) = (Vec3::new(n[0], n[1], n[2]), Vec3::new(n[3], n[4], n[5]));
                Mat3::from_columns(&[y.cross(&z), y, z])
            }
            Orientation::Matrix => Mat3::from_row_slice(&n[..9]),
        };
        rotation.iter().all(|x| x.is_finite()).then_some(rotation)
    }
}

/// The numbers of the rotation in a row of a file of matrices.
fn of_rows(rows: &[f64]) -> Vec<f64> {
    [0, 1, 2, 4, 5, 6, 8, 9, 10].map(|k| rows[k]).to_vec()
}

impl Reading {
    /// The reading by the convention as stated.
    pub fn of(convention: Convention) -> Reading {
        Reading { made: None, orientation: Orientation::of(convention) }
    }

    /// All readings of a convention's numbers, including the convention's own.
    pub fn all(convention: Convention) -> Vec<Reading> {
        let plain = |orientation| Reading { made: None, orientation };
        let quaternions = [true, false].map(|real_first| Orientation::Quaternion { real_first });
        match Orientation::of(convention) {
            Orientation::Turns { .. } | Orientation::Vector { .. } => {
                [true, false].into_iter().flat_map(Orientation::of_angles).map(plain).collect()
            }
            Orientation::Quaternion { .. } => quaternions.map(plain).to_vec(),
            Orientation::OrientApproach => vec![plain(Orientation::OrientApproach)],
            Orientation::Matrix => {
                let made = |made, orientation| Reading { made: Some(made), orientation };
                let angles = [Made::Zyx, Made::Xyz]
                    .into_iter()
                    .flat_map(|m| Orientation::of_angles(true).map(move |o| made(m, o)));
                let swapped = made(Made::Quaternion, quaternions[1]);
                [plain(Orientation::Matrix), swapped].into_iter().chain(angles).collect()
            }
        }
    }

    /// The numbers that this reading uses, from a pose as written in the file.
    fn numbers(&self, written: &Written) -> Vec<f64> {
        let n = &written.numbers;
        if written.convention != Convention::Matrix {
            return n[3..].to_vec();
        }
        let rows = of_rows(n);
        let r = Mat3::from_row_slice(&rows);
        let Some(made) = self.made else { return rows };
        let angles = match made {
            Made::Zyx => {
                let [z, y, x] = zyx_of(&r);
                [x, y, z]
            }
            // The transpose of Rz·Ry·Rx with the opposite angles.
            Made::Xyz => {
                zyx_of(&r.transpose()).map(|a| -a).into_iter().rev().collect::<Vec<_>>().try_into().expect("3")
            }
            Made::Quaternion => {
                let w = log(&r);
                let (half, axis) =
                    (w.norm() / 2.0, w.try_normalize(0.0).unwrap_or_else(Vec3::zeros) * (w.norm() / 2.0).sin());
                return vec![half.cos(), axis.x, axis.y, axis.z];
            }
        };
        // Two angle triples give this matrix; robots write the one whose middle angle is below a quarter turn.
        match self.orientation {
            Orientation::Turns { factors: [first, middle, last], .. }
                if first.axis != last.axis && angles[middle.number].abs() > 90.0 =>
            {
                let [x, y, z] = angles;
                vec![x - 180.0 * x.signum(), 180.0 * if y < 0.0 { -1.0 } else { 1.0 } - y, z - 180.0 * z.signum()]
            }
            _ => angles.to_vec(),
        }
    }

    /// The rotation of a pose under this reading.
    pub fn rotation(&self, written: &Written) -> Option<Mat3> {
        self.orientation.rotation(&self.numbers(written))
    }

    /// Conventions with this reading of orientations.
    pub fn conventions(&self) -> Vec<Convention> {
        let reads = |c: &Convention| Orientation::of(*c) == self.orientation;
        Convention::ALL.iter().copied().filter(reads).collect()
    }

    /// In words: `R = Rx(A)·Ry(B)·Rz(C)`.
    pub fn words(&self, convention: Convention) -> String {
        let names: Vec<&str> = match self.made {
            None => convention.labels().iter().skip(3).filter_map(|l| l.split(' ').next()).collect(),
            Some(_) => vec!["rx", "ry", "rz"],
        };
        let meant = match self.orientation {
            Orientation::Turns { factors, degrees } => {
                let factor = |t: Turn| format!("R{}({})", ["x", "y", "z"][t.axis], names[t.number]);
                format!("R = {}, {}", factors.map(factor).join("·"), if degrees { "degrees" } else { "radians" })
            }
            Orientation::Vector { degrees } => {
                format!("a rotation vector in {}", if degrees { "degrees" } else { "radians" })
            }
            Orientation::Quaternion { real_first } => {
                format!("a quaternion with its real part {}", if real_first { "first" } else { "last" })
            }
            Orientation::OrientApproach => "orient and approach vector".into(),
            Orientation::Matrix => "matrices row by row".into(),
        };
        match self.made {
            None => meant,
            Some(Made::Zyx) => format!("{meant}, of numbers that were made into these matrices as R = Rz·Ry·Rx"),
            Some(Made::Xyz) => format!("{meant}, of numbers that were made into these matrices as R = Rx·Ry·Rz"),
            Some(Made::Quaternion) => format!("{meant}, which was made into these matrices as if it came first"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Base, Flange, Rigid, angle_between};

    fn pose() -> Rigid<Base, Flange> {
        Rigid::from_vectors(&Vec3::new(0.4, -0.7, 1.1), Vec3::new(300.0, -40.0, 250.0))
    }

    #[test]
    fn every_convention_is_among_the_ways_to_read_its_numbers() {
        for &c in Convention::ALL {
            let written = Written { convention: c, numbers: c.write(&pose()) };
            assert!(Reading::all(c).contains(&Reading::of(c)), "{}", c.name());
            let read = Reading::of(c).rotation(&written).unwrap();
            assert!(angle_between(&read, &pose().rotation) < 1e-9, "{}", c.name());
        }
    }

    #[test]
    fn matrices_that_were_made_of_angles_the_wrong_way_are_read_as_they_were_meant() {
        for (made, wrong) in [(Made::Zyx, Convention::Denso), (Made::Xyz, Convention::Gba)] {
            for meant in [Convention::Denso, Convention::Gba] {
                let numbers = meant.write(&pose());
                let file: Rigid<Base, Flange> = wrong.read(&numbers).unwrap();
                let reading = Reading { made: Some(made), orientation: Orientation::of(meant) };
                let read = reading.rotation(&Written::matrix(&file)).unwrap();
                assert!(angle_between(&read, &pose().rotation) < 1e-9, "{made:?} {meant:?}");
            }
        }
        let mut numbers = Convention::Ros.write(&pose());
        numbers[..3].iter_mut().for_each(|x| *x *= 1000.0);
        let file: Rigid<Base, Flange> = Convention::Quaternion.read(&numbers).unwrap();
        let reading =
            Reading { made: Some(Made::Quaternion), orientation: Orientation::Quaternion { real_first: false } };
        let read = reading.rotation(&Written::matrix(&file)).unwrap();
        assert!(angle_between(&read, &pose().rotation) < 1e-9);
    }
}
