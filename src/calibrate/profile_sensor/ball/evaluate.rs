//! In: profiles of a ball, robot poses, and a sensor's pose on the flange from another source. Out: how well the
//! profiles agree on one ball with that pose; only the ball's centre is fitted.
//! Frame and unit: flange_from_sensor, ball in the base frame; mm.

use super::circle::circle;
use super::options::BallOptions;
use crate::calibrate::profile_sensor::ranges::paired;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Mat3, Rigid, Sensor, Vec3};
use crate::recording::profiles::Profile;
use crate::solve::{LmOptions, Loss, Problem, Residuals, lm};

/// What [`evaluate`] found.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Evaluation {
    /// The centre that fits the profiles' points best, base frame, mm.
    #[serde(rename = "ball_mm", serialize_with = "as_list")]
    pub ball: Vec3,
    /// Distance of the ball's points from the sphere of the stated diameter: rms over all points, mm.
    #[serde(rename = "rms_mm")]
    pub rms: f64,
    /// The same rms with the diameter fitted too, mm.
    #[serde(rename = "free_rms_mm")]
    pub free_rms: f64,
    /// The diameter that fits the points best, mm.
    #[serde(rename = "free_diameter_mm")]
    pub free_diameter: f64,
    /// One entry per profile: its name, the number of its points on the ball, and the rms of their distances from the
    /// sphere, mm.
    pub profiles: Vec<(String, usize, f64)>,
}

fn as_list<S: serde::Serializer>(v: &Vec3, s: S) -> std::result::Result<S::Ok, S::Error> {
    s.collect_seq(v.iter())
}

/// Points of the ball in the base frame, and the sphere's radius if it is known.
struct Sphere<'a> {
    points: &'a [Vec3],
    radius: Option<f64>,
}

impl Problem for Sphere<'_> {
    type State = (Vec3, f64);
    fn width(&self) -> usize {
        if self.radius.is_some() { 3 } else { 4 }
    }
    fn moved(&self, s: &Self::State, d: &[f64]) -> Self::State {
        (s.0 + Vec3::new(d[0], d[1], d[2]), s.1 + d.get(3).copied().unwrap_or(0.0))
    }
    fn residuals(&self, s: &Self::State, out: &mut Residuals) -> Option<()> {
        for p in self.points {
            let r = s.0 - p;
            let length = r.norm();
            if length < 1e-9 {
                return None;
            }
            let u = r / length;
            match self.radius {
                Some(_) => out.group(&[length - s.1], &[0, 1, 2], &[u.x, u.y, u.z]),
                None => out.group(&[length - s.1], &[0, 1, 2, 3], &[u.x, u.y, u.z, -1.0]),
            }
        }
        Some(())
    }
}

/// Transforms the profiles into the base frame by the given pose and fits the ball. Profile i belongs to pose i.
///
/// # Errors
/// Different numbers of poses and profiles, or a profile without a circle.
pub fn evaluate(
    profiles: &[Profile],
    poses: &[Rigid<Base, Flange>],
    flange_from_sensor: &Rigid<Flange, Sensor>,
    o: &BallOptions,
) -> Result<Evaluation> {
    o.check()?;
    paired(profiles, poses)?;
    let radius = o.diameter / 2.0;
    let mut points = Vec::new();
    let mut of: Vec<(String, std::ops::Range<usize>)> = Vec::new();
    for (profile, pose) in profiles.iter().zip(poses) {
        let on = circle(profile, radius, o)?.on;
        let base_from_sensor = *pose * *flange_from_sensor;
        let start = points.len();
        points.extend(on.iter().map(|q| base_from_sensor.point(&Vec3::new(q[0], 0.0, q[1]))));
        of.push((profile.name.clone(), start..points.len()));
    }
    let undetermined = || {
        Fault::refused("the profiles' points do not form a ball with this transform")
            .cause("too few profiles, or all through one section of the ball")
            .next("scan the ball from more sides")
    };
    let start = centre(&points).ok_or_else(undetermined)?;
    let fit = |radius: Option<f64>| {
        let first = radius.unwrap_or(o.diameter / 2.0);
        let options = LmOptions { loss: Loss::Huber(2.0), estimate_scale: true, ..LmOptions::default() };
        let found = lm(&Sphere { points: &points, radius }, (start, first), &options).minimum()?;
        found.covariance.is_some().then_some(found.state)
    };
    let (ball, _) = fit(Some(radius)).ok_or_else(undetermined)?;
    let (free, free_radius) = fit(None).ok_or_else(undetermined)?;
    let off = |points: &[Vec3], centre: &Vec3, radius: f64| {
        let sum: f64 = points.iter().map(|p| ((p - centre).norm() - radius).powi(2)).sum();
        (sum / points.len().max(1) as f64).sqrt()
    };
    Ok(Evaluation {
        ball,
        rms: off(&points, &ball, radius),
        free_rms: off(&points, &free, free_radius),
        free_diameter: 2.0 * free_radius,
        profiles: of.into_iter().map(|(n, r)| (n, r.len(), off(&points[r.clone()], &ball, radius))).collect(),
    })
}

/// The centre of the sphere through the points, by a fit that is linear in the squares of their coordinates.
fn centre(points: &[Vec3]) -> Option<Vec3> {
    let mean = points.iter().sum::<Vec3>() / points.len() as f64;
    let square = points.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / points.len() as f64;
    let (mut h, mut g) = (Mat3::zeros(), Vec3::zeros());
    for p in points {
        let d = p - mean;
        h += d * d.transpose() * 2.0;
        g += d * (d.norm_squared() - square);
    }
    Some(mean + h.lu().solve(&g)?)
}
