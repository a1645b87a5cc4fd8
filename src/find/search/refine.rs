//! In: a pose found by search, a shape model, slope fields of the finest level. Out: the pose by least
//! squares over distances to edges, with covariance (docs/math.md, Shape matching (3) and (4)).
//! Frame and unit: pixels of level 0, radians, scale as a factor.

use super::options::Free;
use crate::find::model::gradient::Field;
use crate::find::model::shape_model::{ModelPoint, ShapeModel, ridge_offset};
use crate::find::scene::Kind;
use nalgebra::{Matrix4, Vector4};

/// Position of the model's reference point in the scene, its turn (x towards y) and its scale.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pose {
    /// Column of the reference point, px.
    pub x: f64,
    /// Row of the reference point, px.
    pub y: f64,
    /// Turn, x towards y, rad.
    pub angle: f64,
    /// Factor on the model's size.
    pub scale: f64,
}

impl Pose {
    /// A model point and its direction in the scene.
    pub fn place(&self, p: &ModelPoint) -> (f64, f64, f64, f64) {
        let (s, c) = self.angle.sin_cos();
        (
            self.x + self.scale * (c * p.x - s * p.y),
            self.y + self.scale * (s * p.x + c * p.y),
            c * p.gx - s * p.gy,
            s * p.gx + c * p.gy,
        )
    }
    /// A place of the model in the scene, px.
    pub fn point(&self, x: f64, y: f64) -> (f64, f64) {
        let (s, c) = self.angle.sin_cos();
        (self.x + self.scale * (c * x - s * y), self.y + self.scale * (s * x + c * y))
    }
}

/// A refined pose.
#[derive(Clone, Copy, Debug)]
pub struct Refined {
    /// The least-squares pose, in px of the scene and rad.
    pub pose: Pose,
    /// Covariance over x px, y px, angle rad, scale.
    pub covariance: Matrix4<f64>,
    /// Number of edges that were used.
    pub used: usize,
    /// Robust standard deviation of the distances, px.
    pub rms_px: f64,
}

/// Largest distance along its normal at which an edge is searched, px.
const REACH: i64 = 3;
/// Residuals beyond this many robust sigmas have no weight (Tukey).
const TUKEY: f64 = 4.0;
/// Lower limit of sigma: the interpolation error of one edge, px.
const FLOOR_PX: f64 = 0.02;

/// Refines by at most `rounds` rounds of matching and solving. `None` where fewer edges than twice the unknowns remain,
/// or the geometry leaves a motion undetermined.
pub fn refine(
    fields: &[(Kind, &Field, f32)],
    model: &ShapeModel,
    start: Pose,
    free: Free,
    ignore_polarity: bool,
    rounds: usize,
) -> Option<Refined> {
    let points = &model.levels[0];
    let mut pose = start;
    let mut last = None;
    for _ in 0..rounds {
        let rows: Vec<(Vector4<f64>, f64)> =
            points.iter().filter_map(|p| row(fields, p, &pose, ignore_polarity)).collect();
        let unknowns = 2 + usize::from(free.angle) + usize::from(free.scale);
        if rows.len() < 2 * unknowns {
            return None;
        }
        let (step, covariance, sigma) = solve(&rows, free)?;
        // Edges were searched within REACH. A longer step is an extrapolation along a motion that few edges constrain,
        // as where a shadow hides the edges across it. The next round searches from the shortened step.
        let longest = step.x.hypot(step.y) + model.radius * (step.z.abs() + step.w.abs());
        let step = step * (REACH as f64 / longest).min(1.0);
        pose.x += step.x;
        pose.y += step.y;
        pose.angle += step.z;
        pose.scale *= 1.0 + step.w;
        last = Some(Refined { pose, covariance: covariance * model.redundancy, used: rows.len(), rms_px: sigma });
        if step.x.abs() + step.y.abs() + model.radius * (step.z.abs() + step.w.abs()) < 1e-3 {
            break;
        }
    }
    last
}

/// Distance along the normal to the edge, and its derivative by x, y, angle and log scale.
fn row(fields: &[(Kind, &Field, f32)], p: &ModelPoint, pose: &Pose, ignore: bool) -> Option<(Vector4<f64>, f64)> {
    let (_, field, threshold) = fields.iter().find(|f| f.0 == p.kind)?;
    let (x, y, nx, ny) = pose.place(p);
    let mut along = [f64::NAN; 2 * REACH as usize + 1];
    for (v, s) in along.iter_mut().zip(-REACH..=REACH) {
        if let Some((gx, gy)) = field.at(x + s as f64 * nx, y + s as f64 * ny) {
            let g = gx * nx + gy * ny;
            *v = if ignore || p.either { g.abs() } else { g };
        }
    }
    // The ridge nearest to the model point is used, so that parallel edges do not attract.
    let mut best: Option<f64> = None;
    for i in 1..along.len() - 1 {
        if along[i] > f64::from(*threshold)
            && let Some(o) = ridge_offset(along[i - 1], along[i], along[i + 1])
        {
            let d = i as f64 - REACH as f64 + o;
            if best.is_none_or(|b| d.abs() < b.abs()) {
                best = Some(d);
            }
        }
    }
    let d = best?;
    let (rx, ry) = (x - pose.x, y - pose.y);
    Some((Vector4::new(nx, ny, rx * ny - ry * nx, rx * nx + ry * ny), d))
}

/// Tukey-weighted least squares; the step, the covariance and the robust sigma.
fn solve(rows: &[(Vector4<f64>, f64)], free: Free) -> Option<(Vector4<f64>, Matrix4<f64>, f64)> {
    let held = [false, false, !free.angle, !free.scale];
    let held = || (0..4).filter(move |&k| held[k]);
    let mut step = Vector4::zeros();
    let mut sigma = 1.0f64;
    let mut inverse = Matrix4::zeros();
    for round in 0..6 {
        let mut residuals: Vec<f64> = rows.iter().map(|(j, d)| (d - j.dot(&step)).abs()).collect();
        let middle = residuals.len() / 2;
        sigma = (1.4826 * *residuals.select_nth_unstable_by(middle, f64::total_cmp).1).max(FLOOR_PX);
        let (mut a, mut b, mut weight) = (Matrix4::zeros(), Vector4::zeros(), 0.0);
        for (j, d) in rows {
            let u = (d - j.dot(&step)) / (TUKEY * sigma);
            let w = if round == 0 { 1.0 } else { (1.0 - u * u).max(0.0).powi(2) };
            a += w * j * j.transpose();
            b += w * d * j;
            weight += w;
        }
        if weight < 6.0 {
            return None;
        }
        for k in held() {
            a.row_mut(k).fill(0.0);
            a.column_mut(k).fill(0.0);
            a[(k, k)] = 1.0;
            b[k] = 0.0;
        }
        // After scaling to unit diagonal, an undetermined motion shows as a tiny eigenvalue.
        let scale = Vector4::from_fn(|k, _| a[(k, k)].max(1e-300).sqrt().recip());
        let unit = Matrix4::from_fn(|i, k| a[(i, k)] * scale[i] * scale[k]);
        if unit.symmetric_eigenvalues().min() < 1e-6 {
            return None;
        }
        let inv = unit.try_inverse()?;
        inverse = Matrix4::from_fn(|i, k| inv[(i, k)] * scale[i] * scale[k]);
        step = inverse * b;
    }
    let mut covariance = inverse * (sigma * sigma);
    for k in held() {
        covariance.row_mut(k).fill(0.0);
        covariance.column_mut(k).fill(0.0);
    }
    Some((step, covariance, sigma))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::model::drawing::Drawing;
    use crate::find::model::gradient::slopes;
    use crate::find::model::shape_model::ModelOptions;
    use crate::find::scene::Layer;

    /// A plate, half a cell narrower than drawn, whose upper and lower edges lie in shadow. Only its nearly parallel
    /// sides constrain it along them, and these would meet their edges 20 px away.
    #[test]
    fn a_step_is_never_longer_than_edges_were_looked_for() {
        let drawing =
            Drawing::parse("[[shape]]\nkind = \"polygon\"\npoints = [[-19, -20], [19, -20], [21, 20], [-21, 20]]\n")
                .unwrap();
        let model = ShapeModel::from_drawing(&drawing, 1.0, Kind::Height, &ModelOptions::default()).unwrap();
        let (width, height, turn) = (100usize, 80usize, 0.1f64);
        let cell = |i: usize| {
            let (x, y) = ((i % width) as f64 - 50.0, (i / width) as f64 - 40.0);
            let (u, v) = (turn.cos() * x + turn.sin() * y, turn.cos() * y - turn.sin() * x);
            let side = 19.5 + 0.05 * v;
            if v.abs() > 15.0 { f32::NAN } else { 5.0 * (0.5 + (side - u.abs())).clamp(0.0, 1.0) as f32 }
        };
        let layer = Layer::new(Kind::Height, width, height, (0..width * height).map(cell).collect()).unwrap();
        let field = slopes(&layer);
        let fields = [(Kind::Height, &field, 0.1)];
        let free = Free { angle: true, scale: false };
        let mut most = 0.0f64;
        for shift in [-1.5, -0.5, 0.5, 1.5] {
            let start = Pose { x: 50.0 + shift, y: 40.0, angle: turn + 0.04 * shift, scale: 1.0 };
            let r = refine(&fields, &model, start, free, false, 1).unwrap();
            let step = (r.pose.x - start.x).hypot(r.pose.y - start.y);
            most = most.max(step + model.radius * (r.pose.angle - start.angle).abs());
        }
        assert!((1.0..=REACH as f64 + 1e-9).contains(&most), "{most} px");
    }
}
