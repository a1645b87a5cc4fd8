//! In: boards' features in pictures. Out: the least-squares problem with the camera, the board's shape and the
//! boards' poses.
//! Frame and unit: camera_from_board, mm, rad; px (docs/math.md, Camera calibration).

use super::lens::RATIONAL;
use crate::calibrate::boards::shape::{Basis, Shape};
use crate::calibrate::projection::project;
use crate::camera::{Intrinsics, PARAMETERS, Parameters};
use crate::geometry::{Board, Camera, LeftStep, Rigid, Vec2, Vec3};
use crate::solve::{Blocks, Problem, Residuals};
use nalgebra::{Matrix2x3, Matrix2x6};

/// The unknowns.
#[derive(Clone, Debug)]
pub(in crate::calibrate) struct State {
    pub camera: Parameters,
    /// Coefficients of the board's shape, mm; empty for a board that is taken as drawn.
    pub shape: Vec<f64>,
    pub poses: Vec<Rigid<Camera, Board>>,
}

/// One corner: position in the board frame as drawn, pixel, sigma.
pub(in crate::calibrate) type Corner = (Vec3, Vec2, f64);

/// A board whose shape is estimated, and the expected size of its deviation from the drawing.
#[derive(Clone, Copy, Debug)]
pub(in crate::calibrate) struct Bent {
    pub basis: Basis,
    /// Usual size of a coefficient in the board's plane, and of one out of the plane, mm.
    pub usual: [f64; 2],
}

/// Usual size of a board's stretch and shear over half of its length. The two axes of a printer or plotter agree to a
/// thousandth (their makers state 0.1 to 0.2 % of length for each). A camera's focal lengths would hide a larger
/// stretch.
const STRETCH: f64 = 1e-3;

impl Bent {
    pub fn usual_of(&self, term: usize) -> f64 {
        let usual = self.usual[usize::from(Basis::lifts(term))];
        if Basis::stretches(term) { usual.min(STRETCH * self.basis.size()) } else { usual }
    }
}

/// Usual size of the rational terms. Numerator and denominator bend nearly alike. Without this prior, a solve drifts
/// along changes that cancel in both until a pole reaches the picture's rim.
const RATIONAL_SIGMA: f64 = 2.0;

pub(in crate::calibrate) struct Bundle<'a> {
    pub pictures: &'a [Vec<Corner>],
    pub like: &'a Intrinsics,
    /// `None` for a board that is taken as drawn.
    pub bent: Option<Bent>,
    /// Estimated shared parameters: intrinsic ones, then the shape's.
    pub free: Vec<usize>,
}

impl Bundle<'_> {
    /// Number of parameters that all pictures share.
    pub fn shared(&self) -> usize {
        PARAMETERS + self.bent.map_or(0, |_| Basis::LEN)
    }

    /// Position of a corner on the board, mm.
    pub fn place(&self, corner: &Corner, shape: &[f64]) -> Vec3 {
        self.bent.map_or(corner.0, |b| b.basis.place(&corner.0, shape))
    }

    /// The shape at a state.
    pub fn shape(&self, state: &State) -> Option<Shape> {
        self.bent.map(|b| Shape { basis: b.basis, coefficients: state.shape.clone() })
    }

    /// Free parameters that are expected near zero, with their usual size.
    pub fn usual(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let size = |i: usize| match (i.checked_sub(PARAMETERS), self.bent) {
            (Some(term), Some(bent)) => Some(bent.usual_of(term)),
            _ => RATIONAL.contains(&i).then_some(RATIONAL_SIGMA),
        };
        self.free.iter().filter_map(move |&i| Some((i, size(i)?)))
    }

    /// A corner's residuals, and their derivatives by the free shared parameters and by its pose's step, row by row.
    pub fn row(
        &self,
        camera: &Intrinsics,
        shape: &[f64],
        pose: &Rigid<Camera, Board>,
        corner: &Corner,
    ) -> Option<(Vec2, [Vec<f64>; 2])> {
        let (_, pixel, sigma) = corner;
        let terms = self.bent.map_or(Vec::new(), |b| b.basis.terms(&corner.0));
        let x = terms.iter().zip(shape).fold(corner.0, |x, (t, c)| x + t * *c);
        let rotated = pose.rotation * x;
        let q = project(camera, &(rotated + pose.translation))?;
        let by_pose: Matrix2x6<f64> = q.by_point * LeftStep::lever(&rotated);
        let by_place: Matrix2x3<f64> = q.by_point * pose.rotation;
        let by_shape: Vec<Vec2> = terms.iter().map(|t| by_place * t).collect();
        let of = |r: usize| {
            let by = |&i: &usize| if i < PARAMETERS { q.by_intrinsics[(r, i)] } else { by_shape[i - PARAMETERS][r] };
            let shared = self.free.iter().map(by);
            shared.chain(by_pose.row(r).iter().copied()).map(|d| d / sigma).collect()
        };
        Some(((q.pixel - pixel) / *sigma, [of(0), of(1)]))
    }
}

impl Problem for Bundle<'_> {
    type State = State;
    fn width(&self) -> usize {
        self.shared() + 6 * self.pictures.len()
    }
    fn blocks(&self) -> Option<Blocks> {
        Some(Blocks { first: self.shared(), size: 6 })
    }
    fn moved(&self, State { camera, shape, poses }: &State, step: &[f64]) -> State {
        let (shared, rest) = step.split_at(self.shared());
        let (camera_step, shape_step) = shared.split_at(PARAMETERS);
        State {
            camera: camera + Parameters::from_column_slice(camera_step),
            shape: shape.iter().zip(shape_step).map(|(c, s)| c + s).collect(),
            poses: poses.iter().zip(rest.chunks_exact(6)).map(|(p, s)| LeftStep::new(s).moved(p)).collect(),
        }
    }
    fn residuals(&self, State { camera: k, shape, poses }: &State, out: &mut Residuals) -> Option<()> {
        let camera = self.like.with_parameters(k);
        if camera.fx <= 0.0 || camera.fy <= 0.0 {
            return None;
        }
        for (picture, (points, pose)) in self.pictures.iter().zip(poses).enumerate() {
            let first = self.shared() + 6 * picture;
            let columns: Vec<usize> = self.free.iter().copied().chain(first..first + 6).collect();
            for corner in points {
                if !out.wants_jacobian() {
                    let pixel = camera.pixel_from_point(&pose.point(&self.place(corner, shape)))?;
                    let r = (pixel - corner.1) / corner.2;
                    out.group(&[r.x, r.y], &columns, &[]);
                    continue;
                }
                let (r, [across, down]) = self.row(&camera, shape, pose, corner)?;
                out.group(&[r.x, r.y], &columns, &[across, down].concat());
            }
        }
        for (i, usual) in self.usual() {
            let value = if i < PARAMETERS { k[i] } else { shape[i - PARAMETERS] };
            out.prior(&[value / usual], &[i], &[1.0 / usual]);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Distortion;
    use crate::geometry::exp;
    use crate::solve::worst_jacobian_error;

    #[test]
    fn derivatives_by_camera_shape_and_poses_are_right() {
        let board: Vec<Vec3> =
            (0..30).map(|i| Vec3::new(f64::from(i % 6) * 9.0, f64::from(i / 6) * 9.0, 0.0)).collect();
        let mut distortion = Distortion::default();
        distortion.0[..4].copy_from_slice(&[-0.2, 0.05, 1e-3, -5e-4]);
        let like =
            Intrinsics { fx: 700.0, fy: 690.0, cx: 320.0, cy: 240.0, skew: 0.0, distortion, width: 640, height: 480 };
        let basis = Basis::of(&board).unwrap();
        let turns = [Vec3::new(0.3, -0.2, 0.1), Vec3::new(-0.2, 0.4, 1.0)];
        let poses: Vec<_> = turns.iter().map(|r| Rigid::new(exp(r), Vec3::new(-20.0, -15.0, 150.0))).collect();
        let wiggle = |i: usize| Vec2::new((i as f64 * 1.7).sin(), (i as f64 * 2.3).cos());
        let pictures: Vec<Vec<Corner>> = poses
            .iter()
            .map(|p| {
                let seen = |(i, x): (usize, &Vec3)| (*x, like.pixel_from_point(&p.point(x)).unwrap() + wiggle(i), 0.5);
                board.iter().enumerate().map(seen).collect()
            })
            .collect();
        let bent = Some(Bent { basis, usual: [0.1, 0.2] });
        let shape: Vec<f64> = (0..Basis::LEN).map(|i| 0.05 * (i as f64).sin()).collect();
        let bundle = Bundle { pictures: &pictures, like: &like, bent, free: (0..PARAMETERS + Basis::LEN).collect() };
        let state = State { camera: like.parameters(), shape, poses };
        let worst = worst_jacobian_error(&bundle, &state, 1e-6);
        assert!(worst < 1e-4, "{worst}");
    }
}
