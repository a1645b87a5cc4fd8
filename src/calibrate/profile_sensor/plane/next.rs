//! In: a fit on a plate and what its profiles determine. Out: in words, the poses of further profiles that lower the
//! expected error most.
//! Frame and unit: the sensor's frame; mm, degrees (docs/math.md, Plate (9)).

use super::line::Line;
use super::rows::{Plate, State, raised};
use crate::calibrate::profile_sensor::likelihood::{Item, Noise, Target, UNKNOWNS, covariance_of};
use crate::geometry::{Base, Flange, LeftStep, Rigid, Sensor, Vec2, Vec3, exp};
use nalgebra::SMatrix;

/// Turns of the sensor about its x and y axes that are tried, degrees.
const TURNS: [f64; 3] = [-35.0, 0.0, 35.0];
/// Largest angle between the sensor's z axis and the plate's normal that is proposed, degrees.
const STEEPEST: f64 = 55.0;
/// Distance of near and far at least, as a share of the line's length.
const DEPTH: f64 = 0.25;
/// Number of poses that are named.
const NAMED: usize = 2;

/// Information about the unknowns: the inverse of their covariance.
pub type Information = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// What profiles tell about the unknowns.
pub fn information(items: &[Item<'_, Line>], s: &State, noise: &Noise) -> Information {
    items.iter().filter_map(|item| told(item, s, noise)).sum()
}

fn told(item: &Item<'_, Line>, s: &State, noise: &Noise) -> Option<Information> {
    let by = Plate.row(s, item).by;
    Some(by.transpose() * covariance_of(&Plate, s, item, noise).try_inverse()? * by)
}

/// A pose that is not taken yet, in words, and what a profile from it would tell.
struct Candidate {
    words: String,
    told: Information,
}

/// The poses in words, the best first, as the end of a sentence; empty where there is none.
pub fn advice(poses: &[String]) -> String {
    poses.iter().map(|p| format!("; add {p}")).collect()
}

/// The poses in words, the best first. `names`: of the profiles.
pub fn next(items: &[Item<'_, Line>], names: &[&str], s: &State, noise: &Noise, known: &Information) -> Vec<String> {
    let upright = |i: &usize| (items[*i].pose.rotation * s.x.rotation.column(2)).dot(&s.normal).abs();
    let Some(from) = (0..items.len()).max_by(|a, b| upright(a).total_cmp(&upright(b))) else { return Vec::new() };
    let usual = usual(items);
    let depths = depths(items, usual.length);
    let field: Vec<Vec3> =
        [-0.5, 0.5].iter().flat_map(|x| depths.map(|z| s.x.rotation * Vec3::new(x * usual.length, 0.0, z))).collect();
    let error = |known: &Information| -> f64 {
        let Some(c) = known.try_inverse() else { return f64::INFINITY };
        let c = c.fixed_view::<6, 6>(0, 0);
        let one = |p: &Vec3| (LeftStep::lever(p) * c * LeftStep::lever(p).transpose()).trace();
        field.iter().map(one).sum()
    };
    let candidates = candidates(&items[from], names[from], s, noise, &usual, depths);
    let mut known = *known;
    let mut out: Vec<String> = Vec::new();
    for _ in 0..NAMED {
        let after = |c: &Candidate| error(&(known + c.told));
        let left = candidates.iter().filter(|c| !out.contains(&c.words));
        let Some(best) = left.min_by(|a, b| after(a).total_cmp(&after(b))) else { break };
        known += best.told;
        out.push(best.words.clone());
    }
    out
}

/// A line as the profiles show it on average.
fn usual(items: &[Item<'_, Line>]) -> Line {
    let mean = |of: &dyn Fn(&Line) -> f64| items.iter().map(|i| of(i.measured)).sum::<f64>() / items.len() as f64;
    Line {
        weight: mean(&|l| l.weight),
        spread: mean(&|l| l.spread),
        length: mean(&|l| l.length),
        ..items[0].measured.clone()
    }
}

/// The nearest and the farthest z of a line's middle; some distance apart even if the profiles are not.
fn depths(items: &[Item<'_, Line>], length: f64) -> [f64; 2] {
    let z = || items.iter().map(|i| i.measured.middle.y);
    let (near, far) = (z().fold(f64::INFINITY, f64::min), z().fold(f64::NEG_INFINITY, f64::max));
    let more = (0.5 * (DEPTH * length - (far - near))).max(0.0);
    [near - more, far + more]
}

/// The sensor as in one profile, turned about its own axes, the same place of the plate in the middle of its line.
fn candidates(
    from: &Item<'_, Line>,
    name: &str,
    s: &State,
    noise: &Noise,
    usual: &Line,
    depths: [f64; 2],
) -> Vec<Candidate> {
    let base_from_sensor: Rigid<Base, Sensor> = *from.pose * s.x;
    let seen = base_from_sensor.point(&raised(&from.measured.middle));
    // On the plate, although the profile is off by its noise.
    let place = seen - s.normal * (s.normal.dot(&seen) - s.offset);
    let mut out = Vec::new();
    for about_x in TURNS {
        for about_y in TURNS {
            let turn =
                exp(&Vec3::new(about_x.to_radians(), 0.0, 0.0)) * exp(&Vec3::new(0.0, about_y.to_radians(), 0.0));
            let rotation = base_from_sensor.rotation * turn;
            let m = rotation.transpose() * s.normal;
            if m.z.abs() < STEEPEST.to_radians().cos() {
                continue;
            }
            for z in depths {
                let middle = Vec2::new(0.0, z);
                let sensor: Rigid<Base, Sensor> = Rigid::new(rotation, place - rotation * raised(&middle));
                let pose: Rigid<Base, Flange> = sensor * s.x.inverse();
                let line = Line { middle, along: Vec2::new(m.z, -m.x).normalize(), ..usual.clone() };
                let Some(told) = told(&Item { measured: &line, pose: &pose }, s, noise) else { continue };
                out.push(Candidate { words: words(name, about_x, about_y, z), told });
            }
        }
    }
    out
}

fn words(name: &str, about_x: f64, about_y: f64, z: f64) -> String {
    let turns: Vec<String> = [(about_x, "x"), (about_y, "y")]
        .iter()
        .filter(|t| t.0 != 0.0)
        .map(|(deg, axis)| format!("by {deg:+.0} degrees about its {axis} axis"))
        .collect();
    let turned = if turns.is_empty() { "not turned".into() } else { format!("turned {}", turns.join(" and then ")) };
    format!("a profile with the sensor as in '{name}' but {turned}, the plate at z = {z:.0} mm")
}
