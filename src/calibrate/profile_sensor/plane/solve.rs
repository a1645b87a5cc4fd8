//! In: profiles of a flat plate by a line-profile sensor, and the robot's poses. Out: the sensor's pose on the flange
//! and the plate's plane by maximum likelihood, or what the profiles do not determine.
//! Frame and unit: flange_from_sensor, plane in the base frame; mm, rad (docs/math.md, Plate).

use super::average::{self, average};
use super::line::{Line, lines};
use super::next::{Information, advice, information, next};
use super::options::PlaneOptions;
use super::rows::{Plate, State, rms};
use super::start::starts;
use super::weak::{Limit, cause};
use crate::calibrate::profile_sensor::found::{ProfileResidual, SensorFit};
use crate::calibrate::profile_sensor::likelihood::{Item, Noise, Target, distance2, fit, misfit, nearest};
use crate::calibrate::profile_sensor::ranges::enough;
use crate::calibrate::profile_sensor::selection::{Data, Solution};
use crate::calibrate::scatter::beside;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Mat3, Plane, Rigid, Vec3, log};
use crate::recording::profiles::Profile;
use crate::solve::Loss;
use nalgebra::{DMatrix, Vector2, Vector6};

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct PlaneFit {
    /// The sensor's pose and how well the profiles agree on it.
    pub fit: SensorFit,
    /// The plate; its normal points to the side that the sensor looks from.
    pub plane: Plane<Base>,
    /// Sigma of the robot's orientation, estimated from the plate, per axis, rad.
    pub robot_turn: f64,
    /// Angle between the sensor's z axis and the plate's normal, rad, by profile.
    pub tilts: Vec<f64>,
    /// Excess misfit of the next best solution (squared Mahalanobis distance). Infinite if there is none.
    pub margin: f64,
    /// Poses of further profiles that lower the expected error most, in words: the end of a sentence.
    pub next: String,
}

/// The robot's noise at a start: 0.3 mm and 0.2 degrees.
const ROUGH: [f64; 2] = [0.3, 0.0035];
/// The robot's noise before it is estimated: 0.05 mm and 0.02 degrees.
const USUAL: [f64; 2] = [0.05, 0.00035];
/// Scatter of the robot's position beyond which something else is wrong, mm.
const STRANGE_MM: f64 = 1.0;
/// Profiles that the robot's noise is estimated from while some are still excluded: they tell it to 7 %.
const MOST: usize = 100;
/// Rounds in which a profile may change to another of its lines.
const ROUNDS: usize = 4;
/// Solutions closer than this are one (squared Mahalanobis distance, 6 degrees of freedom).
const SAME: f64 = 100.0;

type Profiles<'a> = Data<'a, 2, Plate>;

/// What is given: profiles with their lines, poses, settings.
struct Scene<'a> {
    profiles: &'a [Profile],
    /// The lines of each profile, or why it has none.
    lines: Vec<std::result::Result<Vec<Line>, String>>,
    /// The profiles that have lines.
    shown: Vec<usize>,
    /// Their poses about `centre`: far from it normal and offset of the plate would be hard to tell apart.
    near: Vec<Rigid<Base, Flange>>,
    centre: Vec3,
    o: &'a PlaneOptions,
}

impl<'a> Scene<'a> {
    fn new(profiles: &'a [Profile], poses: &[Rigid<Base, Flange>], o: &'a PlaneOptions) -> Scene<'a> {
        let lines: Vec<_> = profiles.iter().map(|p| lines(p, o)).collect();
        let shown: Vec<usize> = (0..lines.len()).filter(|&i| lines[i].is_ok()).collect();
        let centre = poses.iter().map(|p| p.translation).sum::<Vec3>() / poses.len() as f64;
        let near = shown.iter().map(|&i| Rigid::new(poses[i].rotation, poses[i].translation - centre)).collect();
        Scene { profiles, lines, shown, near, centre, o }
    }

    /// The lines of each profile that has some.
    fn shown_lines(&self) -> impl Iterator<Item = &Vec<Line>> {
        self.lines.iter().flatten()
    }

    /// The chosen line of each profile that has some.
    fn data(&self, choice: &[usize]) -> Profiles<'_> {
        let chosen = self.shown_lines().zip(choice).zip(&self.near);
        let items = chosen.map(|((lines, &c), pose)| Item { measured: &lines[c], pose }).collect();
        Data { target: &Plate, items, gate: self.o.gate, least: self.o.min_profiles, most: MOST }
    }

    /// The line of each profile that a state predicts best.
    fn nearest_lines(&self, s: &State) -> Vec<usize> {
        self.shown_lines().zip(&self.near).map(|(lines, pose)| nearest_line(lines, pose, s)).collect()
    }

    /// Names of items.
    fn names(&self, items: impl Iterator<Item = usize>) -> Vec<&str> {
        items.map(|k| self.profiles[self.shown[k]].name.as_str()).collect()
    }

    /// The item of a profile, or why it has none.
    fn item(&self, profile: usize) -> std::result::Result<usize, &str> {
        match &self.lines[profile] {
            Ok(_) => Ok(self.shown.partition_point(|&i| i < profile)),
            Err(why) => Err(why),
        }
    }
}

/// Solves for the sensor on the flange and the plate in the base frame. Profile i belongs to pose i.
pub fn solve(profiles: &[Profile], poses: &[Rigid<Base, Flange>], o: &PlaneOptions) -> Result<PlaneFit> {
    o.check()?;
    enough(profiles, poses, o.min_profiles, "plate")?;
    let scene = Scene::new(profiles, poses, o);
    if scene.shown.len() < o.min_profiles {
        return Err(few_lines(&scene));
    }
    let mut choice = vec![0; scene.shown.len()];
    let minima = minima(&scene.data(&choice))?;
    let mut state = minima[0];
    choice = scene.nearest_lines(&state);
    let mut rounds = 0;
    loop {
        let data = scene.data(&choice);
        let Some(solution) = from(&data, &state) else {
            return Err(undetermined(&data.items, &scene.names(0..data.items.len()), &state, &usual(&data.items)));
        };
        state = solution.solved.state;
        let better = scene.nearest_lines(&state);
        rounds += 1;
        // A wrong profile may change between two of its lines for ever.
        if better == choice || rounds == ROUNDS {
            return finished(&scene, &data, solution, &minima[1..]);
        }
        choice = better;
    }
}

/// The minima from all starts, the best first; at least one.
fn minima(data: &Profiles<'_>) -> Result<Vec<State>> {
    let rough = Noise { point: point_sigma(&data.items), robot: ROUGH.to_vec() };
    let mut minima: Vec<(f64, State)> = starts(&data.items)
        .iter()
        .filter_map(|s| nearest(&Plate, &data.items, s, &rough, Loss::Cauchy(2.0)))
        .map(|(s, _)| (misfit(&Plate, &data.items, &s.state, &rough, data.gate), s.state))
        .collect();
    minima.sort_by(|a, b| a.0.total_cmp(&b.0));
    if minima.is_empty() {
        return Err(Fault::refused("no plane agrees with the profiles")
            .cause("the profiles show no plate, or profiles and poses do not belong together")
            .next("check the order of the poses and their convention"));
    }
    Ok(minima.into_iter().map(|m| m.1).collect())
}

/// The noise before the robot's is estimated.
fn usual(items: &[Item<'_, Line>]) -> Noise {
    Noise { point: point_sigma(items), robot: USUAL.to_vec() }
}

/// The solution near a state, first of the profiles that do not stand out there. `None` where nothing is determined.
fn from(data: &Profiles<'_>, state: &State) -> Option<Solution<State>> {
    let noise = usual(&data.items);
    let solved = fit(&Plate, &data.items, state, &noise, Loss::Cauchy(2.0))?;
    let all: Vec<f64> = data.items.iter().map(|i| distance2(&Plate, &solved, i, &noise, true)).collect();
    // Wrong profiles among them would raise the estimate of the robot's noise until none stands out.
    let near: Vec<usize> =
        beside(&all, |_| true).iter().enumerate().filter(|d| *d.1 <= data.gate).map(|d| d.0).collect();
    let used = if near.len() < data.least { (0..all.len()).collect() } else { near };
    data.settled(solved, noise, used)
}

/// The line of a profile that a solution predicts best.
fn nearest_line(lines: &[Line], pose: &Rigid<Base, Flange>, s: &State) -> usize {
    let off = |i: &usize| rms(&lines[*i], &Plate.row(s, &Item { measured: &lines[*i], pose }).residual);
    (0..lines.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
}

/// Checks a solution, averages it over the robot's noise, and compares every profile with it.
fn finished(scene: &Scene<'_>, data: &Profiles<'_>, mut s: Solution<State>, others: &[State]) -> Result<PlaneFit> {
    let chosen = data.chosen(s.used.iter().copied());
    let chi2 = s.solved.cost / ((2 * chosen.len()) as f64 - 9.0).max(1.0);
    averaged(&chosen, &mut s);
    let names = scene.names(s.used.iter().copied());
    if !limit(&chosen).holds(&s.solved.covariance) {
        return Err(undetermined(&chosen, &names, &s.solved.state, &s.noise));
    }
    let margin = margin(data, &s, others);
    if margin < scene.o.clear {
        return Err(two_sided(margin, scene.o.clear));
    }
    let state = s.solved.state;
    let next = advice(&next(&chosen, &names, &state, &s.noise, &information(&chosen, &state, &s.noise)));
    let normal = facing(data, &state);
    let plane = Plane::new(normal, normal.dot(&state.normal) * state.offset + normal.dot(&scene.centre));
    let tilt = |item: &Item<'_, Line>| {
        let z = item.pose.rotation * state.x.rotation.column(2);
        z.dot(&state.normal).abs().min(1.0).acos()
    };
    let each = || 0..scene.profiles.len();
    let tilts = each().map(|i| scene.item(i).map_or(f64::NAN, |k| tilt(&data.items[k]))).collect();
    let residuals = each().map(|i| residual(data, &s, scene.item(i), &scene.profiles[i])).collect();
    Ok(PlaneFit {
        plane: plane.expect("a normal of unit length"),
        robot_turn: s.noise.robot[1],
        tilts,
        margin,
        next,
        fit: SensorFit {
            flange_from_sensor: state.x,
            chi2,
            covariance: s.solved.covariance,
            point_sigma: s.noise.point,
            robot_sigma: s.noise.robot[0],
            profiles: residuals,
            end: s.solved.end,
        },
    })
}

/// Replaces state, covariance and robot noise by their means over what the robot's noise may be.
fn averaged(chosen: &[Item<'_, Line>], s: &mut Solution<State>) {
    let variance = s.noise.point * s.noise.point;
    let own = |i: &Item<'_, Line>| Plate.own(i.measured) * variance;
    let profile = |i| average::Profile { row: Plate.row(&s.solved.state, i), own: own(i) };
    let profiles: Vec<_> = chosen.iter().map(profile).collect();
    if let Some(a) = average(&profiles) {
        s.solved.state = Plate.moved(&s.solved.state, a.step.as_slice());
        s.solved.covariance = DMatrix::from_column_slice(9, 9, a.covariance.as_slice());
        s.noise.robot = a.robot.to_vec();
    }
}

/// The unit normal of the side that the sensor looks from.
fn facing(data: &Profiles<'_>, s: &State) -> Vec3 {
    let along: f64 = data.items.iter().map(|i| (i.pose.rotation * s.x.rotation.column(2)).dot(&s.normal)).sum();
    if along > 0.0 { -s.normal } else { s.normal }
}

/// Residuals of one profile in the fit, and in the fit to the others.
fn residual(
    data: &Profiles<'_>,
    s: &Solution<State>,
    item: std::result::Result<usize, &str>,
    profile: &Profile,
) -> ProfileResidual {
    let name = profile.name.clone();
    let i = match item {
        Ok(i) => i,
        Err(why) => {
            let points = [0, profile.points.len()];
            let (mm, holdout_mm, distance2) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
            return ProfileResidual { name, used: false, points, mm, holdout_mm, distance2, why: Some(why.into()) };
        }
    };
    let line = data.items[i].measured;
    let off = |r: Vector2<f64>| rms(line, &r);
    let (with, without) = s.residuals(data, i);
    let used = s.used.contains(&i);
    ProfileResidual {
        name,
        used,
        points: line.points,
        mm: off(with),
        holdout_mm: without.map_or(f64::INFINITY, off),
        distance2: s.distance2(data, i, used),
        why: None,
    }
}

/// Sigma of a profile point about its line, pooled over all profiles, mm.
fn point_sigma(items: &[Item<'_, Line>]) -> f64 {
    let freedom: f64 = items.iter().map(|i| i.measured.points[0] as f64 - 2.0).sum();
    (items.iter().map(|i| i.measured.squares).sum::<f64>() / freedom.max(1.0)).sqrt().max(1e-5)
}

/// A tenth of the line that the profiles show. Beyond that the covariance does not describe the error.
fn limit(items: &[Item<'_, Line>]) -> Limit {
    let mut lengths: Vec<f64> = items.iter().map(|i| i.measured.length).collect();
    lengths.sort_by(f64::total_cmp);
    let length = lengths[lengths.len() / 2];
    Limit { mm: 0.1 * length, lever: length.max(50.0) }
}

/// Excess misfit of the best solution that is another one. Also tried: the sensor turned by half a turn about its y
/// axis and moved to the other side of the flange, which fits as well if the flange keeps its distance along the
/// plate's normal.
fn margin(data: &Profiles<'_>, s: &Solution<State>, others: &[State]) -> f64 {
    let here = s.solved.state;
    let turned = here.x.rotation * Mat3::from_diagonal(&Vec3::new(-1.0, 1.0, -1.0));
    let mirrored = State { x: Rigid::new(turned, -here.x.translation), normal: -here.normal, offset: here.offset };
    let covariance = s.solved.covariance.fixed_view::<6, 6>(0, 0).into_owned();
    let own = misfit(&Plate, &data.items, &here, &s.noise, data.gate);
    let other = |start: &State| {
        let (found, _) = nearest(&Plate, &data.items, start, &s.noise, Loss::Cauchy(2.0))?;
        let (a, b) = (found.state.x, here.x);
        let (d, r) = (a.translation - b.translation, log(&(a.rotation * b.rotation.transpose())));
        let apart = Vector6::new(d.x, d.y, d.z, r.x, r.y, r.z);
        let far = apart.dot(&covariance.cholesky()?.solve(&apart)) > SAME;
        far.then(|| misfit(&Plate, &data.items, &found.state, &s.noise, data.gate) - own)
    };
    others.iter().chain([&mirrored]).filter_map(other).fold(f64::INFINITY, f64::min)
}

fn two_sided(margin: f64, needed: f64) -> Fault {
    Fault::refused(format!(
        "two poses of the sensor fit these profiles: the second fits worse by {margin:.1} only, {needed} are needed"
    ))
    .cause(
        "the flange kept its distance along the plate's normal, or the profiles are too few: then the sensor turned \
         by half a turn about its y axis sees the same",
    )
    .next("add profiles with the flange 20 mm and more nearer to the plate and farther from it")
}

fn few_lines(scene: &Scene<'_>) -> Fault {
    let each = scene.profiles.iter().zip(&scene.lines);
    let first = each.filter_map(|(p, l)| Some(format!("{}: {}", p.name, l.as_ref().err()?))).next();
    Fault::refused(format!(
        "{} of {} profiles show a straight line, {} are needed; {}",
        scene.shown.len(),
        scene.profiles.len(),
        scene.o.min_profiles,
        first.unwrap_or_default()
    ))
    .cause("the line missed the plate, the plate is not flat, or the profiles are in another unit")
    .next("scan a flat plate, so that most of each line lies on it")
}

/// The refusal of profiles that do not determine the pose: what is open, why, and which profiles are missing.
fn undetermined(items: &[Item<'_, Line>], names: &[&str], s: &State, noise: &Noise) -> Fault {
    // Weak knowledge, so that what is open has a large sigma and not none: 1 m, 1 rad.
    let weak = [1e-6, 1e-6, 1e-6, 1.0, 1.0, 1.0, 1.0, 1.0, 1e-6];
    let known = information(items, s, noise) + Information::from_diagonal(&weak.into());
    let open = known.try_inverse().map(|c| DMatrix::from_column_slice(9, 9, c.as_slice()));
    let open = open.map(|c| limit(items).beyond(&c)).filter(|w| !w.is_empty());
    let normals: Vec<Vec3> = items.iter().map(|i| i.pose.rotation.transpose() * s.normal).collect();
    let next = next(items, names, s, noise, &known);
    let open = open.map_or_else(String::new, |w| format!(": not {w}"));
    if noise.robot[0] > STRANGE_MM {
        return Fault::refused(format!("the profiles agree on one plate to {:.1} mm only{open}", noise.robot[0]))
            .cause("profiles and poses do not belong together, the poses are in another convention, or the plate moved")
            .next("check the order of the profiles, and the convention and unit of the poses");
    }
    Fault::refused(format!("the sensor's pose on the flange is not determined by these profiles{open}"))
        .cause(cause(&normals))
        .next(format!("tilt the sensor against the plate by angles of several sizes about two axes{}", advice(&next)))
}
