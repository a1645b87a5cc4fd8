//! In: profiles of a ball by a line-profile sensor, and the robot's poses. Out: the sensor's pose on the flange and
//! the ball's centre by maximum likelihood, and the ball's side of the profile plane.
//! Frame and unit: flange_from_sensor, ball in the base frame; mm, rad (docs/math.md, Ball (1) to (6)).

use super::circle::{Circle, circle};
use super::options::{BallOptions, Side};
use crate::calibrate::components::Components;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, LeftStep, Mat3, Rigid, Sensor, Vec3, orthonormalise, skew};
use crate::recording::profiles::Profile;
use crate::solve::{End, LmOptions, Loss, Problem, Residuals, lm};
use nalgebra::{DMatrix, DVector, SMatrix};

/// Residuals of one profile.
#[derive(Clone, Debug)]
pub struct ProfileResidual {
    /// Name of the profile.
    pub name: String,
    /// True if the profile is in the fit; false if it disagreed and was excluded.
    pub used: bool,
    /// Number of points on the ball, and number of points in the profile.
    pub points: [usize; 2],
    /// Length of the residual of centre and radius, mm.
    pub mm: f64,
    /// The same with the profile excluded from the fit, mm; infinite if the others determine no fit.
    pub holdout_mm: f64,
    /// Squared Mahalanobis distance, 3 degrees of freedom.
    pub distance2: f64,
    /// Signed distance of the ball's centre from the profile plane, mm.
    pub height: f64,
}

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct BallFit {
    /// Pose of the sensor on the flange, mm.
    pub flange_from_sensor: Rigid<Flange, Sensor>,
    /// Centre of the ball in the base frame, mm.
    pub ball: Vec3,
    /// tx ty tz (mm) rx ry rz (rad, left, flange frame), then the ball's x y z: 9x9.
    pub covariance: DMatrix<f64>,
    /// Sigma of a profile point, mm.
    pub point_sigma: f64,
    /// Sigma of the robot's position, estimated from the ball, per axis, mm.
    pub robot_sigma: f64,
    /// Side of the profile plane on which the ball's centre lies in most profiles.
    pub side: Side,
    /// Excess misfit of the solution on the other side (squared Mahalanobis distance). Infinite if it does not exist.
    pub side_margin: f64,
    /// One entry per profile, in the order given.
    pub profiles: Vec<ProfileResidual>,
    /// Squared Mahalanobis distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// Whether the fit is a minimum.
    pub end: End,
}

#[derive(Clone, Copy)]
struct State {
    x: Rigid<Flange, Sensor>,
    ball: Vec3,
}

/// The ball's centre in the sensor frame, mm.
fn in_sensor(s: &State, pose: &Rigid<Base, Flange>) -> Vec3 {
    s.x.inverse().point(&pose.inverse().point(&s.ball))
}

/// The expected circle and its derivatives by the ball's position in the sensor frame.
fn expected(q: &Vec3, radius: f64) -> (Vec3, Mat3) {
    // Beyond the ball's radius there is no circle; a small radius keeps the derivative finite.
    let r = (radius * radius - q.y * q.y).max((0.02 * radius).powi(2)).sqrt();
    (Vec3::new(q.x, q.z, r), Mat3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -q.y / r, 0.0))
}

#[derive(Clone, Copy)]
struct Item<'a> {
    circle: &'a Circle,
    pose: &'a Rigid<Base, Flange>,
}

/// Residual and its derivatives by the nine unknowns; last, the derivatives by the ball's position in the sensor
/// frame.
fn row(s: &State, item: &Item<'_>, radius: f64) -> (Vec3, SMatrix<f64, 3, 9>, Mat3) {
    let q = in_sensor(s, item.pose);
    let (c, by_q) = expected(&q, radius);
    let (rx, rb) = (s.x.rotation.transpose(), item.pose.rotation.transpose());
    // q = R_Xᵀ(R_Bᵀ(p − t_B) − t_X); a left rotation r of R_X rotates the bracket by −r.
    let mut by = SMatrix::<f64, 3, 9>::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).copy_from(&-rx);
    by.fixed_view_mut::<3, 3>(0, 3).copy_from(&(rx * skew(&(s.x.rotation * q))));
    by.fixed_view_mut::<3, 3>(0, 6).copy_from(&(rx * rb));
    (c - item.circle.value, by_q * by, by_q)
}

struct Fit<'a> {
    items: &'a [Item<'a>],
    whiteners: Vec<Mat3>,
    radius: f64,
}

impl Problem for Fit<'_> {
    type State = State;
    fn width(&self) -> usize {
        9
    }
    fn moved(&self, s: &State, d: &[f64]) -> State {
        let v = |i: usize| Vec3::new(d[i], d[i + 1], d[i + 2]);
        State { x: LeftStep::new(d).moved(&s.x), ball: s.ball + v(6) }
    }
    fn residuals(&self, s: &State, out: &mut Residuals) -> Option<()> {
        for (item, w) in self.items.iter().zip(&self.whiteners) {
            let (r, j, _) = row(s, item, self.radius);
            out.group((w * r).as_slice(), &[0, 1, 2, 3, 4, 5, 6, 7, 8], (w * j).transpose().as_slice());
        }
        Some(())
    }
}

/// Sigmas of a profile point and of the robot's position, mm.
struct Noise {
    point: f64,
    robot: f64,
}

fn covariance_of(s: &State, item: &Item<'_>, radius: f64, n: &Noise) -> Mat3 {
    let (_, _, by_q) = row(s, item, radius);
    let own = item.circle.information.try_inverse().unwrap_or_else(|| Mat3::identity() * 1e6) * (n.point * n.point);
    own + by_q * by_q.transpose() * (n.robot * n.robot)
}

/// A minimum, its covariance, and the sum of the squared Mahalanobis distances there.
struct Solved {
    state: State,
    covariance: DMatrix<f64>,
    cost: f64,
    end: End,
}

fn fit(items: &[Item<'_>], start: &State, radius: f64, n: &Noise, loss: Loss) -> Option<Solved> {
    let whiteners = items
        .iter()
        .map(|i| covariance_of(start, i, radius, n).cholesky()?.l().try_inverse())
        .collect::<Option<Vec<_>>>()?;
    let options = LmOptions { loss, ..Default::default() };
    let (s, end) = lm(&Fit { items, whiteners, radius }, *start, &options).ended()?;
    let cost = s.lengths.iter().map(|l| l * l).sum();
    Some(Solved { state: s.state, covariance: s.covariance?, cost, end })
}

/// One step of the estimate of the robot's variance component.
fn robot_sigma(items: &[Item<'_>], s: &State, radius: f64, n: &Noise) -> Option<f64> {
    let m = 3 * items.len();
    let mut model = Components {
        residual: DVector::zeros(m),
        jacobian: DMatrix::zeros(m, 9),
        known: DMatrix::zeros(m, m),
        parts: vec![DMatrix::zeros(m, m)],
    };
    for (i, item) in items.iter().enumerate() {
        let (r, j, by_q) = row(s, item, radius);
        model.residual.rows_mut(3 * i, 3).copy_from(&r);
        model.jacobian.view_mut((3 * i, 0), (3, 9)).copy_from(&j);
        let own = item.circle.information.try_inverse()? * (n.point * n.point);
        model.known.view_mut((3 * i, 3 * i), (3, 3)).copy_from(&own);
        model.parts[0].view_mut((3 * i, 3 * i), (3, 3)).copy_from(&(by_q * by_q.transpose()));
    }
    Some(model.step(&[n.robot * n.robot], &[1e-8])?[0].sqrt())
}

/// Start values for one side: the sensor's x and z axes, its position and the ball, linear in the circles' centres.
/// The y axis completes the right-handed frame.
fn starts(items: &[Item<'_>], radius: f64, side: Side) -> Vec<State> {
    let sign = if side == Side::Plus { 1.0 } else { -1.0 };
    let height = |c: &Circle| sign * (radius * radius - c.value.z * c.value.z).max(0.0).sqrt();
    let mut out = Vec::new();
    for with_y in [true, false] {
        let n = if with_y { 15 } else { 12 };
        let (mut h, mut g) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for item in items {
            let (r, c) = (item.pose.rotation, item.circle);
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
        let mean = items.iter().map(|i| height(i.circle)).sum::<f64>() / items.len() as f64;
        let shift: Vec3 = if with_y { Vec3::zeros() } else { rotation.column(1) * mean };
        out.push(State { x: Rigid::new(rotation, v(6) - shift), ball: v(9) });
    }
    out
}

/// Side of the ball in the majority of the profiles.
fn side_of(items: &[Item<'_>], s: &State) -> Side {
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

/// All profiles of one ball.
struct Data<'a> {
    items: Vec<Item<'a>>,
    radius: f64,
    o: &'a BallOptions,
}

/// The best solution that has the ball on one side of the profile plane.
struct Solution {
    side: Side,
    solved: Solved,
    noise: Noise,
    /// Profiles in the fit.
    used: Vec<usize>,
}

impl Data<'_> {
    fn chosen(&self, used: impl Iterator<Item = usize>) -> Vec<Item<'_>> {
        used.map(|i| self.items[i]).collect()
    }

    /// The robust fit of lowest cost with the ball on one side. If the ball is seen from both sides, a start on one
    /// side may end on the other, so the starts of both sides are tried.
    fn best_start(&self, side: Side, point: f64) -> Option<Solved> {
        let rough = Noise { point, robot: 0.5 };
        [Side::Plus, Side::Minus]
            .into_iter()
            .flat_map(|s| starts(&self.items, self.radius, s))
            .filter_map(|s| fit(&self.items, &s, self.radius, &rough, Loss::Cauchy(2.0)))
            .filter(|s| side_of(&self.items, &s.state) == side)
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// The solution with the ball on one side, without the profiles beyond the gate.
    fn on_side(&self, side: Side, point: f64) -> Option<Solution> {
        let all: Vec<usize> = (0..self.items.len()).collect();
        let noise = Noise { point, robot: 0.1 };
        let mut s = Solution { side, solved: self.best_start(side, point)?, noise, used: all };
        for _ in 0..12 {
            s.refit(self)?;
            let next = s.within_gate(self);
            if next == s.used || next.len() < self.o.min_profiles {
                break;
            }
            // Exclude one profile per round: a wrong profile also raises the distances of the others.
            let worst = s.worst(self)?;
            if s.distance2(self, worst, true) > self.o.gate {
                s.used.retain(|&i| i != worst);
            } else {
                s.used = next;
            }
        }
        Some(Solution { side: side_of(&self.items, &s.solved.state), ..s })
    }

    /// Sum of the squared Mahalanobis distances of all profiles, each limited to the gate.
    fn misfit(&self, s: &Solved, n: &Noise) -> f64 {
        let one = |i: &Item<'_>| {
            let (r, _, _) = row(&s.state, i, self.radius);
            let own = covariance_of(&s.state, i, self.radius, n).cholesky();
            own.map_or(f64::INFINITY, |c| r.dot(&c.solve(&r)).min(self.o.gate))
        };
        self.items.iter().map(one).sum()
    }
}

impl Solution {
    /// Least squares over the used profiles, alternating with the robot's variance component.
    fn refit(&mut self, data: &Data<'_>) -> Option<()> {
        let chosen = data.chosen(self.used.iter().copied());
        for _ in 0..8 {
            self.solved = fit(&chosen, &self.solved.state, data.radius, &self.noise, Loss::Squares)?;
            self.noise.robot = robot_sigma(&chosen, &self.solved.state, data.radius, &self.noise)?;
        }
        self.solved = fit(&chosen, &self.solved.state, data.radius, &self.noise, Loss::Squares)?;
        Some(())
    }

    fn distance2(&self, data: &Data<'_>, i: usize, used: bool) -> f64 {
        distance2(&self.solved, &data.items[i], data.radius, &self.noise, used)
    }

    fn within_gate(&self, data: &Data<'_>) -> Vec<usize> {
        let near = |i: &usize| self.distance2(data, *i, self.used.contains(i)) <= data.o.gate;
        (0..data.items.len()).filter(near).collect()
    }

    fn worst(&self, data: &Data<'_>) -> Option<usize> {
        let d = |i: usize| self.distance2(data, i, true);
        self.used.iter().copied().max_by(|&a, &b| d(a).total_cmp(&d(b)))
    }

    /// Refuses a pose with a sigma of a fifth of the ball's radius or more. Rotations count at a lever arm of 50 mm
    /// or the radius, whichever is larger.
    fn determined(&self, radius: f64) -> Result<()> {
        let c = &self.solved.covariance;
        let largest_sigma =
            (0..6).map(|i| c[(i, i)].sqrt() * if i < 3 { 1.0 } else { radius.max(50.0) }).fold(0.0, f64::max);
        if !(largest_sigma < 0.2 * radius) {
            return Err(undetermined());
        }
        Ok(())
    }

    /// Residuals of one profile in the fit, and in the fit to the others.
    fn residual(&self, data: &Data<'_>, i: usize, name: &str) -> ProfileResidual {
        let (item, state) = (&data.items[i], &self.solved.state);
        let rest = data.chosen(self.used.iter().copied().filter(|&k| k != i));
        let without = fit(&rest, state, data.radius, &self.noise, Loss::Squares);
        let used = self.used.contains(&i);
        ProfileResidual {
            name: name.to_owned(),
            used,
            points: item.circle.points,
            mm: row(state, item, data.radius).0.norm(),
            holdout_mm: without.map_or(f64::INFINITY, |s| row(&s.state, item, data.radius).0.norm()),
            distance2: self.distance2(data, i, used),
            height: in_sensor(state, item.pose).y,
        }
    }
}

/// Solves for the sensor on the flange and the ball in the base frame. Profile i belongs to pose i.
pub fn solve(profiles: &[Profile], poses: &[Rigid<Base, Flange>], o: &BallOptions) -> Result<BallFit> {
    o.check()?;
    enough(profiles, poses, o)?;
    let radius = o.diameter / 2.0;
    let circles = circles_of(profiles, radius, o)?;
    let items = circles.iter().zip(poses).map(|(circle, pose)| Item { circle, pose }).collect();
    let data = Data { items, radius, o };
    let point = point_sigma(&circles);
    let sides = [Side::Plus, Side::Minus].into_iter().filter_map(|side| data.on_side(side, point)).collect();
    let (found, side_margin) = told_side(&data, sides)?;
    found.determined(radius)?;
    let residuals = profiles.iter().enumerate().map(|(i, p)| found.residual(&data, i, &p.name)).collect();
    let Solution { side, solved, noise, used } = found;
    Ok(BallFit {
        flange_from_sensor: solved.state.x,
        ball: solved.state.ball,
        chi2: solved.cost / ((3 * used.len()) as f64 - 9.0).max(1.0),
        covariance: solved.covariance,
        point_sigma: noise.point,
        robot_sigma: noise.robot,
        side,
        side_margin,
        profiles: residuals,
        end: solved.end,
    })
}

fn enough(profiles: &[Profile], poses: &[Rigid<Base, Flange>], o: &BallOptions) -> Result<()> {
    if profiles.len() != poses.len() {
        return Err(Fault::input(format!("{} profiles and {} poses", profiles.len(), poses.len()))
            .cause("a profile or a pose is missing")
            .next("give one pose a profile, in the same order"));
    }
    if profiles.len() < o.min_profiles {
        return Err(Fault::refused(format!("{} profiles, {} are needed", profiles.len(), o.min_profiles))
            .next("scan the ball from more poses"));
    }
    Ok(())
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
fn told_side(data: &Data<'_>, mut sides: Vec<Solution>) -> Result<(Solution, f64)> {
    // Both sides are judged with the noise of the solution with less robot noise.
    sides.sort_by(|a, b| a.noise.robot.total_cmp(&b.noise.robot));
    // If the ball is seen equally often from both sides, both solutions may end on the same side.
    sides.dedup_by_key(|s| s.side);
    let margin = match sides.as_slice() {
        [] => return Err(undetermined()),
        [_] => f64::INFINITY,
        [a, b, ..] => data.misfit(&b.solved, &a.noise) - data.misfit(&a.solved, &a.noise),
    };
    let found =
        match data.o.side {
            Some(wanted) => sides.into_iter().find(|s| s.side == wanted).ok_or_else(|| {
                Fault::refused(format!("no solution has the ball on the stated side ({wanted:?})"))
                    .cause("the side is counted along the sensor's y axis: y = z × x")
                    .next("check the direction of the sensor's x axis, or leave the side to the data")
            })?,
            None if margin < data.o.clear => {
                return Err(Fault::refused(format!(
                "the data does not show on which side of the profile plane the ball is: the other side fits worse by \
                 {margin:.1} only, {} are needed",
                data.o.clear
            ))
            .cause("the profiles all pass near the ball's middle, or the poses are too alike")
            .next("state it with --side plus or --side minus (y = z × x of the sensor), or add poses with other \
                   tilts"));
            }
            None => sides.swap_remove(0),
        };
    Ok((found, margin))
}

/// Squared Mahalanobis distance. The covariance of the fit is subtracted for a used profile, because it pulled the
/// fit towards itself, and added for any other.
fn distance2(s: &Solved, item: &Item<'_>, radius: f64, n: &Noise, used: bool) -> f64 {
    let (r, j, _) = row(&s.state, item, radius);
    let own = covariance_of(&s.state, item, radius, n);
    let c: SMatrix<f64, 9, 9> = s.covariance.fixed_view::<9, 9>(0, 0).into();
    let fitted = j * c * j.transpose();
    let total = if used { own - fitted } else { own + fitted };
    let solve = |m: Mat3| m.cholesky().map(|c| r.dot(&c.solve(&r)));
    solve(total).or_else(|| solve(own)).unwrap_or(f64::INFINITY)
}
