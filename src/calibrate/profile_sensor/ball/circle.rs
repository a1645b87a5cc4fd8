//! In: a profile of a ball. Out: the circle through its points, with its information matrix.
//! Frame and unit: the sensor's plane y = 0, mm; docs/math.md, Ball (2).

use super::options::BallOptions;
use crate::fault::{Fault, Result};
use crate::geometry::{Mat3, Vec3};
use crate::recording::profiles::Profile;
use crate::solve::{ConsensusOptions, LmOptions, Loss, Problem, Residuals, consensus, lm};

/// A profile as a measurement: centre x, z and radius of the circle. The information matrix holds for a point
/// variance of 1 mm².
pub struct Circle {
    pub value: Vec3,
    pub information: Mat3,
    /// The profile's points on the ball.
    pub on: Vec<[f64; 2]>,
    /// Number of points on the ball, and number of points in the profile.
    pub points: [usize; 2],
    /// Weighted sum of the squared distances from the circle, mm².
    pub squares: f64,
}

struct CircleFit<'a>(&'a [[f64; 2]]);

impl Problem for CircleFit<'_> {
    type State = Vec3;
    fn width(&self) -> usize {
        3
    }
    fn moved(&self, s: &Vec3, d: &[f64]) -> Vec3 {
        s + Vec3::new(d[0], d[1], d[2])
    }
    fn residuals(&self, s: &Vec3, out: &mut Residuals) -> Option<()> {
        for [x, z] in self.0 {
            let (dx, dz) = (x - s.x, z - s.y);
            let r = dx.hypot(dz);
            if r < 1e-9 {
                return None;
            }
            out.group(&[r - s.z], &[0, 1, 2], &[-dx / r, -dz / r, -1.0]);
        }
        Some(())
    }
}

/// Fits the circle that most points of a profile lie on; its radius may not exceed the ball's.
pub fn circle(profile: &Profile, radius: f64, o: &BallOptions) -> Result<Circle> {
    let p = &profile.points;
    let options = ConsensusOptions { threshold: o.gate_mm, max_draws: 4000, seed: o.seed, ..Default::default() };
    let found = consensus(
        p.len(),
        3,
        &options,
        |c| {
            let [a, b, d] = [p[c[0]], p[c[1]], p[c[2]]];
            // Perpendicular bisectors.
            let m = nalgebra::Matrix2::new(b[0] - a[0], b[1] - a[1], d[0] - a[0], d[1] - a[1]) * 2.0;
            let sq = |q: [f64; 2]| q[0] * q[0] + q[1] * q[1];
            let c = m.lu().solve(&nalgebra::Vector2::new(sq(b) - sq(a), sq(d) - sq(a)))?;
            let r = (a[0] - c.x).hypot(a[1] - c.y);
            (r > 0.1 * radius && r < 1.05 * radius + o.gate_mm).then_some(Vec3::new(c.x, c.y, r))
        },
        |c, i| (p[i][0] - c.x).hypot(p[i][1] - c.y) - c.z,
    );
    let weak = |what: String| {
        Fault::refused(format!("{}: {what}", profile.name))
            .cause("the line missed the ball, or the diameter is wrong")
            .next("exclude this profile, and take others through the upper half of the ball")
    };
    let found = found.ok_or_else(|| weak(format!("no circle of radius up to {radius:.2} mm in {} points", p.len())))?;
    if found.inliers.len() < 8 {
        return Err(weak(format!("only {} points lie on a circle, 8 are needed", found.inliers.len())));
    }
    // A sensor sees only one half of the ball. Points opposite to most of the others (on the table that the ball
    // stands on) are close to the circle by chance.
    let towards = |q: &[f64; 2]| nalgebra::Vector2::new(q[0] - found.model.x, q[1] - found.model.y).normalize();
    let middle: nalgebra::Vector2<f64> = found.inliers.iter().map(|&i| towards(&p[i])).sum();
    let on: Vec<[f64; 2]> = found.inliers.iter().map(|&i| p[i]).filter(|q| towards(q).dot(&middle) > 0.0).collect();
    let options = LmOptions { loss: Loss::Huber(2.0), estimate_scale: true, ..Default::default() };
    let fit = lm(&CircleFit(&on), found.model, &options).minimum();
    let fit = fit.ok_or_else(|| weak("the circle's fit does not come to rest".into()))?;
    let mut information = Mat3::zeros();
    let mut squares = 0.0;
    for ([x, z], w) in on.iter().zip(&fit.weights) {
        let (dx, dz) = (x - fit.state.x, z - fit.state.y);
        let r = dx.hypot(dz);
        let j = Vec3::new(-dx / r, -dz / r, -1.0);
        information += j * j.transpose() * *w;
        squares += w * (r - fit.state.z).powi(2);
    }
    if information.try_inverse().is_none() {
        return Err(weak("the arc is too short for a circle".into()));
    }
    Ok(Circle { value: fit.state, information, points: [on.len(), p.len()], squares, on })
}
