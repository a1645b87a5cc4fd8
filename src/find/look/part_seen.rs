//! In: the points of a scan on a part that was measured, the rig. Out: the camera's pose for some of them, and how the
//! part's measured pose and sizes respond when points move.
//! Frame and unit: camera frame and base frame; answers as in `levers`; mm, rad.

use super::levers::{Answer, Lever, Seen, levers, together};
use crate::fault::Result;
use crate::find::measure::options::MeasureOptions;
use crate::find::measure::points::Ordered;
use crate::find::measure::points::localise;
use crate::find::measure::pose::Measured;
use crate::find::measure::shape::shape_row;
use crate::find::model::drawing::Drawing;
use crate::geometry::{Base, Camera, Part, Rigid, Vec3};
use crate::rig::{JointCovariance, Rig};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// Number of shots that are used, number of places in each, and least number of places that a shot must have.
const SHOTS: usize = 24;
const PLACES: usize = 40;
const MIN_PLACES: usize = 20;

/// A part as a rig saw it.
#[derive(Clone, Debug)]
pub struct PartSeen {
    /// The part's measured pose, mm.
    pub base_from_part: Rigid<Base, Part>,
    seen: Vec<Seen>,
    /// Position and normal (x, y, nx, ny) in the part frame of the edges that located the part.
    edges: Vec<[f64; 4]>,
}

impl PartSeen {
    /// `None` where the camera's pose is unknown, or where too few points lie on the part's surfaces.
    pub fn new(points: &Ordered, drawing: &Drawing, measured: &Measured, options: &MeasureOptions) -> Option<PartSeen> {
        let faces = drawing.faces();
        let local = localise(points, drawing, &measured.base_from_part, options);
        let mut shots = std::collections::BTreeMap::<u32, Vec<usize>>::new();
        for (i, q) in local.iter().enumerate() {
            let Some(q) = q else { continue };
            if faces.iter().any(|f| (q.z - f.z).abs() < options.height_gate_mm && f.material(q.x, q.y)) {
                shots.entry(points.row[i]).or_default().push(i);
            }
        }
        let on = shots
            .into_iter()
            .filter(|s| s.1.len() >= MIN_PLACES)
            .flat_map(|(row, on)| on.into_iter().map(move |i| (row, i)));
        let seen = seen_by(points, on).into_iter().map(|s| s.1).collect();
        let edges = measured.observations.iter().filter(|o| o.locates && o.weight > 0.0);
        let edges: Vec<[f64; 4]> = edges.map(|o| [o.x, o.y, o.nx, o.ny]).collect();
        PartSeen::of(measured.base_from_part, seen, edges)
    }

    /// `edges`: x, y and normal in the part frame. `None` without places, or with fewer than four edges.
    pub fn of(base_from_part: Rigid<Base, Part>, seen: Vec<Seen>, edges: Vec<[f64; 4]>) -> Option<PartSeen> {
        (!seen.is_empty() && edges.len() >= 4).then_some(PartSeen { base_from_part, seen, edges })
    }

    /// The camera's pose over the middle of the part.
    pub fn base_from_camera(&self) -> Rigid<Base, Camera> {
        middle(&self.seen, &self.base_from_part.translation).expect("places were asked for")
    }

    /// The part's origin in the frame of that camera.
    pub fn target(&self) -> Vec3 {
        self.base_from_camera().inverse().point(&self.base_from_part.translation)
    }

    /// The direction of the stripe in the part's plane, and the direction from shot to shot, perpendicular to it.
    pub fn scan_axes(&self) -> [SVector<f64, 2>; 2] {
        let camera = self.base_from_camera();
        let into_part = self.base_from_part.rotation.transpose();
        let here: Vec<Vec3> = self
            .seen
            .iter()
            .filter(|s| s.base_from_camera == camera)
            .map(|s| into_part * camera.direction(&s.at))
            .collect();
        let (first, last) = (here[0], here[here.len() - 1]);
        let along = (last - first).xy().normalize();
        [along, SVector::<f64, 2>::new(-along.y, along.x)]
    }

    /// The same part, scanned from another side.
    pub(in crate::find) fn moved(&self, motion: &Rigid<Base, Base>) -> PartSeen {
        let turned = |v: &Vec3| motion.direction(v);
        let seen = self
            .seen
            .iter()
            .map(|s| Seen {
                at: s.at,
                base_from_camera: *motion * s.base_from_camera,
                late: turned(&s.late),
                longer: turned(&s.longer),
            })
            .collect();
        PartSeen { seen, ..self.clone() }
    }

    /// The effect of the rig's errors on the part's pose and sizes, each calibration separately.
    ///
    /// # Errors
    /// A rig with two axes.
    pub fn levers(&self, rig: &Rig) -> Result<Vec<Lever>> {
        levers(&self.seen, rig, self.answer())
    }

    /// Their joint effect: camera, lens, laser plane and hand-eye were calibrated together, and their errors cancel in
    /// part. `None` where the rig lacks one of these.
    pub fn together(&self, rig: &Rig, joint: &JointCovariance) -> Option<Lever> {
        together(&self.seen, rig, joint, self.answer())
    }

    /// How the part's measured pose and sizes respond to displacements of the places, base frame.
    pub fn answer(&self) -> impl Fn(&[Vec3]) -> Answer + '_ {
        let into_part = self.base_from_part.inverse();
        let places: Vec<Vec3> = self.seen.iter().map(|s| into_part.point(&s.base_from_camera.point(&s.at))).collect();
        // Displacements are assumed to change linearly over the part: a constant and a slope along each axis.
        let rows = DMatrix::from_fn(places.len(), 4, |r, c| if c == 0 { 1.0 } else { places[r][c - 1] });
        let even = inverted(&(rows.transpose() * &rows)) * rows.transpose();
        let edge = |shape: bool| {
            let n = if shape { 6 } else { 3 };
            let rows = DMatrix::from_fn(self.edges.len(), n, |r, c| {
                let [x, y, nx, ny] = self.edges[r];
                if c < 3 { [nx, ny, x * ny - y * nx][c] } else { shape_row(x, y, nx, ny)[c - 3] }
            });
            inverted(&(rows.transpose() * &rows)) * rows.transpose()
        };
        let (placed, shaped) = (edge(false), edge(true));
        let to_part = self.base_from_part.rotation.transpose();
        move |moved: &[Vec3]| {
            let u = DMatrix::from_fn(moved.len(), 3, |r, c| (to_part.row(c) * moved[r])[0]);
            let field: SMatrix<f64, 4, 3> = (&even * u).fixed_view::<4, 3>(0, 0).into();
            let across = DVector::from_iterator(
                self.edges.len(),
                self.edges.iter().map(|[x, y, nx, ny]| {
                    let u = field.transpose() * nalgebra::Vector4::new(1.0, *x, *y, 0.0);
                    nx * u.x + ny * u.y
                }),
            );
            let (place, shape) = (&placed * &across, &shaped * &across);
            let shift = self.base_from_part.rotation * Vec3::new(place[0], place[1], field[(0, 2)]);
            let turn = self.base_from_part.rotation * Vec3::new(field[(2, 2)], -field[(1, 2)], place[2]);
            Answer::from_iterator(shift.iter().chain(&turn).chain(shape.rows(3, 3).iter()).copied())
        }
    }
}

/// The camera that saw the place nearest to a point.
pub(in crate::find) fn middle(seen: &[Seen], of: &Vec3) -> Option<Rigid<Base, Camera>> {
    let off = |s: &Seen| (s.base_from_camera.point(&s.at) - of).norm();
    seen.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map(|s| s.base_from_camera)
}

/// How some of a scan's points, given as (row, point) in the order of rows, were seen: at most [`SHOTS`] shots and
/// [`PLACES`] in each. Empty where the camera's pose is unknown, or for fewer than two shots.
pub(in crate::find) fn seen_by(points: &Ordered, on: impl Iterator<Item = (u32, usize)>) -> Vec<(usize, Seen)> {
    let mut shots: Vec<(u32, Vec<usize>)> = Vec::new();
    for (row, i) in on {
        match shots.last_mut() {
            Some(last) if last.0 == row => last.1.push(i),
            _ => shots.push((row, vec![i])),
        }
    }
    let (mut stood, mut places) = (Vec::new(), Vec::new());
    for (row, on) in strided(shots.len(), SHOTS).into_iter().map(|k| &shots[k]) {
        let Some(camera) = points.from_camera[*row as usize] else { continue };
        stood.push((points.shot[*row as usize], camera));
        let back = camera.inverse();
        places.extend(
            strided(on.len(), PLACES).into_iter().map(|k| (stood.len() - 1, on[k], back.point(&points.points[on[k]]))),
        );
    }
    let (Some(first), 2..) = (points.from_camera[0], stood.len()) else { return Vec::new() };
    let travel = travelled(&stood, &first, &places.iter().map(|p| (p.0, p.2)).collect::<Vec<_>>());
    places.iter().map(|p| p.1).zip(travel).collect()
}

/// `stood`: shot number and camera pose; `first`: camera pose of the first shot; `places`: index into `stood`, position
/// in the camera frame.
pub(in crate::find) fn travelled(
    stood: &[(u32, Rigid<Base, Camera>)],
    first: &Rigid<Base, Camera>,
    places: &[(usize, Vec3)],
) -> Vec<Seen> {
    let seen = |&(k, at): &(usize, Vec3)| {
        let (a, b) = (stood[k.saturating_sub(1)], stood[(k + 1).min(stood.len() - 1)]);
        let late = (b.1.point(&at) - a.1.point(&at)) / f64::from(b.0 - a.0).max(1.0);
        let base_from_camera = stood[k].1;
        Seen { at, base_from_camera, late, longer: base_from_camera.translation - first.translation }
    };
    places.iter().map(seen).collect()
}

/// At most `count` indices, spread evenly over `of`.
fn strided(of: usize, count: usize) -> Vec<usize> {
    let n = of.min(count);
    (0..n).map(|i| i * of / n.max(1)).collect()
}

/// The inverse of a normal matrix; directions that it does not determine get no step.
fn inverted(normal: &DMatrix<f64>) -> DMatrix<f64> {
    let n = normal.nrows();
    let ridge = 1e-9 * normal.trace() / n as f64;
    (normal + DMatrix::identity(n, n) * ridge.max(1e-300)).try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n))
}

/// Direction towards the camera during the scan, base frame; `None` where the camera's pose is unknown.
pub fn towards_camera(points: &Ordered) -> Option<Vec3> {
    let middle = points.row[points.row.len() / 2];
    points.from_camera[middle as usize].map(|c| -c.direction(&Vec3::z()))
}
