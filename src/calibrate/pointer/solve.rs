//! In: spots of the pointer on boards of measured pose. Out: the beam as a line in the camera frame by maximum
//! likelihood; wrong spots are excluded and named.
//! Frame and unit: camera frame, mm; spots in px (docs/math.md, Pointer (3) to (5)).

use super::beam::{basis, near_line, robust_line};
pub use super::fit::SpotView;
use super::fit::{Solved, by_camera, distance2, fit, spot};
use crate::calibrate::scatter::{beside, inflation, winsorised};
use crate::camera::{CameraCovariance, Intrinsics, PARAMETERS, Parameters};
use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Plane, Ray, Vec3};
use crate::solve::End;
use nalgebra::DMatrix;

/// Settings of [`solve`].
#[derive(Clone, Debug)]
pub struct PointerOptions {
    /// A spot counts as wrong if its squared Mahalanobis distance (2 degrees of freedom), relative to the usual one
    /// of the others, exceeds this; 9..=1000.
    pub gate: f64,
    /// Spots closer than this to the first line are never excluded from it, in footprints of a pixel at the spot;
    /// 0.5..=50.
    pub gate_px: f64,
    /// Smallest number of spots; 3..=1000.
    pub min_spots: usize,
    /// Smallest spread of the spots along the optical axis, as a share of the largest depth; 0.01..=1.
    pub min_spread: f64,
}

impl Default for PointerOptions {
    fn default() -> Self {
        PointerOptions { gate: 20.0, gate_px: 2.0, min_spots: 4, min_spread: 0.05 }
    }
}

impl PointerOptions {
    /// Refuses values outside the ranges stated at the fields.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("gate", self.gate, 9.0, 1000.0),
            ("gate_px", self.gate_px, 0.5, 50.0),
            ("min_spots", self.min_spots as f64, 3.0, 1000.0),
            ("min_spread", self.min_spread, 0.01, 1.0),
        ];
        match ranges.iter().find(|(_, v, low, high)| !(low..=high).contains(&v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("{name} is {v}, {low} to {high} is allowed"))
                    .next("choose a value in that range"))
            }
            None => Ok(()),
        }
    }
}

/// Residuals of one spot.
#[derive(Clone, Debug)]
pub struct SpotResidual {
    /// Name of the picture.
    pub name: String,
    /// True if the spot is in the fit; false if it disagreed and was excluded.
    pub used: bool,
    /// Distance along the optical axis, mm.
    pub depth: f64,
    /// Distance of the spot from the pixel where the beam meets the board, px.
    pub px: f64,
    /// The same distance on the board, mm.
    pub mm: f64,
    /// `px` with the spot excluded from the fit; infinite if the others determine no beam.
    pub holdout_px: f64,
    /// `mm` with the spot excluded from the fit; infinite if the others determine no beam.
    pub holdout_mm: f64,
    /// Squared Mahalanobis distance, 2 degrees of freedom.
    pub distance2: f64,
    /// The same divided by its usual size among these spots, if that is larger than chance explains.
    pub beside: f64,
}

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct PointerFit {
    /// The beam, mm.
    pub beam: Ray<Camera>,
    /// Covariance of ox oy oz (mm) dx dy dz, then of the camera's parameters ([`crate::camera::NAMES`]). The beam was
    /// fitted with this camera, so their errors are correlated.
    pub covariance: DMatrix<f64>,
    /// The 6x6 covariance of the beam with the camera taken as exact.
    pub covariance_camera_exact: DMatrix<f64>,
    /// One entry per view, in the order given.
    pub spots: Vec<SpotResidual>,
    /// Square root of chi² over its degrees of freedom.
    pub sigma_ratio: f64,
    /// Nearest and farthest used spot along the optical axis, mm.
    pub reach: [f64; 2],
    /// An excluded spot and a used one that could be exchanged: the beam through the others fits either equally well.
    pub rivals: Option<[String; 2]>,
    /// Whether the fit is a minimum.
    pub end: End,
}

fn refused(what: String) -> Fault {
    Fault::refused(what)
        .cause("too few spots, or spots too near to each other")
        .next("show the board to the pointer at four or more distances over the whole range that will be used")
}

/// The spots, the intersections of their viewing rays with their boards, and a start line through those.
struct Spots<'a> {
    views: &'a [SpotView],
    camera: &'a Intrinsics,
    /// Corrects the stated sigmas of the boards' features.
    factor: f64,
    points: Vec<Vec3>,
    start: Ray<Camera>,
}

/// A beam through some of the spots.
struct Judged {
    solved: Solved,
    /// Squared Mahalanobis distance of every spot from this beam; a used spot's own influence on the beam is taken
    /// into account.
    distances: Vec<f64>,
    beside: Vec<f64>,
}

fn undetermined() -> Fault {
    refused("the beam is not determined by these spots".into())
}

/// Intersection of each viewing ray with its board, mm.
fn on_boards(views: &[SpotView], camera: &Intrinsics) -> Option<Vec<Vec3>> {
    let met = |v: &SpotView| {
        let normal: Vec3 = v.pose.camera_from_board.rotation.column(2).into();
        let plane = Plane::<Camera>::new(normal, normal.dot(&v.pose.camera_from_board.translation))?;
        camera.ray_from_pixel(&v.pixel)?.meet(&plane)
    };
    views.iter().map(met).collect()
}

impl Spots<'_> {
    fn chosen(&self, used: &[usize]) -> Vec<&SpotView> {
        used.iter().map(|&i| &self.views[i]).collect()
    }

    fn fit_to(&self, used: &[usize]) -> Result<Judged> {
        let solved = fit(&self.chosen(used), self.camera, &Parameters::zeros(), &self.start, self.factor)
            .ok_or_else(undetermined)?;
        let distance = |i| distance2(&self.views[i], self.camera, &solved, used.contains(&i), self.factor);
        let distances: Vec<f64> = (0..self.views.len()).map(distance).collect();
        let beside = beside(&distances, |i| used.contains(&i));
        Ok(Judged { solved, distances, beside })
    }

    /// Spots that lie on one line: starting from `used`, wrong ones leave and right ones return.
    fn agreeing(&self, mut used: Vec<usize>, o: &PointerOptions) -> Result<Vec<usize>> {
        let all = self.views.len();
        for _ in 0..2 * all {
            if used.len() < o.min_spots {
                return Err(refused(format!("only {} of {all} spots lie on one line", used.len())));
            }
            let Judged { distances, beside, .. } = self.fit_to(&used)?;
            // Exclude one spot per round, judged by the beam of the others: a wrong spot also pulls its neighbours
            // off the line.
            let worst = used.iter().copied().max_by(|a, b| distances[*a].total_cmp(&distances[*b])).expect("not empty");
            if distances[worst] > o.gate && used.len() > o.min_spots {
                let rest: Vec<usize> = used.iter().copied().filter(|&i| i != worst).collect();
                if self.fit_to(&rest)?.beside[worst] > o.gate {
                    used = rest;
                    continue;
                }
            }
            let next: Vec<usize> = (0..all).filter(|i| used.contains(i) || beside[*i] <= o.gate).collect();
            if next == used {
                break;
            }
            used = next;
        }
        Ok(used)
    }

    /// A spot outside and one inside the fit that could be exchanged: it is then not known which of them is wrong.
    fn rivals(&self, used: &[usize], cost: f64, scatter2: f64, o: &PointerOptions) -> Option<[String; 2]> {
        let outside = (0..self.views.len()).filter(|i| !used.contains(i));
        let name = |i: usize| self.views[i].pose.name.clone();
        outside.flat_map(|out| used.iter().map(move |&within| (out, within))).find_map(|(out, within)| {
            let others: Vec<usize> = used.iter().copied().filter(|&i| i != within).chain([out]).collect();
            let other = fit(&self.chosen(&others), self.camera, &Parameters::zeros(), &self.start, self.factor)?;
            (other.2 - cost <= o.gate * scatter2.max(1.0)).then(|| [name(out), name(within)])
        })
    }

    /// Smallest and largest depth of these spots, mm.
    fn reach(&self, used: &[usize], o: &PointerOptions) -> Result<[f64; 2]> {
        let along: Vec<f64> = used.iter().map(|&i| self.points[i].z).collect();
        let reach = [along.iter().copied().fold(f64::INFINITY, f64::min), along.iter().copied().fold(0.0, f64::max)];
        if reach[1] - reach[0] < o.min_spread * reach[1] {
            return Err(refused(format!(
                "the spots lie between {:.1} and {:.1} mm: {:.0} % of the distance, {:.0} % are needed",
                reach[0],
                reach[1],
                100.0 * (reach[1] - reach[0]) / reach[1],
                100.0 * o.min_spread
            )));
        }
        Ok(reach)
    }

    /// Distances of a spot's pixel and of its position on the board from a beam, px and mm.
    fn gap(&self, i: usize, beam: &Ray<Camera>) -> (f64, f64) {
        let view = &self.views[i];
        spot(self.camera, beam, &view.pose.camera_from_board)
            .map_or((f64::INFINITY, f64::INFINITY), |(p, q)| ((q - view.pixel).norm(), (p - self.points[i]).norm()))
    }

    /// One entry per view: residuals from the beam, and from the beam of the others.
    fn residuals(&self, used: &[usize], judged: &Judged) -> Vec<SpotResidual> {
        let beam = &judged.solved.0.beam;
        let one = |i: usize| {
            let rest: Vec<usize> = used.iter().copied().filter(|&k| k != i).collect();
            let without = fit(&self.chosen(&rest), self.camera, &Parameters::zeros(), beam, self.factor);
            let (px, mm) = self.gap(i, beam);
            let (holdout_px, holdout_mm) = without.map_or((f64::INFINITY, f64::INFINITY), |s| self.gap(i, &s.0.beam));
            SpotResidual {
                name: self.views[i].pose.name.clone(),
                used: used.contains(&i),
                depth: self.points[i].z,
                px,
                mm,
                holdout_px,
                holdout_mm,
                distance2: judged.distances[i],
                beside: judged.beside[i],
            }
        };
        (0..self.views.len()).map(one).collect()
    }
}

/// Joint covariance of the beam and the camera, from the beam's own covariance and its derivatives by the camera's
/// parameters.
fn with_camera(exact: &DMatrix<f64>, by_camera: &DMatrix<f64>, camera: &CameraCovariance) -> DMatrix<f64> {
    let c = DMatrix::from_column_slice(PARAMETERS, PARAMETERS, camera.matrix().as_slice());
    let mut out = DMatrix::zeros(6 + PARAMETERS, 6 + PARAMETERS);
    out.view_mut((0, 0), (6, 6)).copy_from(&(exact + by_camera * &c * by_camera.transpose()));
    out.view_mut((0, 6), (6, PARAMETERS)).copy_from(&(by_camera * &c));
    out.view_mut((6, 0), (PARAMETERS, 6)).copy_from(&(&c * by_camera.transpose()));
    out.view_mut((6, 6), (PARAMETERS, PARAMETERS)).copy_from(&c);
    out
}

/// Fits the beam. `feature_factor` corrects the stated sigmas of the boards' features
/// ([`crate::calibrate::measured_pose::pooled_factor`]). `camera_covariance` is the covariance of the camera's
/// parameters.
pub fn solve(
    views: &[SpotView],
    camera: &Intrinsics,
    camera_covariance: &CameraCovariance,
    feature_factor: f64,
    o: &PointerOptions,
) -> Result<PointerFit> {
    o.check()?;
    if views.len() < o.min_spots {
        return Err(refused(format!("{} spots on boards, {} are needed", views.len(), o.min_spots)));
    }
    let points =
        on_boards(views, camera).ok_or_else(|| refused("a spot's viewing ray does not meet its board".into()))?;
    // Gate at each spot, `gate_px` times the footprint of a pixel, mm.
    let pixel_mm: Vec<f64> = points.iter().map(|p| o.gate_px * p.z / camera.fx.min(camera.fy)).collect();
    let start = robust_line(&points, &pixel_mm).ok_or_else(|| refused("the spots are all in one place".into()))?;
    // Total least squares in space weights distant spots wrongly; the fit in pixels starts from it.
    let near = near_line(&points, &pixel_mm, &start);
    let spots = Spots { views, camera, factor: feature_factor, points, start };
    let used = spots.agreeing(near, o)?;
    let judged = spots.fit_to(&used)?;
    let reach = spots.reach(&used, o)?;
    let (state, local, cost, end) = &judged.solved;
    let freedom = (2 * used.len()) as f64 - 4.0;
    let sigma_ratio = (cost / freedom.max(1.0)).sqrt();
    let scatter2 = winsorised(sigma_ratio * sigma_ratio, freedom, views.len() - used.len());
    let exact = {
        let j = basis(&state.beam);
        &j * local.view((0, 0), (4, 4)) * j.transpose() * inflation(scatter2, freedom)
    };
    let by_camera = by_camera(&spots.chosen(&used), camera, state, &camera_covariance.named(), feature_factor)
        .ok_or_else(undetermined)?;
    Ok(PointerFit {
        beam: state.beam,
        covariance: with_camera(&exact, &by_camera, camera_covariance),
        covariance_camera_exact: exact,
        spots: spots.residuals(&used, &judged),
        sigma_ratio,
        reach,
        rivals: spots.rivals(&used, *cost, sigma_ratio * sigma_ratio, o),
        end: *end,
    })
}
