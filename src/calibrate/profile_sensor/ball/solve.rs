//! In: profiles of a ball by a line-profile sensor, and the robot's poses. Out: the sensor's pose on the flange and
//! the ball's centre by maximum likelihood, and the ball's side of the profile plane.
//! Frame and unit: flange_from_sensor, ball in the base frame; mm, rad (docs/math.md, Ball (1) to (6)).

use super::circle::{Circle, circle};
use super::options::{BallOptions, Side};
use super::rows::{Ball, State, in_sensor};
use crate::calibrate::profile_sensor::found::{ProfileResidual, SensorFit};
use crate::calibrate::profile_sensor::likelihood::{Item, Noise, Solved, fit, misfit};
use crate::calibrate::profile_sensor::ranges::enough;
use crate::calibrate::profile_sensor::selection::{Data, Solution};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Mat3, Rigid, Vec3, orthonormalise};
use crate::recording::profiles::Profile;
use crate::solve::Loss;
use nalgebra::{DMatrix, DVector};

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct BallFit {
    /// The sensor's pose and how well the profiles agree on it.
    pub fit: SensorFit,
    /// Centre of the ball in the base frame, mm.
    pub ball: Vec3,
    /// Side of the profile plane on which the ball's centre lies in most profiles.
    pub side: Side,
    /// Excess misfit of the solution on the other side (squared Mahalanobis distance). Infinite if it does not exist.
    pub side_margin: f64,
    /// Signed distance of the ball's centre from the profile plane, mm, by profile.
    pub heights: Vec<f64>,
}

type Profiles<'a> = Data<'a, 3, Ball>;

/// Start values for one side: the sensor's x and z axes, its position and the ball, linear in the circles' centres.
/// The y axis completes the right-handed frame.
fn starts(items: &[Item<'_, Circle>], radius: f64, side: Side) -> Vec<State> {
    let sign = if side == Side::Plus { 1.0 } else { -1.0 };
    let height = |c: &Circle| sign * (radius * radius - c.value.z * c.value.z).max(0.0).sqrt();
    let mut out = Vec::new();
    for with_y in [true, false] {
        let n = if with_y { 15 } else { 12 };
        let (mut h, mut g) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for item in items {
            let (r, c) = (item.pose.rotation, item.measured);
            let mut row = DMatrix::<f64>::zeros(3, n);
            let mut put = |at: usize, m: Mat3| row.view_mut((0, at), (3, 3)).copy_from(&m);
            put(0, r * c.value.x);
            put(3, r * c.value.y);
            put(6, r);
            put(9, -Mat3::identity());
            if with_y {
                put(12, r * height(c));
            }
            h += row.transpose() * &row;
            g -= row.transpose() * item.pose.translation;
        }
        let Some(s) = h.clone().svd(true, true).solve(&g, 1e-12 * h.amax()).ok() else { continue };
        let v = |i: usize| Vec3::new(s[i], s[i + 1], s[i + 2]);
        let (x, z) = (v(0), v(3));
        let rotation = orthonormalise(&Mat3::from_columns(&[x, z.cross(&x), z]));
        let mean = items.iter().map(|i| height(i.measured)).sum::<f64>() / items.len() as f64;
        let shift: Vec3 = if with_y { Vec3::zeros() } else { rotation.column(1) * mean };
        out.push(State { x: Rigid::new(rotation, v(6) - shift), ball: v(9) });
    }
    out
}

/// Side of the ball in the majority of the profiles.
fn side_of(items: &[Item<'_, Circle>], s: &State) -> Side {
    let plus = items.iter().filter(|i| in_sensor(s, i.pose).y > 0.0).count();
    if 2 * plus >= items.len() { Side::Plus } else { Side::Minus }
}

fn undetermined() -> Fault {
    Fault::refused("the sensor's pose on the flange is not determined by these profiles")
        .cause("the flange turned about fewer than two axes, or the ball was always at the same place of the line")
        .next(
            "scan the ball with the flange tilted by 20 degrees and more about two axes, at both ends of the line \
               and at several distances",
        )
}

/// The robust fit of lowest cost with the ball on one side. If the ball is seen from both sides, a start on one
/// side may end on the other, so the starts of both sides are tried.
fn best_start(data: &Profiles<'_>, side: Side, point: f64) -> Option<Solved<State>> {
    let rough = Noise { point, robot: vec![0.5] };
    [Side::Plus, Side::Minus]
        .into_iter()
        .flat_map(|s| starts(&data.items, data.target.radius, s))
        .filter_map(|s| fit(data.target, &data.items, &s, &rough, Loss::Cauchy(2.0)))
        .filter(|s| side_of(&data.items, &s.state) == side)
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// A solution, and the side on which it has the ball.
struct Sided {
    side: Side,
    solution: Solution<State>,
}

/// The solution with the ball on one side, without the profiles beyond the gate.
fn on_side(data: &Profiles<'_>, side: Side, point: f64) -> Option<Sided> {
    let noise = Noise { point, robot: vec![0.1] };
    let solution = data.settled(best_start(data, side, point)?, noise, (0..data.items.len()).collect())?;
    Some(Sided { side: side_of(&data.items, &solution.solved.state), solution })
}

/// Refuses a pose with a sigma of a fifth of the ball's radius or more. Rotations count at a lever arm of 50 mm
/// or the radius, whichever is larger.
fn determined(solved: &Solved<State>, radius: f64) -> Result<()> {
    let c = &solved.covariance;
    let largest_sigma =
        (0..6).map(|i| c[(i, i)].sqrt() * if i < 3 { 1.0 } else { radius.max(50.0) }).fold(0.0, f64::max);
    if !(largest_sigma < 0.2 * radius) {
        return Err(undetermined());
    }
    Ok(())
}

/// Residuals of one profile in the fit, and in the fit to the others.
fn residual(data: &Profiles<'_>, s: &Solution<State>, i: usize, name: &str) -> ProfileResidual {
    let (with, without) = s.residuals(data, i);
    let used = s.used.contains(&i);
    ProfileResidual {
        name: name.to_owned(),
        used,
        points: data.items[i].measured.points,
        mm: with.norm(),
        holdout_mm: without.map_or(f64::INFINITY, |r| r.norm()),
        distance2: s.distance2(data, i, used),
        why: None,
    }
}

/// Solves for the sensor on the flange and the ball in the base frame. Profile i belongs to pose i.
pub fn solve(profiles: &[Profile], poses: &[Rigid<Base, Flange>], o: &BallOptions) -> Result<BallFit> {
    o.check()?;
    enough(profiles, poses, o.min_profiles, "ball")?;
    let ball = Ball { radius: o.diameter / 2.0 };
    let circles = circles_of(profiles, ball.radius, o)?;
    let items = circles.iter().zip(poses).map(|(measured, pose)| Item { measured, pose }).collect();
    let data = Data { target: &ball, items, gate: o.gate, least: o.min_profiles, most: usize::MAX };
    let point = point_sigma(&circles);
    let sides = [Side::Plus, Side::Minus].into_iter().filter_map(|side| on_side(&data, side, point)).collect();
    let (Sided { side, solution }, side_margin) = told_side(&data, sides, o)?;
    determined(&solution.solved, ball.radius)?;
    let residuals = profiles.iter().enumerate().map(|(i, p)| residual(&data, &solution, i, &p.name)).collect();
    let Solution { solved, noise, used } = solution;
    let heights = poses.iter().map(|pose| in_sensor(&solved.state, pose).y).collect();
    let fit = SensorFit {
        flange_from_sensor: solved.state.x,
        chi2: solved.cost / ((3 * used.len()) as f64 - 9.0).max(1.0),
        covariance: solved.covariance,
        point_sigma: noise.point,
        robot_sigma: noise.robot[0],
        profiles: residuals,
        end: solved.end,
    };
    Ok(BallFit { fit, ball: solved.state.ball, side, side_margin, heights })
}

/// One circle per profile; none may be larger than the ball.
fn circles_of(profiles: &[Profile], radius: f64, o: &BallOptions) -> Result<Vec<Circle>> {
    let circles = profiles.iter().map(|p| circle(p, radius, o)).collect::<Result<Vec<_>>>()?;
    let largest = circles.iter().map(|c| c.value.z).fold(0.0, f64::max);
    if largest > 1.02 * radius + o.gate_mm {
        return Err(Fault::input(format!(
            "a profile's circle has a radius of {largest:.3} mm, the ball's is {radius:.3} mm"
        ))
        .cause("the ball's diameter is wrong, or the profiles are in another unit")
        .next("measure the ball and give its diameter in mm"));
    }
    Ok(circles)
}

/// Sigma of a profile point about its circle, pooled over all profiles, mm.
fn point_sigma(circles: &[Circle]) -> f64 {
    let freedom: f64 = circles.iter().map(|c| c.points[0] as f64 - 3.0).sum();
    (circles.iter().map(|c| c.squares).sum::<f64>() / freedom.max(1.0)).sqrt().max(1e-5)
}

/// The solution on the stated side, or on the side that fits clearly better, and the excess misfit of the other side.
fn told_side(data: &Profiles<'_>, mut sides: Vec<Sided>, o: &BallOptions) -> Result<(Sided, f64)> {
    // Both sides are judged with the noise of the solution with less robot noise.
    sides.sort_by(|a, b| a.solution.noise.robot[0].total_cmp(&b.solution.noise.robot[0]));
    // If the ball is seen equally often from both sides, both solutions may end on the same side.
    sides.dedup_by_key(|s| s.side);
    let margin = match sides.as_slice() {
        [] => return Err(undetermined()),
        [_] => f64::INFINITY,
        [a, b, ..] => {
            let of =
                |s: &Sided| misfit(data.target, &data.items, &s.solution.solved.state, &a.solution.noise, data.gate);
            of(b) - of(a)
        }
    };
    let found =
        match o.side {
            Some(wanted) => sides.into_iter().find(|s| s.side == wanted).ok_or_else(|| {
                Fault::refused(format!("no solution has the ball on the stated side ({wanted:?})"))
                    .cause("the side is counted along the sensor's y axis: y = z × x")
                    .next("check the direction of the sensor's x axis, or leave the side to the data")
            })?,
            None if margin < o.clear => {
                return Err(Fault::refused(format!(
                "the data does not show on which side of the profile plane the ball is: the other side fits worse by \
                 {margin:.1} only, {} are needed",
                o.clear
            ))
            .cause("the profiles all pass near the ball's middle, or the poses are too alike")
            .next("state it with --side plus or --side minus (y = z × x of the sensor), or add poses with other \
                   tilts"));
            }
            None => sides.swap_remove(0),
        };
    Ok((found, margin))
}
