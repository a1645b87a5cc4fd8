//! In: stripe peaks on boards of measured pose. Out: the plane that most of them lie on, the pictures that agree with
//! it, and a second plane in the remaining peaks.
//! Frame and unit: camera frame, mm; distances from a stripe in px.

use super::options::{LaserPlaneOptions, refused};
use super::terms::{Data, Seen, State, mm_per_px, on_board};
use super::views::StripeView;
use crate::camera::Intrinsics;
use crate::fault::Result;
use crate::geometry::{Board, Camera, Plane, Rigid, Vec3, fit_plane};
use crate::solve::{ConsensusOptions, consensus};

/// A second plane, found in the peaks outside the fit.
#[derive(Clone, Debug)]
pub struct SecondPlane {
    /// Pictures that show the second plane.
    pub views: Vec<String>,
    /// Distance of their peaks from the fitted plane, rms, mm.
    pub mm: f64,
}

/// The plane that most peaks lie on: consensus over triples from different pictures. Distances are in units of the
/// footprint of a pixel at each peak's depth.
pub(in crate::calibrate) fn majority(
    peaks: &[Seen],
    measured: &[Rigid<Camera, Board>],
    camera: &Intrinsics,
    o: &LaserPlaneOptions,
) -> Result<Plane<Camera>> {
    let points: Vec<Vec3> = peaks.iter().map(|s| on_board(&measured[s.view], &s.ray).expect("selected")).collect();
    let pixel_mm = |p: &Vec3| p.z / camera.fx.min(camera.fy);
    let options = ConsensusOptions { threshold: o.gate_px, max_draws: 20000, seed: o.seed, ..Default::default() };
    let found = consensus(
        points.len(),
        3,
        &options,
        |c| {
            let views = [peaks[c[0]].view, peaks[c[1]].view, peaks[c[2]].view];
            if views[0] == views[1] && views[1] == views[2] {
                return None;
            }
            let normal = (points[c[1]] - points[c[0]]).cross(&(points[c[2]] - points[c[0]]));
            let plane = Plane::<Camera>::new(normal, normal.dot(&points[c[0]]))?;
            (normal.norm() > (4.0 * pixel_mm(&points[c[0]])).powi(2)).then_some(plane)
        },
        |plane, i| plane.distance(&points[i]) / pixel_mm(&points[i]),
    )
    .ok_or_else(|| refused("no plane goes through the stripes of several pictures".into()))?;
    let agreeing: Vec<Vec3> = found.inliers.iter().map(|&i| points[i]).collect();
    let plane = fit_plane::<Camera>(&agreeing)
        .ok_or_else(|| refused("the stripes of all pictures lie on one line in space".into()))?
        .0;
    // The normal points away from the camera, as in the examples of the file format.
    Ok(if plane.offset < 0.0 { plane.flipped() } else { plane })
}

pub(in crate::calibrate) fn near(
    p: &Seen,
    plane: &Plane<Camera>,
    measured: &[Rigid<Camera, Board>],
    gate_px: f64,
) -> bool {
    let pose = &measured[p.view];
    on_board(pose, &p.ray).is_some_and(|x| plane.distance(&x).abs() < gate_px * mm_per_px(plane, pose, p))
}

/// Pictures with enough of their stripe near the plane. A reflection beside the stripe does not shorten the agreeing
/// part. The stripe on a board that moved crosses the plane's stripe and agrees only over a short part.
pub(in crate::calibrate) fn agreeing(all: &[Seen], near: &[Seen], views: usize, o: &LaserPlaneOptions) -> Vec<bool> {
    let of = |peaks: &'_ [Seen], v: usize| -> Vec<Seen> { peaks.iter().filter(|p| p.view == v).copied().collect() };
    (0..views)
        .map(|v| {
            let (whole, part) = (of(all, v), of(near, v));
            let along = along_x(&part.iter().collect::<Vec<_>>());
            let (n, k) = (length_px(whole.iter(), along), length_px(part.iter(), along));
            k >= o.min_peaks && k as f64 >= o.min_share * n as f64
        })
        .collect()
}

/// A plane on which the peaks outside the fit agree in three pictures or more.
pub(in crate::calibrate) fn second_plane(
    rest: &[Seen],
    data: &Data,
    state: &State,
    views: &[StripeView],
    camera: &Intrinsics,
    o: &LaserPlaneOptions,
) -> Option<SecondPlane> {
    let lit = |peaks: &[Seen]| (0..views.len()).filter(|v| peaks.iter().any(|p| p.view == *v)).count();
    if rest.len() < 3 * o.min_peaks || lit(rest) < 3 {
        return None;
    }
    let plane = majority(rest, &data.measured, camera, o).ok()?;
    let on_it: Vec<Seen> = rest.iter().filter(|p| near(p, &plane, &data.measured, o.gate_px)).copied().collect();
    let agree = agreeing(rest, &on_it, views.len(), o);
    let names: Vec<String> = views.iter().zip(&agree).filter(|(_, a)| **a).map(|(v, _)| v.pose.name.clone()).collect();
    let off = |p: &Seen| Some(state.plane.distance(&on_board(&data.measured[p.view], &p.ray)?).powi(2));
    let squares: Vec<f64> = on_it.iter().filter(|p| agree[p.view]).filter_map(off).collect();
    let mm = (squares.iter().sum::<f64>() / f64::max(squares.len() as f64, 1.0)).sqrt();
    (names.len() >= 3).then_some(SecondPlane { views: names, mm })
}

/// Length of a stripe as the number of distinct whole pixels along it: several peaks at one position count once.
fn length_px<'a>(peaks: impl Iterator<Item = &'a Seen>, along_x: bool) -> usize {
    let mut places: Vec<i64> = peaks.map(|p| if along_x { p.pixel.x } else { p.pixel.y }.round() as i64).collect();
    places.sort_unstable();
    places.dedup();
    places.len()
}

/// True if the peaks run along the picture's rows rather than its columns.
fn along_x(peaks: &[&Seen]) -> bool {
    let span = |f: fn(&Seen) -> f64| {
        let (a, b) = peaks.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(f(p)), b.max(f(p))));
        b - a
    };
    span(|p| p.pixel.x) >= span(|p| p.pixel.y)
}
