//! In: a profile's circle, the robot's pose, a sensor and a ball. Out: the circle's residual and its derivatives.
//! Frame and unit: see `likelihood`; the ball in the base frame; mm, rad (docs/math.md, Ball (1) and (2)).

use super::circle::Circle;
use crate::calibrate::profile_sensor::likelihood::{Item, Row, Target};
use crate::geometry::{Base, Flange, LeftStep, Mat3, Rigid, Sensor, Vec3, skew};
use nalgebra::SMatrix;

/// The unknowns: the sensor on the flange, the ball's centre in the base frame.
#[derive(Clone, Copy)]
pub struct State {
    pub x: Rigid<Flange, Sensor>,
    pub ball: Vec3,
}

/// A ball as the target; its radius, mm.
pub struct Ball {
    pub radius: f64,
}

/// The ball's centre in the sensor frame, mm.
pub fn in_sensor(s: &State, pose: &Rigid<Base, Flange>) -> Vec3 {
    s.x.inverse().point(&pose.inverse().point(&s.ball))
}

/// The expected circle and its derivatives by the ball's position in the sensor frame.
fn expected(q: &Vec3, radius: f64) -> (Vec3, Mat3) {
    // Beyond the ball's radius there is no circle; a small radius keeps the derivative finite.
    let r = (radius * radius - q.y * q.y).max((0.02 * radius).powi(2)).sqrt();
    (Vec3::new(q.x, q.z, r), Mat3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -q.y / r, 0.0))
}

impl Target<3> for Ball {
    type State = State;
    type Measured = Circle;
    fn moved(&self, s: &State, d: &[f64]) -> State {
        let v = |i: usize| Vec3::new(d[i], d[i + 1], d[i + 2]);
        State { x: LeftStep::new(d).moved(&s.x), ball: s.ball + v(6) }
    }
    fn row(&self, s: &State, item: &Item<'_, Circle>) -> Row<3> {
        let q = in_sensor(s, item.pose);
        let (c, by_q) = expected(&q, self.radius);
        let (rx, rb) = (s.x.rotation.transpose(), item.pose.rotation.transpose());
        // q = R_Xᵀ(R_Bᵀ(p − t_B) − t_X); a left rotation r of R_X rotates the bracket by −r.
        let mut by = SMatrix::<f64, 3, 9>::zeros();
        by.fixed_view_mut::<3, 3>(0, 0).copy_from(&-rx);
        by.fixed_view_mut::<3, 3>(0, 3).copy_from(&(rx * skew(&(s.x.rotation * q))));
        by.fixed_view_mut::<3, 3>(0, 6).copy_from(&(rx * rb));
        // The robot's position error moves the ball in the sensor frame by as much, in every direction alike.
        Row { residual: c - item.measured.value, by: by_q * by, robot: vec![by_q] }
    }
    fn own(&self, circle: &Circle) -> Mat3 {
        circle.information.try_inverse().unwrap_or_else(|| Mat3::identity() * 1e6)
    }
    fn floors(&self) -> &'static [f64] {
        &[1e-8]
    }
}
