//! In: profiles of a plate, robot poses, and a sensor's pose on the flange from another source. Out: how well the
//! profiles agree on one plane with that pose; only the plane is fitted.
//! Frame and unit: flange_from_sensor, plane in the base frame; mm.

use super::line::{Line, lines};
use super::options::PlaneOptions;
use super::rows::{across, raised};
use crate::calibrate::profile_sensor::ranges::paired;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Mat3, Plane, Rigid, Sensor, Vec3};
use crate::recording::profiles::Profile;
use crate::solve::{LmOptions, Loss, Problem, Residuals, lm};

/// Smallest rms extent of the points across their longest direction, as a share of that along it.
const FLAT: f64 = 0.02;

/// What [`evaluate`] found.
#[derive(Clone, Debug, serde::Serialize)]
pub struct PlaneEvaluation {
    /// The plane that fits the profiles' points best, base frame; its normal points to the sensor.
    pub plane: Plane<Base>,
    /// Distance of the plate's points from that plane: rms over all points, mm.
    #[serde(rename = "rms_mm")]
    pub rms: f64,
    /// The same rms if each profile had a plane of its own: the noise of the points, mm.
    #[serde(rename = "line_rms_mm")]
    pub line_rms: f64,
    /// One entry per profile: its name, the number of its points on a straight line, the rms of their distances from
    /// the plane, and their mean distance, mm.
    pub profiles: Vec<(String, usize, f64, f64)>,
    /// Profiles that show no straight line, and why.
    pub excluded: Vec<(String, String)>,
}

struct Flat<'a>(&'a [Vec3]);

impl Problem for Flat<'_> {
    /// Normal, and offset.
    type State = (Vec3, f64);
    fn width(&self) -> usize {
        3
    }
    fn moved(&self, s: &Self::State, d: &[f64]) -> Self::State {
        let [a, b] = across(&s.0);
        ((s.0 + a * d[0] + b * d[1]).normalize(), s.1 + d[2])
    }
    fn residuals(&self, s: &Self::State, out: &mut Residuals) -> Option<()> {
        let [a, b] = across(&s.0);
        for p in self.0 {
            out.group(&[s.0.dot(p) - s.1], &[0, 1, 2], &[a.dot(p), b.dot(p), -1.0]);
        }
        Some(())
    }
}

/// Transforms the profiles into the base frame by the given pose and fits the plane. Profile i belongs to pose i.
///
/// # Errors
/// Different numbers of poses and profiles, no profile with a straight line, or points that span no plane.
pub fn evaluate(
    profiles: &[Profile],
    poses: &[Rigid<Base, Flange>],
    flange_from_sensor: &Rigid<Flange, Sensor>,
    o: &PlaneOptions,
) -> Result<PlaneEvaluation> {
    o.check()?;
    paired(profiles, poses)?;
    let (mut seen, mut excluded) = (Vec::new(), Vec::new());
    for (profile, pose) in profiles.iter().zip(poses) {
        let base_from_sensor = *pose * *flange_from_sensor;
        match lines(profile, o) {
            Ok(lines) => seen.push((profile.name.clone(), base_from_sensor, lines)),
            Err(why) => excluded.push((profile.name.clone(), why)),
        }
    }
    let undetermined = |what: &str| {
        Fault::refused(format!("the profiles' points do not form a plane with this transform: {what}"))
            .cause("too few profiles, all along one line of the plate, or no plate in view")
            .next("scan the plate at several places")
    };
    if seen.is_empty() {
        return Err(undetermined(&excluded.first().map_or_else(String::new, |(name, why)| format!("{name}: {why}"))));
    }
    let on = |base_from_sensor: &Rigid<Base, Sensor>, line: &Line| -> Vec<Vec3> {
        line.on.iter().map(|q| base_from_sensor.point(&Vec3::new(q[0], 0.0, q[1]))).collect()
    };
    let longest: Vec<Vec3> = seen.iter().flat_map(|(_, x, lines)| on(x, &lines[0])).collect();
    let first = fitted(&longest).map_err(undetermined)?;
    // Most of a profile may lie beside the plate.
    let near = |(_, x, lines): &(String, Rigid<Base, Sensor>, Vec<Line>)| {
        let off = |l: &&Line| first.distance(&x.point(&raised(&l.middle))).abs();
        lines.iter().min_by(|a, b| off(a).total_cmp(&off(b))).cloned()
    };
    let chosen: Vec<Line> = seen.iter().filter_map(near).collect();
    let points: Vec<Vec<Vec3>> = seen.iter().zip(&chosen).map(|((_, x, _), line)| on(x, line)).collect();
    let all: Vec<Vec3> = points.iter().flatten().copied().collect();
    let plane = fitted(&all).map_err(undetermined)?;
    let looks: Vec3 = seen.iter().map(|(_, x, _)| x.rotation.column(2).into_owned()).sum();
    let plane = if looks.dot(&plane.normal) > 0.0 { plane.flipped() } else { plane };
    let mean = |points: &[Vec3], of: &dyn Fn(f64) -> f64| {
        points.iter().map(|p| of(plane.distance(p))).sum::<f64>() / points.len() as f64
    };
    let rms = |points: &[Vec3]| mean(points, &|d| d * d).sqrt();
    let squares: f64 = chosen.iter().map(|l| l.squares).sum();
    Ok(PlaneEvaluation {
        plane,
        rms: rms(&all),
        line_rms: (squares / all.len() as f64).sqrt(),
        profiles: seen
            .iter()
            .zip(&points)
            .map(|((name, ..), p)| (name.clone(), p.len(), rms(p), mean(p, &|d| d)))
            .collect(),
        excluded,
    })
}

/// The plane through points of which some are wrong. The error says why no plane was found.
fn fitted(points: &[Vec3]) -> std::result::Result<Plane<Base>, &'static str> {
    let mean = points.iter().sum::<Vec3>() / points.len() as f64;
    let near: Vec<Vec3> = points.iter().map(|p| p - mean).collect();
    let own = near.iter().map(|p| p * p.transpose()).sum::<Mat3>().symmetric_eigen();
    let (thinnest, wide) = (own.eigenvalues.imin(), own.eigenvalues.imax());
    if thinnest == wide || !(own.eigenvalues[3 - thinnest - wide] > FLAT * FLAT * own.eigenvalues[wide]) {
        return Err("they lie along one line");
    }
    let options = LmOptions { loss: Loss::Huber(2.0), estimate_scale: true, ..LmOptions::default() };
    let start = (own.eigenvectors.column(thinnest).into_owned(), 0.0);
    let found = lm(&Flat(&near), start, &options).so_far().ok_or("no fit")?;
    Plane::new(found.state.0, found.state.1 + found.state.0.dot(&mean)).ok_or("no fit")
}
