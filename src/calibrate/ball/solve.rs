//! In: profiles of a ball seen by a line-profile sensor, and the robot's poses. Out: the sensor's pose
//! on the flange and the ball's centre by maximum likelihood, the ball's side of the profile plane known.
//! Frame and unit: flange_from_sensor, ball in the base frame; mm, rad (docs/math.md, Ball (1) to (6)).

use super::circle::{Circle, circle};
use super::options::{BallOptions, Side};
use super::profile::Profile;
use crate::calibrate::components::Components;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, LeftStep, Mat3, Rigid, Sensor, Vec3, orthonormalise, skew};
use crate::solve::{LmOptions, Loss, Problem, Residuals, Stop, lm};
use nalgebra::{DMatrix, DVector, SMatrix};

/// How one profile fits.
#[derive(Clone, Debug)]
pub struct ProfileResidual {
    /// Of the profile.
    pub name: String,
    /// In the fit; false: it disagreed and was left out.
    pub used: bool,
    /// Points on the ball, and points in the profile.
    pub points: [usize; 2],
    /// Length of the residual of centre and radius, mm.
    pub mm: f64,
    /// The same with the profile left out of the fit, mm; infinite where the others determine nothing.
    pub holdout_mm: f64,
    /// Squared Mahalanobis distance, 3 degrees of freedom.
    pub distance2: f64,
    /// The ball's centre over the profile plane, mm, with its side.
    pub height: f64,
}

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct BallFit {
    /// The sensor on the flange, mm.
    pub flange_from_sensor: Rigid<Flange, Sensor>,
    /// Ball's centre in the base frame, mm.
    pub ball: Vec3,
    /// tx ty tz (mm) rx ry rz (rad, left, flange frame), then the ball's x y z: 9x9.
    pub covariance: DMatrix<f64>,
    /// Sigma of a profile point, mm.
    pub point_sigma: f64,
    /// Sigma of the robot's position as the ball sees it, per axis, mm.
    pub robot_sigma: f64,
    /// On which side of the profile plane the ball's centre lies, in most profiles.
    pub side: Side,
    /// By how much the other side fits worse (squared Mahalanobis distance); infinite where it has no solution.
    pub side_margin: f64,
    /// One a profile, in the order given.
    pub profiles: Vec<ProfileResidual>,
    /// Squared Mahalanobis distances over their degrees of freedom; near 1.
    pub chi2: f64,
}

#[derive(Clone, Copy)]
struct State {
    x: Rigid<Flange, Sensor>,
    ball: Vec3,
}

/// The ball's centre in the sensor frame.
fn in_sensor(s: &State, pose: &Rigid<Base, Flange>) -> Vec3 {
    s.x.inverse().point(&pose.inverse().point(&s.ball))
}

/// Expected circle, and its derivatives by the ball's place in the sensor frame.
fn expected(q: &Vec3, radius: f64) -> (Vec3, Mat3) {
    // Beyond the ball's radius there is no circle; a small one keeps the derivative finite.
    let r = (radius * radius - q.y * q.y).max((0.02 * radius).powi(2)).sqrt();
    (Vec3::new(q.x, q.z, r), Mat3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -q.y / r, 0.0))
}

struct Item<'a> {
    circle: &'a Circle,
    pose: &'a Rigid<Base, Flange>,
}

/// Residual and derivatives by the nine unknowns.
fn row(s: &State, item: &Item<'_>, radius: f64) -> (Vec3, SMatrix<f64, 3, 9>, Mat3) {
    let q = in_sensor(s, item.pose);
    let (c, by_q) = expected(&q, radius);
    let (rx, rb) = (s.x.rotation.transpose(), item.pose.rotation.transpose());
    // q = R_Xᵀ(R_Bᵀ(p − t_B) − t_X); a left turn r of R_X turns what is in brackets by −r.
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

struct Noise {
    point: f64,
    robot: f64,
}

fn covariance_of(s: &State, item: &Item<'_>, radius: f64, n: &Noise) -> Mat3 {
    let (_, _, by_q) = row(s, item, radius);
    let own = item.circle.information.try_inverse().unwrap_or_else(|| Mat3::identity() * 1e6) * (n.point * n.point);
    own + by_q * by_q.transpose() * (n.robot * n.robot)
}

type Solved = (State, DMatrix<f64>, f64);

fn fit(items: &[Item<'_>], start: &State, radius: f64, n: &Noise, loss: Loss) -> Option<Solved> {
    let whiteners = items
        .iter()
        .map(|i| covariance_of(start, i, radius, n).cholesky()?.l().try_inverse())
        .collect::<Option<Vec<_>>>()?;
    let s = lm(&Fit { items, whiteners, radius }, *start, &LmOptions { loss, ..Default::default() });
    (s.stop != Stop::BadStart).then_some(())?;
    let cost = s.lengths.iter().map(|l| l * l).sum();
    Some((s.state, s.covariance?, cost))
}

/// One step of the robot's variance component.
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

/// Starts for one side: the sensor's x and z axes, its place and the ball, linear in the circles'
/// centres; the y axis follows from the right hand.
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

/// Majority side of the ball over the profiles.
fn side_of(items: &[Item<'_>], s: &State) -> Side {
    let plus = items.iter().filter(|i| in_sensor(s, i.pose).y > 0.0).count();
    if 2 * plus >= items.len() { Side::Plus } else { Side::Minus }
}

fn undetermined() -> Fault {
    Fault::refused("the sensor's pose on the flange is not determined by these profiles")
        .cause("the flange turned about fewer than two axes, or the ball was always at the same place of the line")
        .next("scan the ball with the flange tilted by 20 degrees and more about two axes, at both ends of the line and at several distances")
}

/// Solves for the sensor on the flange and the ball in the base frame. Profile i belongs to pose i.
pub fn solve(profiles: &[Profile], poses: &[Rigid<Base, Flange>], o: &BallOptions) -> Result<BallFit> {
    o.check()?;
    if profiles.len() != poses.len() {
        return Err(Fault::input(format!("{} profiles and {} poses", profiles.len(), poses.len()))
            .cause("a profile or a pose is missing")
            .next("give one pose a profile, in the same order"));
    }
    if profiles.len() < o.min_profiles {
        return Err(Fault::refused(format!("{} profiles, {} are needed", profiles.len(), o.min_profiles))
            .next("scan the ball from more poses"));
    }
    let radius = o.diameter / 2.0;
    let circles = profiles.iter().map(|p| circle(p, radius, o)).collect::<Result<Vec<_>>>()?;
    let largest = circles.iter().map(|c| c.value.z).fold(0.0, f64::max);
    if largest > 1.02 * radius + o.gate_mm {
        return Err(Fault::input(format!(
            "a profile's circle has a radius of {largest:.3} mm, the ball's is {radius:.3} mm"
        ))
        .cause("the ball's diameter is wrong, or the profiles are in another unit")
        .next("measure the ball and give its diameter in mm"));
    }
    let freedom: f64 = circles.iter().map(|c| c.points[0] as f64 - 3.0).sum();
    let point = (circles.iter().map(|c| c.squares).sum::<f64>() / freedom.max(1.0)).sqrt().max(1e-5);
    let items: Vec<Item<'_>> = circles.iter().zip(poses).map(|(circle, pose)| Item { circle, pose }).collect();
    let solve_side = |side: Side| -> Option<(Side, (Solved, Noise, Vec<usize>))> {
        let rough = Noise { point, robot: 0.5 };
        // A start of one side may end on the other where the ball is seen from both: all are tried for each.
        let best = [Side::Plus, Side::Minus]
            .into_iter()
            .flat_map(|s| starts(&items, radius, s))
            .filter_map(|s| fit(&items, &s, radius, &rough, Loss::Cauchy(2.0)))
            .filter(|s| side_of(&items, &s.0) == side)
            .min_by(|a, b| a.2.total_cmp(&b.2))?;
        let mut used: Vec<usize> = (0..items.len()).collect();
        let mut noise = Noise { point, robot: 0.1 };
        let mut now = best;
        for _ in 0..12 {
            let chosen: Vec<Item<'_>> =
                used.iter().map(|&i| Item { circle: items[i].circle, pose: items[i].pose }).collect();
            for _ in 0..8 {
                now = fit(&chosen, &now.0, radius, &noise, Loss::Squares)?;
                noise.robot = robot_sigma(&chosen, &now.0, radius, &noise)?;
            }
            now = fit(&chosen, &now.0, radius, &noise, Loss::Squares)?;
            let next: Vec<usize> = (0..items.len())
                .filter(|&i| distance2(&now, &items[i], radius, &noise, used.contains(&i)) <= o.gate)
                .collect();
            if next == used || next.len() < o.min_profiles {
                break;
            }
            // One at a time: a wrong profile spoils the others' distances.
            let worst = used.iter().copied().max_by(|&a, &b| {
                let d = |i: usize| distance2(&now, &items[i], radius, &noise, true);
                d(a).total_cmp(&d(b))
            })?;
            if distance2(&now, &items[worst], radius, &noise, true) > o.gate {
                used.retain(|&i| i != worst);
            } else {
                used = next;
            }
        }
        Some((side_of(&items, &now.0), (now, noise, used)))
    };
    let mut both: Vec<(Side, (Solved, Noise, Vec<usize>))> =
        [Side::Plus, Side::Minus].into_iter().filter_map(solve_side).collect();
    // Both sides are judged with the noise of the better one.
    both.sort_by(|a, b| a.1.1.robot.total_cmp(&b.1.1.robot));
    // A ball that is seen as often from one side as from the other: both ways may end in one place.
    both.dedup_by_key(|b| b.0);
    let judged = |s: &Solved, n: &Noise| -> f64 {
        items
            .iter()
            .map(|i| {
                let (r, _, _) = row(&s.0, i, radius);
                covariance_of(&s.0, i, radius, n).cholesky().map_or(f64::INFINITY, |c| r.dot(&c.solve(&r)).min(o.gate))
            })
            .sum()
    };
    let margin = match (both.first(), both.get(1)) {
        (Some(a), Some(b)) => judged(&b.1.0, &a.1.1) - judged(&a.1.0, &a.1.1),
        (Some(_), None) => f64::INFINITY,
        _ => return Err(undetermined()),
    };
    let (side, (now, noise, used)) = match o.side {
        Some(wanted) => {
            let found = both.into_iter().find(|b| b.0 == wanted);
            found.ok_or_else(|| {
                Fault::refused(format!("no solution has the ball on the side that was stated ({wanted:?})"))
                    .cause("the side is counted along the sensor's y axis: y = z × x")
                    .next("check the direction of the sensor's x axis, or leave the side to the data")
            })?
        }
        None if margin < o.clear => {
            return Err(Fault::refused(format!(
                "the data does not tell on which side of the profile plane the ball lies: the other side fits worse by {margin:.1} only, {} are needed",
                o.clear
            ))
            .cause("the profiles all pass near the ball's middle, or the poses are too alike")
            .next("state it with --side plus or --side minus (y = z × x of the sensor), or add poses with other tilts"));
        }
        None => both.swap_remove(0),
    };
    let largest_sigma =
        (0..6).map(|i| now.1[(i, i)].sqrt() * if i < 3 { 1.0 } else { radius.max(50.0) }).fold(0.0, f64::max);
    if !(largest_sigma < 0.2 * radius) {
        return Err(undetermined());
    }
    let residuals = (0..items.len())
        .map(|i| {
            let rest: Vec<Item<'_>> = used
                .iter()
                .filter(|&&k| k != i)
                .map(|&k| Item { circle: items[k].circle, pose: items[k].pose })
                .collect();
            let without = fit(&rest, &now.0, radius, &noise, Loss::Squares);
            ProfileResidual {
                name: profiles[i].name.clone(),
                used: used.contains(&i),
                points: circles[i].points,
                mm: row(&now.0, &items[i], radius).0.norm(),
                holdout_mm: without.map_or(f64::INFINITY, |s| row(&s.0, &items[i], radius).0.norm()),
                distance2: distance2(&now, &items[i], radius, &noise, used.contains(&i)),
                height: in_sensor(&now.0, items[i].pose).y,
            }
        })
        .collect();
    Ok(BallFit {
        flange_from_sensor: now.0.x,
        ball: now.0.ball,
        chi2: now.2 / ((3 * used.len()) as f64 - 9.0).max(1.0),
        covariance: now.1,
        point_sigma: noise.point,
        robot_sigma: noise.robot,
        side,
        side_margin: margin,
        profiles: residuals,
    })
}

fn distance2(s: &Solved, item: &Item<'_>, radius: f64, n: &Noise, used: bool) -> f64 {
    let (r, j, _) = row(&s.0, item, radius);
    let own = covariance_of(&s.0, item, radius, n);
    let c: SMatrix<f64, 9, 9> = s.1.fixed_view::<9, 9>(0, 0).into();
    let fitted = j * c * j.transpose();
    let total = if used { own - fitted } else { own + fitted };
    let solve = |m: Mat3| m.cholesky().map(|c| r.dot(&c.solve(&r)));
    solve(total).or_else(|| solve(own)).unwrap_or(f64::INFINITY)
}
