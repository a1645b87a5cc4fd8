//! In: a profile's line, the robot's pose, a sensor and a plate. Out: the line's residual and its derivatives.
//! Frame and unit: see `likelihood`; the plate's plane in the base frame; mm, rad (docs/math.md, Plate (1) to (4)).

use super::line::Line;
use crate::calibrate::profile_sensor::likelihood::{Item, Row, Target, UNKNOWNS};
use crate::geometry::{Flange, LeftStep, Rigid, Sensor, Vec2, Vec3};
use nalgebra::{Matrix2, Matrix2x3, RowSVector, SMatrix, Vector2};

/// The unknowns: the sensor on the flange, the plate as normal · X = offset in the base frame.
#[derive(Clone, Copy, Debug)]
pub struct State {
    pub x: Rigid<Flange, Sensor>,
    pub normal: Vec3,
    pub offset: f64,
}

/// A flat plate as the target.
pub struct Plate;

/// Two unit vectors across a unit vector.
pub fn across(n: &Vec3) -> [Vec3; 2] {
    let a = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
    [a, n.cross(&a)]
}

/// A place in the sensor's plane as a vector of its frame.
pub fn raised(v: &Vec2) -> Vec3 {
    Vec3::new(v.x, 0.0, v.y)
}

impl Target<2> for Plate {
    type State = State;
    type Measured = Line;
    fn moved(&self, s: &State, d: &[f64]) -> State {
        let [a, b] = across(&s.normal);
        State {
            x: LeftStep::new(d).moved(&s.x),
            normal: (s.normal + a * d[6] + b * d[7]).normalize(),
            offset: s.offset + d[8],
        }
    }
    fn row(&self, s: &State, item: &Item<'_, Line>) -> Row<2> {
        let (rx, rb, n) = (s.x.rotation, item.pose.rotation, s.normal);
        // The plate's normal in the flange frame.
        let m = rb.transpose() * n;
        let [ea, eb] = across(&n);
        // Derivative of n · R_B R_X v by all unknowns, v in the sensor frame and R_X v given.
        let by_turn = |v: &Vec3| {
            let (r, b) = (v.cross(&m), rb * v);
            RowSVector::<f64, UNKNOWNS>::from_row_slice(&[0.0, 0.0, 0.0, r.x, r.y, r.z, ea.dot(&b), eb.dot(&b), 0.0])
        };
        let (x, z) = (rx.column(0).into_owned(), rx.column(2).into_owned());
        let (ax, az) = (m.dot(&x), m.dot(&z));
        // Where the plate is parallel to the profile plane it has no line; a small sine keeps the derivative finite.
        let sine = ax.hypot(az).max(1e-6);
        let by_sine = (by_turn(&x) * ax + by_turn(&z) * az) / sine;
        let (along, arm) = (rx * raised(&item.measured.along), rx * raised(&item.measured.middle));
        let place = rb * (arm + s.x.translation) + item.pose.translation;
        let turn = m.dot(&along) / sine;
        let shift = (n.dot(&place) - s.offset) / sine;
        let by_shift = by_turn(&arm)
            + RowSVector::<f64, UNKNOWNS>::from_row_slice(&[
                m.x,
                m.y,
                m.z,
                0.0,
                0.0,
                0.0,
                ea.dot(&(place - rb * arm)),
                eb.dot(&(place - rb * arm)),
                -1.0,
            ]);
        let by = SMatrix::<f64, 2, UNKNOWNS>::from_rows(&[
            (by_turn(&along) - by_sine * turn) / sine,
            (by_shift - by_sine * shift) / sine,
        ]);
        // Errors of the robot: its position, and its orientation about the flange's origin, in the base frame.
        let zero = Vec3::zeros();
        let rows = |a: Vec3, b: Vec3| Matrix2x3::from_rows(&[a.transpose(), b.transpose()]);
        let turned = rows((rb * along).cross(&n) / sine, (place - item.pose.translation).cross(&n) / sine);
        Row { residual: Vector2::new(turn, shift), by, robot: vec![rows(zero, n / sine), turned] }
    }
    fn own(&self, line: &Line) -> Matrix2<f64> {
        Matrix2::new(1.0 / line.spread, 0.0, 0.0, 1.0 / line.weight)
    }
    fn floors(&self) -> &'static [f64] {
        // 0.1 um and 1e-7 rad.
        &[1e-8, 1e-14]
    }
}

/// rms distance of a line's points from the plate's line in the profile, mm.
pub fn rms(line: &Line, residual: &Vector2<f64>) -> f64 {
    (residual[1].powi(2) + residual[0].powi(2) * line.spread / line.weight).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Base, exp};

    /// Derivatives by the unknowns and by the robot's errors against differences, far from the minimum too.
    #[test]
    fn derivatives_agree_with_differences() {
        let turn = exp(&Vec3::new(0.4, -0.2, 2.0));
        let x: Rigid<Flange, Sensor> = Rigid::new(turn, Vec3::new(40.0, -25.0, 90.0));
        let s = State { x, normal: Vec3::new(0.2, -0.3, 0.9).normalize(), offset: 17.0 };
        let line = Line {
            middle: Vec2::new(3.0, 150.0),
            along: Vec2::new(0.9, -0.2).normalize(),
            weight: 80.0,
            spread: 9000.0,
            length: 40.0,
            on: vec![],
            points: [80, 80],
            squares: 0.0,
        };
        let pose: Rigid<Base, Flange> = Rigid::from_vectors(&Vec3::new(2.0, 0.4, -0.3), Vec3::new(30.0, -50.0, 260.0));
        let row = Plate.row(&s, &Item { measured: &line, pose: &pose });
        let at = |s: &State, pose: &Rigid<Base, Flange>| Plate.row(s, &Item { measured: &line, pose }).residual;
        let h = 1e-6;
        for c in 0..UNKNOWNS {
            let by = |sign: f64| {
                let mut d = [0.0; UNKNOWNS];
                d[c] = sign * h;
                at(&Plate.moved(&s, &d), &pose)
            };
            let off = (by(1.0) - by(-1.0)) / (2.0 * h) - row.by.column(c);
            assert!(off.norm() < 1e-5 * row.by.column(c).norm().max(1e-3), "unknown {c}: {off}");
        }
        // The robot's derivatives hold at a minimum: the line lies on the plate there.
        let m = x.rotation.transpose() * pose.rotation.transpose() * s.normal;
        let line = Line { along: Vec2::new(-m.z, m.x).normalize(), ..line };
        let place = pose.point(&x.point(&raised(&line.middle)));
        let s = State { offset: s.normal.dot(&place), ..s };
        let row = Plate.row(&s, &Item { measured: &line, pose: &pose });
        let at = |pose: &Rigid<Base, Flange>| Plate.row(&s, &Item { measured: &line, pose }).residual;
        assert!(row.residual.norm() < 1e-9);
        for c in 0..6 {
            let by = |sign: f64| {
                let mut d = [0.0; 6];
                d[c] = sign * h;
                at(&LeftStep::new(&d).moved(&pose))
            };
            let off = (by(1.0) - by(-1.0)) / (2.0 * h) - row.robot[c / 3].column(c % 3);
            assert!(off.norm() < 1e-5 * row.robot[c / 3].norm(), "robot {c}: {off}");
        }
    }
}
