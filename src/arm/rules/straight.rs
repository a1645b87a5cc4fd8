//! A straight path of the flange with a constant turning rate, and the speed of the points on the flange along it;
//! base frame, mm, rad.

use crate::geometry::{Base, Flange, Rigid, Vec3, exp, log};

/// The path from one pose to another.
#[derive(Clone, Debug)]
pub struct Straight {
    from: Rigid<Base, Flange>,
    to: Rigid<Base, Flange>,
    /// Translation of the flange's origin, mm.
    pub shift: Vec3,
    /// Rotation vector of the whole path: the axis times the angle, rad.
    pub turn: Vec3,
}

impl Straight {
    /// The path between two poses.
    pub fn new(from: &Rigid<Base, Flange>, to: &Rigid<Base, Flange>) -> Straight {
        let turn = log(&(to.rotation * from.rotation.transpose()));
        Straight { from: *from, to: *to, shift: to.translation - from.translation, turn }
    }

    /// The pose after a share of the path, 0 to 1.
    pub fn at(&self, share: f64) -> Rigid<Base, Flange> {
        if share == 1.0 {
            return self.to;
        }
        Rigid::new(exp(&(self.turn * share)) * self.from.rotation, self.from.translation + self.shift * share)
    }

    /// Greatest speed of a point of the flange's frame along the path, in mm per unit of time if the whole path
    /// takes one unit.
    ///
    /// The point moves with `shift + turn x q`, where `q` turns about the axis. The square of its speed is a
    /// constant plus a cosine of the angle turned so far: the speed is greatest where the cosine peaks, or at an
    /// end.
    pub fn fastest(&self, point: &Vec3) -> f64 {
        let angle = self.turn.norm();
        if angle == 0.0 {
            return self.shift.norm();
        }
        let (axis, arm) = (self.turn / angle, self.from.rotation * point);
        let across = arm - axis * axis.dot(&arm);
        let (cosine, sine) = (self.shift.dot(&axis.cross(&across)), -self.shift.dot(&across));
        let speed = |turned: f64| {
            let mixed = 2.0 * angle * (cosine * turned.cos() + sine * turned.sin());
            (self.shift.norm_squared() + angle * angle * across.norm_squared() + mixed).max(0.0).sqrt()
        };
        let peak = sine.atan2(cosine);
        let inside = (0.0..=angle).contains(&peak).then(|| speed(peak));
        // `f64::max` ignores NaN, so a pose that is not finite would seem to have a speed.
        if speed(0.0).is_nan() { f64::NAN } else { speed(0.0).max(speed(angle)).max(inside.unwrap_or(0.0)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_moment_of_a_point_is_found_wherever_on_the_way_it_is() {
        let from = Rigid::<Base, Flange>::from_vectors(&Vec3::new(0.3, -2.0, 0.4), Vec3::new(300.0, 20.0, 500.0));
        for k in 0..200 {
            let w = |a: f64, b: f64| (a * f64::from(k) + b).sin();
            let turn = Vec3::new(w(1.1, 0.3), w(2.3, 0.7), w(0.9, 1.9)).normalize() * (1.5 + 1.5 * w(0.7, 0.1));
            let shift = Vec3::new(w(1.7, 0.2), w(0.3, 0.5), w(2.9, 0.6)) * 200.0;
            let to = Rigid::new(exp(&turn) * from.rotation, from.translation + shift);
            let (way, point) = (Straight::new(&from, &to), Vec3::new(w(5.1, 0.1), w(4.7, 0.2), w(3.3, 0.9)) * 300.0);
            // Central differences at points along the path and at its ends.
            let (n, h) = (2000, 1e-6);
            let at = |share: f64| way.at(share).point(&point);
            let speed =
                |i: i32| (at(f64::from(i) / f64::from(n) + h) - at(f64::from(i) / f64::from(n) - h)).norm() / (2.0 * h);
            let sampled = (0..=n).map(speed).fold(0.0, f64::max);
            let found = way.fastest(&point);
            assert!((found / sampled - 1.0).abs() < 2e-6, "{k}: {found} {sampled}");
        }
        let nothing = Rigid::new(from.rotation, Vec3::repeat(f64::NAN));
        assert!(Straight::new(&from, &nothing).fastest(&Vec3::x()).is_nan());
    }
}
